// Writer of KITTI's calibration files, for rectified pairs of pinhole cameras.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/file_frame.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan::internal {
namespace {

constexpr double kRounding = 1e-9;  // relative tolerance, and rad

std::string projection(const PinholeModel& m, double x_m) {
  return fmt::format("{} 0 {} {} 0 {} {} 0 0 0 1 0", m.fx, m.cx, 0 - m.fx * x_m, m.fy, m.cy);
}

std::string transform(const Pose& pose) {
  return fmt::format("R: {}\nT: {}\n", rows_of(pose.rotation_matrix()), list_of(pose.translation()));
}

}  // namespace

Result<RectifiedPinholes> rectified_pinholes(const Rig& rig, CalibrationFormat format) {
  const auto cameras = single_pair(rig, format);
  if (!cameras) return failure(cameras);
  const auto left = converted_to<PinholeModel>(cameras->left->model),
             right = converted_to<PinholeModel>(cameras->right->model);
  for (const Camera* camera : {cameras->left, cameras->right}) {
    if (converted_to<PinholeModel>(camera->model)) continue;
    return cannot_hold(*camera, fmt::format("{} supports rectified pinhole cameras only, this one is {}",
                                            name_of(format), name_of(camera->model)));
  }
  const Pose left_from_right = rig.right_from_left(*cameras->pair).inverse();
  const Eigen::Vector3d& t = left_from_right.translation();
  const double rotation_rad = rotation_angle(left_from_right);
  if (rotation_rad > kRounding || t.tail<2>().norm() > kRounding * t.norm() || t.x() <= 0) {
    return cannot_hold(*cameras->right,
                       fmt::format("{} supports rectified pairs only; relative to the left camera, this one is "
                                   "rotated by {:.3g} rad and displaced by ({:.6g}, {:.6g}, {:.6g}) m",
                                   name_of(format), rotation_rad, t.x(), t.y(), t.z()));
  }
  const auto differ = [&](double a, double b) { return std::abs(a - b) > kRounding * left->fx; };
  if (differ(left->fx, right->fx) || differ(left->fy, right->fy) || differ(left->cy, right->cy)) {
    return cannot_hold(*cameras->right,
                       fmt::format("{} supports rectified pairs only; this camera differs from the left one in "
                                   "focal length or principal point row",
                                   name_of(format)));
  }
  return RectifiedPinholes{*cameras, *left, *right, t.x()};
}

Result<CalibrationFiles> write_kitti_calib(const Rig& rig, const std::string& path) {
  const auto pair = rectified_pinholes(rig, CalibrationFormat::kitti);
  if (!pair) return failure(pair);
  return CalibrationFiles{
      {path, fmt::format("P0: {}\nP1: {}\n", projection(pair->left, 0), projection(pair->right, pair->baseline_m))}};
}

Result<CalibrationFiles> write_kitti_raw_calib(const Rig& rig, const std::string& path) {
  const auto pair = rectified_pinholes(rig, CalibrationFormat::kitti_raw);
  if (!pair) return failure(pair);
  std::string text;
  const auto add_camera = [&](const char* number, const Camera& camera, const PinholeModel& m, double x_m) {
    const std::string size = fmt::format("{} {}", camera.size.width, camera.size.height);
    text += fmt::format(
        "S_{0}: {1}\nK_{0}: {2} 0 {3} 0 {4} {5} 0 0 1\nD_{0}: 0 0 0 0 0\nR_{0}: 1 0 0 0 1 0 0 0 1\nT_{0}: {6} 0 0\n"
        "S_rect_{0}: {1}\nR_rect_{0}: 1 0 0 0 1 0 0 0 1\nP_rect_{0}: {7}\n",
        number, size, m.fx, m.cx, m.fy, m.cy, 0 - x_m, projection(m, x_m));
  };
  add_camera("00", *pair->cameras.left, pair->left, 0);
  add_camera("01", *pair->cameras.right, pair->right, pair->baseline_m);
  CalibrationFiles files;
  files.reserve(3);
  files.push_back({path, text});
  if (body_is_left_camera(rig, *pair->cameras.pair)) return files;
  // The files need a laser scanner between camera and IMU: it is placed at the left camera, with x forward, y left, z
  // up.
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const Pose velo_from_camera = optical_from_forward().inverse();
  const Pose velo_from_body = velo_from_camera * rig.body_from_camera(pair->cameras.left->name).inverse();
  files.push_back({(folder / "calib_velo_to_cam.txt").string(), transform(velo_from_camera.inverse())});
  files.push_back({(folder / "calib_imu_to_velo.txt").string(), transform(velo_from_body)});
  return files;
}

}  // namespace spartan::internal
