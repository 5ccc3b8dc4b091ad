#include "spartan/system/world_frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "spartan/core/random.h"
#include "spartan/rig/rig.h"

namespace spartan {
namespace {

std::vector<ImuSample> at_rest(const Eigen::Vector3d& up, double gravity, double noise, int count) {
  Random random(5);
  std::vector<ImuSample> samples;
  for (int i = 0; i < count; ++i) {
    ImuSample sample;
    sample.stamp.ns = i * 5'000'000;
    sample.accel_m_s2 = gravity * up.normalized();
    for (int k = 0; k < 3; ++k) sample.accel_m_s2[k] += noise * random.normal();
    samples.push_back(sample);
  }
  return samples;
}

TEST(WorldFrame, FindsUpFromAnImuAtRest) {
  const Eigen::Vector3d up = Eigen::Vector3d(0.2, -0.1, 0.97).normalized();
  const auto measured = measure_up(at_rest(up, 9.81, 0.05, 200), 9.81);
  ASSERT_TRUE(measured);
  EXPECT_LT(std::acos(std::min(1.0, measured->dot(up))), 0.002);
}

TEST(WorldFrame, RefusesWhatIsNotGravity) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  EXPECT_FALSE(measure_up(at_rest(up, 9.81, 0.05, 5), 9.81)) << "too few samples";
  EXPECT_FALSE(measure_up(at_rest(up, 1.0, 0.005, 200), 9.81)) << "in units of g";
  EXPECT_FALSE(measure_up(at_rest(up, 9.81, 3.0, 200), 9.81)) << "shaken";
  EXPECT_TRUE(measure_up(at_rest(up, 3.71, 0.02, 200), 3.71)) << "Mars";
  std::vector<ImuSample> broken = at_rest(up, 9.81, 0.01, 50);
  broken[7].accel_m_s2.x() = std::nan("");
  EXPECT_TRUE(measure_up(broken, 9.81)) << "one bad sample does not count";
}

TEST(WorldFrame, StartsAtTheBodyWithZUpAndXAhead) {
  // A camera that looks 30° down and 20° to the left, on a body that is rolled and pitched.
  const Pose tilt = Pose::from_rotation(exp_so3({0, 30 * M_PI / 180, 0}));
  const Pose pan = Pose::from_rotation(exp_so3({0, 0, 20 * M_PI / 180}));
  const Pose body_from_left = Pose::from_translation({0.1, 0.2, 0.9}) * pan * tilt *
                              Pose::from_rotation(optical_from_forward().rotation().conjugate());
  const Eigen::Vector3d up_in_body = Eigen::Vector3d(0.1, -0.2, 0.95).normalized();
  const Pose world_from_body = first_world_from_body(body_from_left, up_in_body);

  EXPECT_LE(world_from_body.translation().norm(), 0.0);
  EXPECT_LE((world_from_body.rotation() * up_in_body - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  const Eigen::Vector3d axis = world_from_body.rotation() * (body_from_left.rotation() * Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(axis.y(), 0.0, 1e-12) << "the optical axis lies in the x-z plane";
  EXPECT_GT(axis.x(), 0.5);
  EXPECT_TRUE(is_rotation(world_from_body.rotation_matrix(), 1e-12));
}

TEST(WorldFrame, KeepsTheStartAttitudeWithoutGravity) {
  const Pose body_from_left = optical_from_forward().inverse();
  const Pose world_from_body = first_world_from_body(body_from_left, std::nullopt);
  EXPECT_LE((world_from_body.matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);
}

TEST(WorldFrame, SurvivesACameraThatLooksStraightDown) {
  const Pose body_from_left = Pose::from_rotation(exp_so3({M_PI, 0, 0}));  // optical axis along −z
  const Pose world_from_body = first_world_from_body(body_from_left, std::nullopt);
  EXPECT_TRUE(is_rotation(world_from_body.rotation_matrix(), 1e-9));
}

}  // namespace
}  // namespace spartan
