#include "spartan/camera/internal/layouts/name_numbers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

using ::testing::ElementsAre;

std::vector<std::int64_t> values_of(const std::vector<std::string>& stems) {
  const auto numbers = numbers_in_names(stems);
  return numbers ? numbers->values : std::vector<std::int64_t>();
}

TEST(NameNumbers, AreThoseThatTellNamesApart) {
  EXPECT_THAT(values_of({"000012", "000013"}), ElementsAre(12, 13));
  EXPECT_THAT(values_of({"left0012", "left0014"}), ElementsAre(12, 14));
  EXPECT_THAT(values_of({"cam0_000012_raw8", "cam0_000013_raw8"}), ElementsAre(12, 13));
  EXPECT_THAT(values_of({"1_1403636579763555584", "2_1403636579813555456"}),
              ElementsAre(1403636579763555584, 1403636579813555456))
      << "the longest";
  EXPECT_FALSE(numbers_in_names({"left", "right"}));
  EXPECT_FALSE(numbers_in_names({"a1", "b1"})) << "equal numbers";
  EXPECT_FALSE(numbers_in_names({"a1", "b1_2"}));
  EXPECT_FALSE(numbers_in_names({"99999999999999999999", "99999999999999999998"})) << "too large";
  EXPECT_FALSE(numbers_in_names({}));
}

TEST(NameNumbers, MayBeDecimalSeconds) {
  for (const auto& names : {std::vector<std::string>{"1305031102.175304", "1305031102.211214"},
                            std::vector<std::string>{"img_1305031102_175304000", "img_1305031102_211214000"}}) {
    const auto numbers = numbers_in_names(names);
    ASSERT_TRUE(numbers);
    EXPECT_TRUE(numbers->decimal_seconds);
    EXPECT_THAT(numbers->values, ElementsAre(1305031102175304000, 1305031102211214000));
  }
  EXPECT_FALSE(numbers_in_names({"2024.01.02", "2024.01.03"})->decimal_seconds) << "a date";
}

TEST(StampUnit, FollowsFromTheYear) {
  EXPECT_EQ(stamp_unit({1403636579}), StampUnit::seconds);
  EXPECT_EQ(stamp_unit({1403636579763, 1403636579813}), StampUnit::milliseconds);
  EXPECT_EQ(stamp_unit({1403636579763555, 1403636579813555}), StampUnit::microseconds);
  EXPECT_EQ(stamp_unit({1403636579763555584, 1403636579813555456}), StampUnit::nanoseconds);
}

TEST(StampUnit, FollowsFromTheRate) {
  EXPECT_EQ(stamp_unit({0, 33, 67, 100, 133}), StampUnit::milliseconds);
  EXPECT_EQ(stamp_unit({0, 33333, 66666}), StampUnit::microseconds);
  EXPECT_EQ(stamp_unit({500'000'000, 600'000'000, 700'000'000}), StampUnit::nanoseconds);
  EXPECT_EQ(stamp_unit({0, 1, 2, 3}), std::nullopt) << "frame numbers";
  EXPECT_EQ(stamp_unit({0, 10, 20, 30}), std::nullopt) << "every tenth frame";
  EXPECT_EQ(stamp_unit({7}), std::nullopt);
  EXPECT_EQ(stamp_unit({}), std::nullopt);
  EXPECT_EQ(stamp_unit({0, 3'000, 6'000}), std::nullopt) << "neither 333 Hz nor every third second";
}

TEST(StampUnit, ConvertsWithinTheRangeOfStamps) {
  EXPECT_EQ(to_stamp(1403636579763, StampUnit::milliseconds)->ns, 1403636579763000000);
  EXPECT_EQ(to_stamp(-5, StampUnit::seconds)->ns, -5'000'000'000);
  EXPECT_FALSE(to_stamp(4'700'000'000, StampUnit::seconds));
}

}  // namespace
}  // namespace spartan::internal
