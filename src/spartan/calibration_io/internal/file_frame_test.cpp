// The choice of the body frame for formats with one file per camera.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/pose.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

// Two pinhole cameras in a frame with x forward, y left, z up, rotated by yaw and then by pitch (positive looks down).
Rig pair_in_body(double yaw_deg, double pitch_deg, const Eigen::Vector3d& position) {
  const Pose looks(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_deg * kRadiansPerDegree, Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(pitch_deg * kRadiansPerDegree, Eigen::Vector3d::UnitY())),
                   position);
  Rig rig;
  rig.name = "r";
  rig.pairs = {{"stereo", "left", "right"}};
  for (const auto& [name, side] : {std::pair{"left", 0.06}, {"right", -0.06}}) {
    Camera camera;
    camera.name = name;
    camera.size = {640, 480};
    camera.model = PinholeModel{500, 500, 320, 240};
    camera.mount_from_camera = looks * Pose::from_translation({0, side, 0}) * optical_from_forward().inverse();
    rig.cameras.push_back(camera);
  }
  return rig;
}

// The rig with both cameras in another frame.
Rig seen_from(const Pose& frame_from_body, Rig rig) {
  for (Camera& camera : rig.cameras) camera.mount_from_camera = frame_from_body * camera.mount_from_camera;
  return rig;
}

// Writes and reads `rig` with its body as the frame of the files.
LoadedRig through_files(const Rig& rig, const char* name = "pair.cahvor") {
  const TemporaryFolder folder;
  const auto files =
      to_calibration_files(rig, calibration_format_for_path(name).value(), folder.path() + "/" + name).value();
  for (const CalibrationFile& file : files) folder.write(file.path.substr(folder.path().size() + 1), file.content);
  return read_calibration(files[0].path + "," + files[1].path, {640, 480}).value();
}

double apart(const Rig& a, const Rig& b) {
  const Pose off = a.body_from_camera("left").inverse() * b.body_from_camera("left");
  return off.translation().norm() + rotation_angle(off);
}

// Transform from x forward, y left, z up to x forward, y right, z down.
const Pose kDown = Pose::from_unit_quaternion({0, 1, 0, 0}, Eigen::Vector3d::Zero());

TEST(FileFrame, SupportsSteepTilts) {
  for (const char* name : {"pair.cahvor", "pair.tsai", "pair.cameramodel"}) {
    for (const double pitch : {-85, -50, -20, 0, 20, 44, 50, 70, 85}) {
      const Rig rig = pair_in_body(10, pitch, {1, 0.06, 1});
      const LoadedRig kept = through_files(rig, name);
      EXPECT_LE(apart(rig, kept.rig), 1e-9) << name << ", " << pitch;
      EXPECT_TRUE(kept.ignored.empty());
      // The same files in a frame with z down.
      const LoadedRig turned = through_files(seen_from(kDown, rig), name);
      EXPECT_LE(apart(rig, turned.rig), 1e-9) << name << ", " << pitch;
      EXPECT_THAT(turned.body, HasSubstr("forward-right-down"));
    }
  }
}

// A backward-looking pair of a rover has the same body frame as a forward-looking one.
TEST(FileFrame, BackwardLookingPairsKeepTheFrame) {
  for (const double yaw : {180, 165, -170}) {
    for (const double pitch : {-30, 0, 37, 60}) {
      const Rig rig = pair_in_body(yaw, pitch, {-0.7, 0.08, 0.5});
      const LoadedRig up = through_files(rig), down = through_files(seen_from(kDown, rig));
      EXPECT_LE(apart(rig, up.rig), 1e-9) << yaw << ", " << pitch;
      EXPECT_LE(apart(rig, down.rig), 1e-9) << yaw << ", " << pitch;
      EXPECT_THAT(up.body, HasSubstr("looks backward"));
      EXPECT_THAT(down.body, HasSubstr("looks backward"));
    }
  }
}

TEST(FileFrame, OtherFramesAreReportedAsLost) {
  // An Earth-centred frame; the optical frame of another camera; a vertical camera; a camera that looks sideways.
  const Rig on_earth = pair_in_body(0, 30, {-2665990.6, -3838640.2, 4312790.1});
  const Rig of_camera = seen_from(optical_from_forward(), pair_in_body(0, 0, {0, 0.5, 0}));
  for (const Rig& rig : {on_earth, of_camera, pair_in_body(0, 90, {1, 0, 1}), pair_in_body(90, 10, {1, 0, 1})}) {
    const LoadedRig read = through_files(rig);
    EXPECT_THAT(read.body, HasSubstr("the left camera"));
    EXPECT_LE((optical_from_forward() * read.rig.body_from_camera("left")).translation().norm(), 1e-12);
    ASSERT_EQ(read.ignored.size(), 1u);
    EXPECT_EQ(read.ignored[0].key, "body");
    EXPECT_THAT(read.ignored[0].text, HasSubstr("the frame of the files is not kept; in it, the left camera is at ("));
  }
  // The optical frame of the left camera contains no further information.
  const Rig own =
      seen_from(optical_from_forward() * Pose::from_translation({0, -0.06, 0}), pair_in_body(0, 0, {0, 0, 0}));
  EXPECT_TRUE(through_files(own).ignored.empty());
}

}  // namespace
}  // namespace spartan::internal
