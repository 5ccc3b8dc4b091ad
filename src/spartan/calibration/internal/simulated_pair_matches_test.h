// A stereo pair of known calibration, synthetic matches of it, and checks of its inspection.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "spartan/calibration/pair_check.h"
#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"

namespace spartan::testing {

inline constexpr ImageSize kSize{752, 480};

inline Camera camera(const std::string& name, const CameraModel& model) {
  Camera made;
  made.name = name;
  made.size = kSize;
  made.model = model;
  return made;
}

// Two lenses with distortion, a baseline of 11 cm, and a small rotation between the cameras.
inline Rig true_rig() {
  const Pose left_from_right(exp_so3({0.004, -0.006, 0.003}), {0.11, 0.001, -0.0005});
  return rig_of_one_pair(
      "true", camera("left", RadialTangentialModel({458.6, 457.3, 367.2, 248.4}, {-0.283, 0.074, 2e-4, 2e-5})),
      camera("right", RadialTangentialModel({457.6, 456.1, 379.9, 255.2}, {-0.284, 0.0745, -1e-4, -3e-5})),
      left_from_right.inverse());
}

// The same rig without distortion.
inline Rig distortion_free_rig() {
  Rig rig = true_rig();
  for (Camera& c : rig.cameras) c.model = std::get<RadialTangentialModel>(c.model).pinhole();
  return rig;
}

// Matches of points on the ground, on walls and far away, with noise of 0.15 px; one in twelve is an outlier.
inline std::vector<PixelMatch> simulate_matches(const Rig& rig, int count = 700, std::uint64_t seed = 1) {
  Random random(seed);
  const StereoPair& pair = rig.pairs.front();
  const Camera &left = *rig.find_camera(pair.left), &right = *rig.find_camera(pair.right);
  const Pose right_from_left = rig.right_from_left(pair);
  std::vector<PixelMatch> matches;
  while (std::ssize(matches) < count) {
    const Eigen::Vector2d pixel(random.uniform(0, kSize.width - 1), random.uniform(0, kSize.height - 1));
    const auto ray = unproject(left.model, pixel);
    if (!ray) continue;
    // Below the horizon the ground 1 m below the cameras, above it walls and hills from 3 m away.
    const double depth = ray->direction.y() > 0.08 ? 1 / ray->direction.y() : std::exp(random.uniform(1, 6));
    const auto projected = project(right.model, right_from_left * (depth * ray->direction));
    if (!projected || projected->x() < 0 || projected->x() > kSize.width - 1 || projected->y() < 0 ||
        projected->y() > kSize.height - 1)
      continue;
    Eigen::Vector2d found = *projected + 0.15 * Eigen::Vector2d(random.normal(), random.normal());
    if (random.uniform(0, 12) < 1) found = {random.uniform(0, kSize.width - 1), random.uniform(0, kSize.height - 1)};
    matches.push_back({pixel, found});
  }
  return matches;
}

inline PairCheck check(const Rig& nominal, const std::vector<PixelMatch>& matches) {
  return check_pair(nominal, nominal.pairs.front(), matches, kSize);
}

inline std::vector<std::string> ids(const PairCheck& result) {
  std::vector<std::string> names;
  names.reserve(result.findings.size());
  for (const RigFinding& finding : result.findings) names.push_back(finding.id);
  return names;
}

// The rig with left_from_right replaced.
inline Rig with_pose(Rig rig, const Pose& left_from_right) {
  rig.cameras[1].mount_from_camera = rig.cameras[0].mount_from_camera * left_from_right;
  return rig;
}
inline Pose left_from_right(const Rig& rig) {
  return rig.right_from_left(rig.pairs.front()).inverse();
}

// The corrected rig must pass the check, and agree with the true rig up to `angle_deg` of rotation.
inline void expect_corrected(const Rig& truth, const PairCheck& result, double angle_deg = 0.15) {
  const auto again = check(*result.corrected, simulate_matches(truth, 700, 2));
  EXPECT_THAT(ids(again), ::testing::IsEmpty());
  EXPECT_EQ(again.grade, PairGrade::good);
  const Pose difference = left_from_right(truth).inverse() * left_from_right(*result.corrected);
  EXPECT_LE(rotation_angle(difference) / kRadiansPerDegree, angle_deg);
}

}  // namespace spartan::testing
