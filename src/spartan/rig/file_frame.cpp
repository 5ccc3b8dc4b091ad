#include "spartan/rig/file_frame.h"

#include "spartan/rig/pair_of_files.h"

namespace spartan::rig_detail {
namespace {

// Whether the largest part of v is along the axis, in the direction of `sign`.
bool mostly_along(const Eigen::Vector3d& v, Eigen::Index axis, double sign) {
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  return largest == axis && sign * v[axis] > 0;
}

}  // namespace

ReadRig rig_in_frame_of_files(CalibrationFormat format, Camera left, Camera right) {
  const Eigen::Matrix3d axes = left.mount_from_camera.rotation_matrix();
  const auto looks = [&](double sign) {
    return mostly_along(axes.col(0), 1, sign) && mostly_along(axes.col(1), 2, sign);
  };
  ReadRig read;
  read.format = format;
  if (!looks(-1) && !looks(1)) {
    const Pose right_from_left = right.mount_from_camera.inverse() * left.mount_from_camera;
    read.rig = rig_of_one_pair(std::string(name_of(format)), std::move(left), std::move(right), right_from_left);
    read.notes = {"body: the left camera, turned to x forward, y left, z up (it does not look along the files' frame)"};
    return read;
  }
  if (looks(1)) {
    const Pose body_from_file = Pose::from_unit_quaternion({0, 1, 0, 0}, Eigen::Vector3d::Zero());
    left.mount_from_camera = body_from_file * left.mount_from_camera;
    right.mount_from_camera = body_from_file * right.mount_from_camera;
    read.notes = {"body: the files' frame, which is forward-right-down, turned to x forward, y left, z up"};
  } else {
    read.notes = {"body: the files' frame, along which the left camera looks forward"};
  }
  read.rig.name = name_of(format);
  read.rig.pairs = {{"stereo", left.name, right.name}};
  read.rig.cameras = {std::move(left), std::move(right)};
  return read;
}

Result<ReadRig> read_two_files(CalibrationFormat format, const std::string& left_path, const std::string& right_path,
                               const EyeReader& read_eye) {
  auto left = read_eye(left_path, "left");
  if (!left) return failure(std::move(left));
  auto right = read_eye(right_path, "right");
  if (!right) return failure(std::move(right));
  ReadRig read = rig_in_frame_of_files(format, std::move(*left), std::move(*right));
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
