#include "spartan/localization/localization_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace spartan {
namespace {

using ::testing::HasSubstr;

TEST(LocalizationOptions, SpecifiedNoiseReplacesDefaults) {
  const LocalizationOptions defaults;
  const LocalizationOptions all = with_specified_noise(defaults, {{1, 2, 3, 4, 5, 6}, {7}, {8, 9}});
  EXPECT_EQ(all.imu.gyro_noise_rad_s_sqrt_hz, 1);
  EXPECT_EQ(all.imu.gyro_bias_sigma_rad_s, 2);
  EXPECT_EQ(all.imu.gyro_walk_rad_s2_sqrt_hz, 3);
  EXPECT_EQ(all.imu.accel_noise_m_s2_sqrt_hz, 4);
  EXPECT_EQ(all.imu.accel_bias_sigma_m_s2, 5);
  EXPECT_EQ(all.imu.accel_walk_m_s3_sqrt_hz, 6);
  EXPECT_EQ(all.compass.offset_walk_rad_per_sqrt_s, 7);
  EXPECT_EQ(all.inclinometer.bias_sigma_rad, 8);
  EXPECT_EQ(all.inclinometer.bias_walk_rad_per_sqrt_s, 9);
  const LocalizationOptions one = with_specified_noise(defaults, {{}, {7}, {}});
  EXPECT_EQ(one.compass.offset_walk_rad_per_sqrt_s, 7);
  EXPECT_EQ(one.imu.gyro_bias_sigma_rad_s, defaults.imu.gyro_bias_sigma_rad_s);
  EXPECT_EQ(one.inclinometer.bias_sigma_rad, defaults.inclinometer.bias_sigma_rad);
  LocalizationOptions set;
  set.inclinometer.bias_sigma_rad = 0.2;
  EXPECT_EQ(with_specified_noise(set, {{}, {}, {8, 9}}).inclinometer.bias_sigma_rad, 0.2) << "set in code";
}

TEST(LocalizationOptions, ADefaultThatIsGivenIsNotReplaced) {
  GivenKeys given;
  given.add("imu.gyro_bias_sigma_rad_s");
  given.add("inclinometer.bias_sigma_rad");
  const LocalizationOptions defaults;
  const LocalizationOptions used = with_specified_noise(defaults, {{1, 2, 3, 4, 5, 6}, {7}, {8, 9}}, given);
  EXPECT_EQ(used.imu.gyro_bias_sigma_rad_s, defaults.imu.gyro_bias_sigma_rad_s);
  EXPECT_EQ(used.inclinometer.bias_sigma_rad, defaults.inclinometer.bias_sigma_rad);
  EXPECT_EQ(used.imu.gyro_noise_rad_s_sqrt_hz, 1);
  EXPECT_EQ(used.inclinometer.bias_walk_rad_per_sqrt_s, 9);
}

TEST(LocalizationOptions, DriftOfVisionNeedsSixSigmas) {
  for (const char* key : {"drift_sigma_ratios", "constant_sigma_ratios"}) {
    for (const char* list : {"[1, 2, 3]", "[]", "[1, 2, 3, 4, 5, 6, 7]"}) {
      const auto options =
          parse_options<LocalizationOptions>(std::string("vision: {") + key + ": " + list + "}\n", "run.yaml");
      ASSERT_FALSE(options) << key << ": " << list;
      EXPECT_EQ(options.error().code, ErrorCode::configuration);
      EXPECT_THAT(options.error().message(), HasSubstr(std::string("run.yaml:1: vision.") + key));
      EXPECT_THAT(options.error().message(), HasSubstr("must have 6"));
    }
  }
  LocalizationOptions in_code;
  in_code.vision.drift_sigma_ratios = {1, 2, 3};
  const Status checked = validate(in_code, "localization options");
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().message(), HasSubstr("vision.drift_sigma_ratios has 3 numbers, must have 6"));
}

}  // namespace
}  // namespace spartan
