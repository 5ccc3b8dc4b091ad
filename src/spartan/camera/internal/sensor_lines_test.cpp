#include "spartan/camera/internal/sensor_lines.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numbers>
#include <string>
#include <variant>
#include <vector>

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;

constexpr Stamp kNow{1'700'000'000'000'000'000};
constexpr SensorLines::Arrival kArrival{kNow, kNow};

// A stamp as text, some seconds after kNow.
std::string at(double seconds) {
  return std::to_string(kNow.ns + Stamp::from_seconds(seconds).ns);
}

class SensorLinesTest : public ::testing::Test {
 protected:
  std::vector<Sample> take_all() {
    std::vector<Sample> samples;
    while (auto sample = lines_.take()) samples.push_back(std::move(*sample));
    return samples;
  }
  SensorLines lines_{"sensors", Eigen::Quaterniond::Identity()};
};

TEST_F(SensorLinesTest, EachSensorHasARow) {
  lines_.add("imu," + at(0) + ",0.1,0.2,0.3,1,2,9.8\nwheels," + at(0.1) + ",1.5,-2\r\n compass , " + at(0.2) +
                 " , 0.5,0.01\n\ninclinometer," + at(0.3) + ",0.1,-0.2,0.005,more\n",
             kArrival);
  const auto samples = take_all();
  ASSERT_EQ(samples.size(), 4U);
  EXPECT_EQ(std::get<ImuSample>(samples[0]).gyro_rad_s, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(std::get<ImuSample>(samples[0]).accel_m_s2, Eigen::Vector3d(1, 2, 9.8));
  EXPECT_EQ(std::get<ImuSample>(samples[0]).stamp, kNow);
  EXPECT_EQ(std::get<WheelSample>(samples[1]).right_m, -2);
  EXPECT_EQ(std::get<CompassSample>(samples[2]).heading_rad, 0.5);
  EXPECT_EQ(std::get<InclinometerSample>(samples[3]).sigma_rad, 0.005);
  EXPECT_EQ(lines_.discarded().unreadable + lines_.discarded().reversed, 0);
}

TEST_F(SensorLinesTest, ALineWithoutAStampIsOfItsArrival) {
  lines_.add("wheels,,1,2\n", kArrival);
  EXPECT_EQ(stamp_of(take_all().at(0)), kNow);
}

TEST_F(SensorLinesTest, TheImuIsTurnedIntoTheBody) {
  const double quarter = std::numbers::pi / 2;
  SensorLines lines("sensors", Eigen::Quaterniond(Eigen::AngleAxisd(quarter, Eigen::Vector3d::UnitZ())));
  lines.add("imu,,1,0,0,0,1,0\n", kArrival);
  const auto imu = std::get<ImuSample>(*lines.take());
  EXPECT_TRUE(imu.gyro_rad_s.isApprox(Eigen::Vector3d(0, 1, 0), 1e-12));
  EXPECT_TRUE(imu.accel_m_s2.isApprox(Eigen::Vector3d(-1, 0, 0), 1e-12));
}

TEST_F(SensorLinesTest, OneWrongLineHarmsOneSample) {
  for (const std::string wrong : {"gps,1,2,3", "imu,1,2,3", "wheels,x,1,2", "wheels,,1,nan", "wheels,,1,1e999",
                                  "wheels", ",", "\x01\xff", "wheels,0,1,2", "wheels,9223372036854775807,1,2"}) {
    const std::int64_t before = lines_.discarded().unreadable;
    lines_.add(wrong + "\n", kArrival);
    EXPECT_EQ(lines_.discarded().unreadable, before + 1) << wrong;
  }
  EXPECT_TRUE(take_all().empty());
  EXPECT_EQ(lines_.discarded().first_unreadable,
            "sensors: 'gps,1,2,3': it begins with none of imu, wheels, compass and inclinometer");
  lines_.add("wheels," + at(0) + ",1,2\n", kArrival);
  EXPECT_EQ(take_all().size(), 1U);
}

TEST_F(SensorLinesTest, AStampFarFromTheClockIsWrong) {
  lines_.add("wheels," + at(-70) + ",1,2\nwheels," + at(1.1) + ",1,2\nwheels," + at(-50) + ",1,2\n", kArrival);
  EXPECT_EQ(take_all().size(), 1U);
  EXPECT_THAT(lines_.discarded().first_unreadable, HasSubstr("its stamp is -70 s off the clock of this computer"));
}

// A correction of the system's time does not reach the stamps of the images.
TEST_F(SensorLinesTest, StampsAreOnTheClockOfTheImages) {
  const Stamp system{kNow.ns + 3'000'000'000};
  lines_.add("wheels," + at(2.9) + ",1,2\nwheels,,1,2\n", {kNow, system});
  const auto samples = take_all();
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(stamp_of(samples[0]).ns, kNow.ns - 100'000'000);
  EXPECT_EQ(stamp_of(samples[1]), kNow);
}

TEST_F(SensorLinesTest, TheOldestOfTooManyIsDiscarded) {
  const auto most = static_cast<int>(SensorLines::kMostWaiting);
  for (int i = 0; i < most + 3; ++i) lines_.add(fmt::format("wheels,{},{},0\n", kNow.ns + i, i), kArrival);
  const auto samples = take_all();
  ASSERT_EQ(samples.size(), SensorLines::kMostWaiting);
  EXPECT_EQ(std::get<WheelSample>(samples.front()).left_m, 3);
  EXPECT_EQ(lines_.discarded().unreadable, 3);
}

TEST_F(SensorLinesTest, StampsOfASensorIncrease) {
  lines_.add("wheels," + at(0.1) + ",1,2\nwheels," + at(0.1) + ",1,2\nwheels," + at(0) + ",1,2\nwheels," + at(0.2) +
                 ",1,2\ncompass," + at(0) + ",1,0.1\n",
             kArrival);
  EXPECT_EQ(take_all().size(), 3U);
  EXPECT_EQ(lines_.discarded().reversed, 2);
}

TEST_F(SensorLinesTest, ALineThatNeverEndsTakesNoMemoryAndIsLeftOut) {
  for (int i = 0; i < 1000; ++i) lines_.add(std::string(5000, '1'), kArrival);
  lines_.add("\nwheels,,1,2\n", kArrival);
  EXPECT_EQ(take_all().size(), 1U);
  EXPECT_EQ(lines_.discarded().unreadable, 1);
  EXPECT_THAT(lines_.discarded().first_unreadable, HasSubstr("too long"));
}

RC_GTEST_PROP(SensorLinesProperty, BytesMayArriveInAnyParts, ()) {
  std::string text;
  for (int i = 0; i < 20; ++i) text += fmt::format("wheels,{},{},{}\n", at(0.01 * i), i, 2 * i);
  SensorLines lines("sensors", Eigen::Quaterniond::Identity());
  for (std::string_view left = text; !left.empty();) {
    const auto n = *rc::gen::inRange<std::size_t>(1, 40);
    lines.add(left.substr(0, n), kArrival);
    left.remove_prefix(std::min(n, left.size()));
  }
  for (int i = 0; i < 20; ++i) {
    const auto sample = lines.take();
    RC_ASSERT(sample.has_value());
    RC_ASSERT(std::get<WheelSample>(*sample).left_m == i);
  }
  RC_ASSERT(!lines.take().has_value());
}

}  // namespace
}  // namespace spartan::internal
