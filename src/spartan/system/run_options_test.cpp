#include "spartan/system/run_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace spartan {
namespace {

TEST(RunOptions, EveryBasicOptionExists) {
  const std::vector<OptionLine> all = list_options(RunOptions());
  for (const std::string_view key : basic_options()) {
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const OptionLine& line) { return line.key == key; })) << key;
  }
  EXPECT_LE(basic_options().size(), 30U);
}

TEST(RunOptions, BasicOptionsAreDumpedAndReadBack) {
  RunOptions options;
  options.mapping.map.cell_m = 0.1;
  options.odometry.motion.inlier_sigmas = 5;  // an expert option
  const std::string text = dump_basic_options(options);
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '#')), basic_options().size());
  EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("inlier_sigmas")));
  const auto read = parse_options<RunOptions>(text, "basic");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->mapping.map.cell_m, 0.1);
  EXPECT_EQ(read->odometry.motion.inlier_sigmas, RunOptions().odometry.motion.inlier_sigmas);
}

}  // namespace
}  // namespace spartan
