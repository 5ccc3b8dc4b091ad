#include "spartan/rig/formats/file_frame.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "spartan/rig/formats/calibration_readers.h"
#include "spartan/rig/formats/pair_of_files.h"

namespace spartan::rig_detail {
namespace {

// A rover is not larger; cameras that stand farther off are in a frame of the world, often with the Earth's centre.
constexpr double kLargestRover_m = 100;
// Closer to straight up or down than this (a degree) a camera does not tell where forward is.
constexpr double kLeastLevel = 0.0175;

// How a camera stands in a frame whose x is forward: which end of z is up, and whether it looks ahead.
struct Stance {
  bool z_up, ahead;
};

// Right is sideways for a camera that looks along x, ahead or back, however it is tilted; and down is below the level
// then. An upside-down camera cannot be told from one in a frame that is.
std::optional<Stance> stance_in_rover(const Pose& file_from_camera) {
  if (!(file_from_camera.translation().norm() <= kLargestRover_m)) return std::nullopt;
  const Eigen::Matrix3d axes = file_from_camera.rotation_matrix();
  const Eigen::Vector3d right = axes.col(0), down = axes.col(1);
  Eigen::Index largest = 0;
  right.cwiseAbs().maxCoeff(&largest);
  if (largest != 1 || std::abs(down.z()) < kLeastLevel) return std::nullopt;
  const bool z_up = down.z() < 0;
  return Stance{z_up, z_up == (right.y() < 0)};
}

// The body is the left camera; where that stands in its files is lost, unless they are in its own frame.
ReadRig rig_in_frame_of_camera(CalibrationFormat format, Camera left, Camera right) {
  ReadRig read;
  read.body = std::string(kBodyIsLeftCamera) + " (in the files' frame it does not stand as on a rover)";
  const Pose place = left.mount_from_camera;
  if (place.translation().norm() > 1e-12 || rotation_angle(place) > 1e-12) {
    read.left_out = {{"body", fmt::format("the files' frame is not kept; the left camera stands there at ({:.10g}, "
                                          "{:.10g}, {:.10g}), turned by {:.6g} degrees",
                                          place.translation().x(), place.translation().y(), place.translation().z(),
                                          rotation_angle(place) * 180 / std::numbers::pi)}};
  }
  const Pose right_from_left = right.mount_from_camera.inverse() * place;
  read.rig = rig_of_one_pair(std::string(name_of(format)), std::move(left), std::move(right), right_from_left);
  return read;
}

}  // namespace

ReadRig rig_in_frame_of_files(CalibrationFormat format, Camera left, Camera right) {
  const auto stance = stance_in_rover(left.mount_from_camera);
  ReadRig read;
  if (stance && right.mount_from_camera.translation().norm() <= kLargestRover_m) {
    if (!stance->z_up) {
      const Pose body_from_file = Pose::from_unit_quaternion({0, 1, 0, 0}, Eigen::Vector3d::Zero());
      left.mount_from_camera = body_from_file * left.mount_from_camera;
      right.mount_from_camera = body_from_file * right.mount_from_camera;
    }
    read.body = stance->z_up ? "the files' frame"
                             : "the files' frame, which is forward-right-down, turned to x forward, y left, z up";
    read.body += stance->ahead ? "; the left camera looks forward along it" : "; the left camera looks back along it";
    read.rig.name = name_of(format);
    read.rig.pairs = {{"stereo", left.name, right.name}};
    read.rig.cameras = {std::move(left), std::move(right)};
  } else {
    read = rig_in_frame_of_camera(format, std::move(left), std::move(right));
  }
  read.format = format;
  return read;
}

Result<ReadRig> read_two_files(CalibrationFormat format, const std::string& left_path, const std::string& right_path,
                               const EyeReader& read_eye) {
  auto left = read_eye(left_path, "left");
  if (!left) return failure(std::move(left));
  auto right = read_eye(right_path, "right");
  if (!right) return failure(std::move(right));
  ReadRig read = rig_in_frame_of_files(format, std::move(left->camera), std::move(right->camera));
  for (const auto* eye : {&*left, &*right}) {
    read.left_out.insert(read.left_out.end(), eye->left_out.begin(), eye->left_out.end());
  }
  read.files = {left_path, right_path};
  if (const Status sound = read.rig.validate(left_path + " and " + right_path); !sound) return failure(sound);
  return read;
}

Result<CalibrationFiles> write_two_files(const Rig& rig, CalibrationFormat format, const std::string& path,
                                         const EyeWriter& text_of) {
  const auto eyes = only_pair(rig, format);
  if (!eyes) return failure(eyes);
  const Pose file_from_body = body_is_left_camera(rig, *eyes->pair) ? optical_from_forward() : Pose();
  const auto left = text_of(*eyes->left, file_from_body * rig.body_from_camera(eyes->left->name));
  if (!left) return failure(left);
  const auto right = text_of(*eyes->right, file_from_body * rig.body_from_camera(eyes->right->name));
  if (!right) return failure(right);
  const PairOfFiles names = names_of_pair(path);
  return CalibrationFiles{{names.left, *left}, {names.right, *right}};
}

bool body_is_left_camera(const Rig& rig, const StereoPair& pair) {
  if (rig.convention != PoseConvention::left_optical) return false;
  const Pose off = optical_from_forward() * rig.body_from_camera(pair.left);
  return off.translation().norm() < 1e-12 && rotation_angle(off) < 1e-12;
}

}  // namespace spartan::rig_detail
