#include "spartan/calibration_io/internal/file_frame.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "spartan/calibration_io/internal/calibration_readers.h"
#include "spartan/calibration_io/internal/pair_of_files.h"

namespace spartan::internal {
namespace {

// Maximum distance of a camera from the body origin; farther cameras are in a world frame, often Earth-centred.
constexpr double kLargestRover_m = 100;
// sin of 1°: a camera that looks within one degree of vertical does not determine the forward direction.
constexpr double kMinSine = 0.0175;

// The orientation of a camera in a frame whose x is forward: whether z is up, and whether the camera looks forward.
struct ForwardFrame {
  bool z_up, looks_forward;
};

// For a camera that looks forward or backward along x with any tilt, its right axis is along ±y and its down axis has a
// vertical component. An upside-down camera cannot be distinguished from an upside-down frame.
std::optional<ForwardFrame> forward_frame_of(const Pose& file_from_camera) {
  if (!(file_from_camera.translation().norm() <= kLargestRover_m)) return std::nullopt;
  const Eigen::Matrix3d axes = file_from_camera.rotation_matrix();
  const Eigen::Vector3d right = axes.col(0), down = axes.col(1);
  Eigen::Index largest = 0;
  right.cwiseAbs().maxCoeff(&largest);
  if (largest != 1 || std::abs(down.z()) < kMinSine) return std::nullopt;
  const bool z_up = down.z() < 0;
  return ForwardFrame{z_up, z_up == (right.y() < 0)};
}

// The body is the left camera. Its pose in the frame of the files is lost, unless it is the identity.
LoadedRig rig_in_frame_of_camera(CalibrationFormat format, Camera left, Camera right) {
  LoadedRig read;
  read.body = std::string(kBodyIsLeftCamera) + " (the frame of the files is not plausible as a body frame)";
  const Pose file_from_left = left.mount_from_camera;
  if (file_from_left.translation().norm() > 1e-12 || rotation_angle(file_from_left) > 1e-12) {
    read.ignored = {{"body", fmt::format("the frame of the files is not kept; in it, the left camera is at ({:.10g}, "
                                         "{:.10g}, {:.10g}), rotated by {:.6g} degrees",
                                         file_from_left.translation().x(), file_from_left.translation().y(),
                                         file_from_left.translation().z(),
                                         rotation_angle(file_from_left) * 180 / std::numbers::pi)}};
  }
  const Pose right_from_left = right.mount_from_camera.inverse() * file_from_left;
  read.rig = rig_of_one_pair(std::string(name_of(format)), std::move(left), std::move(right), right_from_left);
  return read;
}

}  // namespace

LoadedRig rig_in_frame_of_files(CalibrationFormat format, Camera left, Camera right) {
  const auto frame = forward_frame_of(left.mount_from_camera);
  LoadedRig read;
  if (frame && right.mount_from_camera.translation().norm() <= kLargestRover_m) {
    if (!frame->z_up) {
      const Pose body_from_file = Pose::from_unit_quaternion({0, 1, 0, 0}, Eigen::Vector3d::Zero());
      left.mount_from_camera = body_from_file * left.mount_from_camera;
      right.mount_from_camera = body_from_file * right.mount_from_camera;
    }
    read.body = frame->z_up ? "the frame of the files"
                            : "the frame of the files, which is forward-right-down, turned to x forward, y left, z up";
    read.body += frame->looks_forward ? "; the left camera looks forward" : "; the left camera looks backward";
    read.rig.name = name_of(format);
    read.rig.pairs = {{"stereo", left.name, right.name}};
    read.rig.cameras = {std::move(left), std::move(right)};
  } else {
    read = rig_in_frame_of_camera(format, std::move(left), std::move(right));
  }
  read.format = format;
  return read;
}

Result<LoadedRig> read_two_files(CalibrationFormat format, const std::string& left_path, const std::string& right_path,
                                 const CameraReader& read_camera) {
  auto left = read_camera(left_path, "left");
  if (!left) return failure(std::move(left));
  auto right = read_camera(right_path, "right");
  if (!right) return failure(std::move(right));
  LoadedRig read = rig_in_frame_of_files(format, std::move(left->camera), std::move(right->camera));
  for (const auto* camera : {&*left, &*right}) {
    read.ignored.insert(read.ignored.end(), camera->ignored.begin(), camera->ignored.end());
  }
  read.files = {left_path, right_path};
  if (const Status valid = read.rig.validate(left_path + " and " + right_path); !valid) return failure(valid);
  return read;
}

Result<CalibrationFiles> write_two_files(const Rig& rig, CalibrationFormat format, const std::string& path,
                                         const CameraWriter& text_of) {
  const auto cameras = single_pair(rig, format);
  if (!cameras) return failure(cameras);
  const Pose file_from_body = body_is_left_camera(rig, *cameras->pair) ? optical_from_forward() : Pose();
  const auto left = text_of(*cameras->left, file_from_body * rig.body_from_camera(cameras->left->name));
  if (!left) return failure(left);
  const auto right = text_of(*cameras->right, file_from_body * rig.body_from_camera(cameras->right->name));
  if (!right) return failure(right);
  const PairOfFiles names = names_of_pair(path);
  return CalibrationFiles{{names.left, *left}, {names.right, *right}};
}

bool body_is_left_camera(const Rig& rig, const StereoPair& pair) {
  if (rig.convention != PoseConvention::left_optical) return false;
  const Pose off = optical_from_forward() * rig.body_from_camera(pair.left);
  return off.translation().norm() < 1e-12 && rotation_angle(off) < 1e-12;
}

}  // namespace spartan::internal
