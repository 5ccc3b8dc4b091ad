// Writer of KITTI's calibration files: rectified pairs of pinholes.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "spartan/rig/formats/calibration_text.h"
#include "spartan/rig/formats/calibration_writers.h"
#include "spartan/rig/formats/file_frame.h"
#include "spartan/rig/models/model_equivalents.h"

namespace spartan::rig_detail {
namespace {

struct RectifiedPinholes {
  Eyes eyes;
  PinholeModel left, right;
  double baseline_m = 0;
};

constexpr double kRounding = 1e-9;

// Two pinholes with the same rows and the same scale, side by side.
Result<RectifiedPinholes> rectified_pinholes(const Rig& rig, CalibrationFormat format) {
  const auto eyes = only_pair(rig, format);
  if (!eyes) return failure(eyes);
  const auto left = expressed_as<PinholeModel>(eyes->left->model),
             right = expressed_as<PinholeModel>(eyes->right->model);
  for (const Camera* camera : {eyes->left, eyes->right}) {
    if (expressed_as<PinholeModel>(camera->model)) continue;
    return cannot_hold(*camera, fmt::format("{} holds rectified pinhole cameras, this one is {}", name_of(format),
                                            name_of(camera->model)));
  }
  const Pose left_from_right = rig.right_from_left(*eyes->pair).inverse();
  const Eigen::Vector3d& t = left_from_right.translation();
  const double turned = rotation_angle(left_from_right);
  if (turned > kRounding || t.tail<2>().norm() > kRounding * t.norm() || t.x() <= 0) {
    return cannot_hold(*eyes->right,
                       fmt::format("{} holds rectified pairs only; this camera is turned by {:.3g} rad and stands "
                                   "({:.6g}, {:.6g}, {:.6g}) m from the left one",
                                   name_of(format), turned, t.x(), t.y(), t.z()));
  }
  const auto differ = [&](double a, double b) { return std::abs(a - b) > kRounding * left->fx; };
  if (differ(left->fx, right->fx) || differ(left->fy, right->fy) || differ(left->cy, right->cy)) {
    return cannot_hold(*eyes->right,
                       fmt::format("{} holds rectified pairs only; this camera has other focal lengths or "
                                   "another middle row than the left one",
                                   name_of(format)));
  }
  return RectifiedPinholes{*eyes, *left, *right, t.x()};
}

std::string projection(const PinholeModel& m, double x_m) {
  return fmt::format("{} 0 {} {} 0 {} {} 0 0 0 1 0", m.fx, m.cx, 0 - m.fx * x_m, m.fy, m.cy);
}

std::string transform(const Pose& pose) {
  return fmt::format("R: {}\nT: {}\n", rows_of(pose.rotation_matrix()), list_of(pose.translation()));
}

}  // namespace

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
  const auto add_eye = [&](const char* number, const Camera& camera, const PinholeModel& m, double x_m) {
    const std::string size = fmt::format("{} {}", camera.size.width, camera.size.height);
    text += fmt::format(
        "S_{0}: {1}\nK_{0}: {2} 0 {3} 0 {4} {5} 0 0 1\nD_{0}: 0 0 0 0 0\nR_{0}: 1 0 0 0 1 0 0 0 1\nT_{0}: {6} 0 0\n"
        "S_rect_{0}: {1}\nR_rect_{0}: 1 0 0 0 1 0 0 0 1\nP_rect_{0}: {7}\n",
        number, size, m.fx, m.cx, m.fy, m.cy, 0 - x_m, projection(m, x_m));
  };
  add_eye("00", *pair->eyes.left, pair->left, 0);
  add_eye("01", *pair->eyes.right, pair->right, pair->baseline_m);
  CalibrationFiles files{{path, text}};
  if (body_is_left_camera(rig, *pair->eyes.pair)) return files;
  // The laser scanner of these files stands at the left camera, turned as the body of a recording without one.
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const Pose velo_from_camera = optical_from_forward().inverse();
  const Pose velo_from_body = velo_from_camera * rig.body_from_camera(pair->eyes.left->name).inverse();
  files.push_back({(folder / "calib_velo_to_cam.txt").string(), transform(velo_from_camera.inverse())});
  files.push_back({(folder / "calib_imu_to_velo.txt").string(), transform(velo_from_body)});
  return files;
}

}  // namespace spartan::rig_detail
