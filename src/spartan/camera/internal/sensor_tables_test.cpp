#include "spartan/camera/internal/sensor_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

// All samples of a table, or the error that ends it.
Result<std::vector<Sample>> read_all(const SensorStreamFactory& open) {
  auto stream = open();
  if (!stream) return failure(stream);
  std::vector<Sample> samples;
  for (;;) {
    auto sample = (*stream)->next();
    if (!sample) return failure(sample);
    if (!*sample) return samples;
    samples.push_back(std::move(**sample));
  }
}

class SensorTables : public ::testing::Test {
 protected:
  Result<std::vector<Sample>> imu(const std::string& text,
                                  const Eigen::Quaterniond& body_from_imu = Eigen::Quaterniond::Identity()) {
    return read_all(stream_of_table(folder_.write("imu.csv", text), {}, 7, read_imu_row(body_from_imu)));
  }
  // The first row that was discarded, and the number of rows of both kinds.
  std::string first_unreadable(const std::string& text, std::int64_t unreadable, int read) {
    const auto stream = stream_of_table(folder_.write("imu.csv", text), {}, 7, read_imu_row({1, 0, 0, 0}))();
    EXPECT_TRUE(stream);
    int count = 0;
    for (auto sample = (*stream)->next(); sample && *sample; sample = (*stream)->next()) ++count;
    EXPECT_EQ(count, read);
    EXPECT_EQ((*stream)->discarded().unreadable, unreadable);
    return (*stream)->discarded().first_unreadable;
  }
  TemporaryFolder folder_;
};

TEST_F(SensorTables, RotatesImuSamplesIntoTheBodyFrame) {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  const auto samples = imu("#t,wx,wy,wz,ax,ay,az\r\n1000, 1,2,3, 4,5,6\r\n2000,0,0,0,0,0,9.81,extra\r\n", quarter);
  ASSERT_TRUE(samples) << samples.error().message();
  ASSERT_EQ(samples->size(), 2U);
  const auto& first = std::get<ImuSample>((*samples)[0]);
  EXPECT_EQ(first.stamp, Stamp{1000});
  EXPECT_TRUE(first.gyro_rad_s.isApprox(Eigen::Vector3d(-2, 1, 3)));
  EXPECT_TRUE(first.accel_m_s2.isApprox(Eigen::Vector3d(-5, 4, 6)));
}

TEST_F(SensorTables, UnreadableRowsAreLeftOutAndNamed) {
  EXPECT_THAT(first_unreadable("1,0,0,0,0,0,1\n2,0,0,nan,0,0,1\n3,0,0,0,0,0,1\n", 1, 2),
              HasSubstr("imu.csv:2: 'nan' is not a finite number"));
  EXPECT_THAT(first_unreadable("1,0,0,0,0,0,1e999\n1.5,x\n", 2, 0),
              HasSubstr("imu.csv:1: '1e999' is not a finite number"));
  EXPECT_THAT(first_unreadable("1,0,0,0,0,0,\n", 1, 0), HasSubstr("imu.csv:1: '' is not a finite number"));
  EXPECT_THAT(first_unreadable("1.5,0,0,0,0,0,1\n", 1, 0), HasSubstr("imu.csv:1: '1.5' is not a time in nanoseconds"));
  EXPECT_THAT(first_unreadable("\n1,0,0,0,0,0\n", 1, 0), HasSubstr("imu.csv:2: 6 values, expected 7"));
  EXPECT_THAT(first_unreadable("1,0,0,0,0,0,1\n" + std::string(3 << 20U, '7') + "\n2,0,0,0,0,0,1\n", 1, 2),
              HasSubstr("imu.csv:2: the line is too long"));
}

TEST_F(SensorTables, OpeningReportsAMissingFile) {
  const auto samples = read_all(stream_of_table(folder_.path() + "/none.csv", {}, 3, read_wheel_row));
  ASSERT_FALSE(samples);
  EXPECT_THAT(samples.error().message(), HasSubstr("none.csv: cannot be read"));
}

TEST_F(SensorTables, ReadsWheelsCompassAndInclinometer) {
  const auto wheels = read_wheel_row({"5", "1.25", "-2"});
  ASSERT_TRUE(wheels);
  EXPECT_EQ(std::get<WheelSample>(*wheels).stamp, Stamp{5});
  EXPECT_EQ(std::get<WheelSample>(*wheels).left_m, 1.25);
  EXPECT_EQ(std::get<WheelSample>(*wheels).right_m, -2);
  const auto compass = read_compass_row({"6", "3.1", "0.02"});
  ASSERT_TRUE(compass);
  EXPECT_EQ(std::get<CompassSample>(*compass).heading_rad, 3.1);
  EXPECT_EQ(std::get<CompassSample>(*compass).sigma_rad, 0.02);
  const auto inclinometer = read_inclinometer_row({"7", "0.1", "-0.2", "0.003"});
  ASSERT_TRUE(inclinometer);
  EXPECT_EQ(std::get<InclinometerSample>(*inclinometer).roll_rad, 0.1);
  EXPECT_EQ(std::get<InclinometerSample>(*inclinometer).pitch_rad, -0.2);
  EXPECT_EQ(std::get<InclinometerSample>(*inclinometer).sigma_rad, 0.003);
  for (const auto& read : {read_wheel_row, read_compass_row}) {
    EXPECT_FALSE(read({"5", "x", "1"}));
    EXPECT_FALSE(read({"5", "1", "inf"}));
    EXPECT_FALSE(read({"", "1", "1"}));
  }
}

}  // namespace
}  // namespace spartan::internal
