// Lengths of lists, and combinations of values.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "spartan/core/options.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

struct WindowOptions {
  std::vector<double> sigmas{1, 1, 1};
  double widest_m = 1, step_m = 0.1;
  template <class Visitor>
  void describe(Visitor& v) {
    v.field("sigmas", sigmas, "along x, y, z", between(0, 10), Length{3});
    v.field("widest_m", widest_m, "half the window", between(0, 10));
    v.field("step_m", step_m, "between trials", between(0, 10));
    v.check("step_m", widest_m <= 100 * step_m, "is less than a hundredth of widest_m");
  }
};

TEST(OptionLengths, ListsOfOtherLengthAreRefused) {
  EXPECT_TRUE(parse_options<WindowOptions>("sigmas: [1, 2, 3]", "w.yaml"));
  for (const char* list : {"[]", "[1, 2]", "[1, 2, 3, 4]"}) {
    const auto options = parse_options<WindowOptions>(std::string("sigmas: ") + list, "w.yaml");
    ASSERT_FALSE(options) << list;
    EXPECT_THAT(options.error().message(), HasSubstr("w.yaml:1: sigmas: has "));
    EXPECT_THAT(options.error().message(), HasSubstr("numbers, must have 3"));
  }
  EXPECT_FALSE(set_option(WindowOptions{}, "sigmas=[1, 2]"));
  WindowOptions in_code;
  in_code.sigmas = {1};
  EXPECT_THAT(validate(in_code, "window").error().message(), HasSubstr("sigmas has 1 numbers, must have 3"));
}

TEST(OptionChecks, ValuesThatDoNotFitEachOtherAreRefused) {
  const auto in_file = parse_options<WindowOptions>("widest_m: 5\nstep_m: 0.01\n", "w.yaml");
  ASSERT_FALSE(in_file);
  EXPECT_THAT(in_file.error().message(), HasSubstr("w.yaml:2: step_m: is less than a hundredth of widest_m"));
  EXPECT_FALSE(parse_options<WindowOptions>("{}", "w.yaml", WindowOptions{{1, 1, 1}, 5, 0.01})) << "neither is given";
  const auto first = set_option(WindowOptions{}, "step_m=0.001");
  ASSERT_TRUE(first) << "the next option on the command line may make them fit";
  EXPECT_TRUE(validate(*set_option(*first, "widest_m=0.05"), "window"));
  EXPECT_THAT(validate(*first, "window").error().message(), HasSubstr("step_m is less than a hundredth of widest_m"));
}

}  // namespace
}  // namespace spartan
