#include "spartan/core/time.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

namespace spartan {
namespace {

std::int64_t ns_of(const std::string& text) {
  const auto stamp = parse_decimal_seconds(text);
  EXPECT_TRUE(stamp) << text;
  return stamp ? stamp->ns : -1;
}

RC_GTEST_PROP(Stamp, RoundTripsThroughText, (std::int64_t ns)) {
  const auto back = parse_decimal_seconds(to_decimal_seconds(Stamp{ns}));
  RC_ASSERT(back.has_value());
  RC_ASSERT(back->ns == ns);
}

TEST(Stamp, RoundTripsItsLimits) {
  for (const std::int64_t ns :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::min() + 1, std::int64_t{-1},
        std::int64_t{0}, std::int64_t{1}, std::int64_t{999'999'999}, std::int64_t{-1'000'000'000},
        std::int64_t{1'403'715'273'262'142'976}, std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(ns_of(to_decimal_seconds(Stamp{ns})), ns);
  }
  EXPECT_EQ(to_decimal_seconds(Stamp{-5}), "-0.000000005");
  EXPECT_EQ(to_decimal_seconds(Stamp{12'000'000'345}), "12.000000345");
}

TEST(Stamp, ParsesDecimalNotations) {
  EXPECT_EQ(ns_of("1.5"), 1'500'000'000);
  EXPECT_EQ(ns_of("+2"), 2'000'000'000);
  EXPECT_EQ(ns_of("-.25"), -250'000'000);
  EXPECT_EQ(ns_of("3."), 3'000'000'000);
  EXPECT_EQ(ns_of("1403715273.262142976"), 1'403'715'273'262'142'976);
  EXPECT_EQ(ns_of("0.1234567899"), 123'456'789) << "digits below a nanosecond are cut off";
  EXPECT_EQ(ns_of("1.036224e-01"), 103'622'400);
  EXPECT_EQ(ns_of("-1.2E3"), -1'200'000'000'000);
}

TEST(Stamp, RejectsInvalidText) {
  for (const char* text : {"", "-", ".", "+-1", "1,5", "1.2.3", "abc", "nan", "inf", "1e400", "1e", "0x10", " 1", "1 ",
                           "9223372036.854775808", "-9223372036.854775809", "99999999999999999999"}) {
    const auto stamp = parse_decimal_seconds(text);
    ASSERT_FALSE(stamp) << text;
    EXPECT_EQ(stamp.error().code, ErrorCode::input);
  }
}

TEST(Stamp, ComparesAndSubtracts) {
  EXPECT_LT(Stamp{1}, Stamp{2});
  EXPECT_DOUBLE_EQ(seconds_between(Stamp{1'403'715'273'262'142'976}, Stamp{1'403'715'273'312'143'104}), 0.050000128);
  EXPECT_EQ(Stamp::from_seconds(-0.5).ns, -500'000'000);
}

}  // namespace
}  // namespace spartan
