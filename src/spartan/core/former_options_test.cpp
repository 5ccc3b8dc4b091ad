// Keys whose values are now stated elsewhere.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/core/options.h"

namespace spartan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct WheelOptions {
  double track_m = 0.6;
  double sigma_m = 0.01;
  template <class Visitor>
  void describe(Visitor& v) {
    v.former("track_m", track_m, 0.6, "rover.track_m in the rig file", between(0.1, 10));
    v.field("sigma_m", sigma_m, "standard deviation", between(0, 1));
  }
};

TEST(FormerOptions, AreReadWithAWarningThatNamesTheNewPlace) {
  const auto read = read_options<WheelOptions>("sigma_m: 0.02\ntrack_m: 0.9\n", "w.yaml");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->options.track_m, 0.9);
  EXPECT_TRUE(read->given.contains("track_m"));
  ASSERT_EQ(read->warnings.size(), 1U);
  EXPECT_THAT(read->warnings[0], HasSubstr("w.yaml:2: track_m is now stated as rover.track_m in the rig file"));
  EXPECT_THAT(read_options<WheelOptions>("sigma_m: 0.02\n", "w.yaml")->warnings, IsEmpty());
  EXPECT_EQ(read_assignment<WheelOptions>("track_m=0.9")->warnings.size(), 1U);
}

TEST(FormerOptions, KeepTheirBounds) {
  EXPECT_THAT(read_options<WheelOptions>("track_m: 20\n", "w.yaml").error().message(),
              HasSubstr("w.yaml:1: track_m: is 20, must be between 0.1 and 10"));
  EXPECT_THAT(validate(WheelOptions{20, 0.01}, "wheels").error().message(), HasSubstr("track_m"));
}

TEST(FormerOptions, AreListedOnlyWhereTheyWereSet) {
  const auto keys = [](const WheelOptions& options) {
    std::vector<std::string> list;
    for (const OptionLine& line : list_options(options)) list.push_back(line.key);
    return list;
  };
  EXPECT_THAT(keys({}), ElementsAre("sigma_m"));
  EXPECT_THAT(keys({0.9, 0.01}), ElementsAre("track_m", "sigma_m"));
  EXPECT_EQ(parse_options<WheelOptions>(dump_options(WheelOptions{0.9, 0.01}), "dump")->track_m, 0.9);
}

}  // namespace
}  // namespace spartan
