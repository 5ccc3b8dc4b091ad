// camera_info of ROS: as camera_calibration_parsers writes it, or a message as `rostopic echo` prints it
// (sensor_msgs/CameraInfo; REP 104). Both eyes are rectified by R; in P of the right one Tx = −fx' b.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "spartan/rig/calibration_text.h"
#include "spartan/rig/calibration_writers.h"
#include "spartan/rig/model_equivalents.h"
#include "spartan/rig/pair_of_files.h"
#include "spartan/rig/rig_files.h"
#include "spartan/rig/yaml_camera.h"

namespace spartan {
namespace {

using rig_detail::YamlFaults;
using rig_detail::YamlMap;

// One file: the camera, its turn into the rectified frame, and its place there.
struct Eye {
  Camera camera;
  Eigen::Quaterniond rectified_from_camera = Eigen::Quaterniond::Identity();
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
};

// The key under which this file has a thing: that of a calibration file, or of a message (of ROS 1, of ROS 2).
std::string key_of(const YamlMap& root, const std::string& in_file, const std::string& in_message) {
  if (root.has(in_file)) return in_file;
  std::string small = in_message;
  std::transform(small.begin(), small.end(), small.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  for (const std::string& key : {in_message, small}) {
    if (root.has(key)) return key;
  }
  return in_file;
}

// {rows, cols, data: […]} or the plain list.
std::optional<std::vector<double>> numbers(YamlMap& root, const std::string& key, const std::vector<int>& counts) {
  const auto node = root.node(key);
  if (!node) return std::nullopt;
  if (node->IsMap()) return YamlMap(*node, root.path(key), root.faults()).numbers("data", counts);
  return root.numbers(key, counts);
}

ImageSize read_size(YamlMap& root) {
  ImageSize size;
  const auto side = [&](const std::string& key) {
    const int pixels = root.integer(key).value_or(1);
    if (pixels < 1) root.fault(key, fmt::format("is {}, must be above zero", pixels));
    return pixels;
  };
  size.width = side(key_of(root, "image_width", "width"));
  size.height = side(key_of(root, "image_height", "height"));
  return size;
}

CameraModel read_model(YamlMap& root) {
  const std::string k_key = key_of(root, "camera_matrix", "K"), d_key = key_of(root, "distortion_coefficients", "D");
  PinholeModel pinhole;
  if (const auto k = numbers(root, k_key, {9})) {
    pinhole = rig_detail::read_camera_matrix(root, k_key, *k).value_or(PinholeModel{});
  }
  const auto kind = root.choice("distortion_model",
                                {"plumb_bob", "rational_polynomial", "equidistant", "fisheye", "radtan", "none", ""});
  if (!kind || *kind == "none" || kind->empty()) return pinhole;
  if (*kind == "equidistant" || *kind == "fisheye") {
    const auto d = numbers(root, d_key, {4});
    return d ? EquidistantModel(pinhole, {(*d)[0], (*d)[1], (*d)[2], (*d)[3]}) : EquidistantModel(pinhole, {});
  }
  RadialTangentialModel::Coefficients coefficients{};
  const auto d = numbers(root, d_key, *kind == "rational_polynomial" ? std::vector{8} : std::vector{4, 5});
  if (d) std::copy(d->begin(), d->end(), coefficients.begin());
  return RadialTangentialModel(pinhole, coefficients);
}

void read_rectification(YamlMap& root, Eye& eye) {
  const std::string r_key = key_of(root, "rectification_matrix", "R"), p_key = key_of(root, "projection_matrix", "P");
  if (const auto r = numbers(root, r_key, {9})) {
    const Eigen::Matrix3d matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r->data());
    if (is_rotation(matrix, 1e-4)) {
      eye.rectified_from_camera = Eigen::Quaterniond(nearest_rotation(matrix));
    } else {
      root.fault(r_key, "is not a rotation matrix");
    }
  }
  if (const auto p = numbers(root, p_key, {12})) {
    if (!((*p)[0] > 0 && (*p)[5] > 0)) return root.fault(p_key, "the focal lengths must be above zero");
    if ((*p)[11] != 0) return root.fault(p_key, "its last number must be 0: eyes side by side, or one above the other");
    eye.place_m = {-(*p)[3] / (*p)[0], -(*p)[7] / (*p)[5], 0};
  }
}

Result<Eye> read_eye(const std::string& path, const std::string& name) {
  const auto loaded = rig_detail::load_yaml_file(path);
  if (!loaded) return failure(loaded);
  YamlFaults faults(path);
  YamlMap root(*loaded, "", faults);
  Eye eye;
  eye.camera.name = name;
  eye.camera.size = read_size(root);
  eye.camera.model = read_model(root);
  read_rectification(root, eye);
  for (const char* key : {"binning_x", "binning_y"}) {
    if (root.has(key) && root.integer(key).value_or(0) > 1) root.fault(key, "binned pictures are not supported");
  }
  if (const Status status = faults.status(); !status) return failure(status);
  return eye;
}

// --- writing ---

std::string matrix_lines(const char* key, int rows, int columns, const std::string& data) {
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: [{}]\n", key, rows, columns, data);
}

struct Lens {
  PinholeModel pinhole;
  const char* kind;
  std::vector<double> coefficients;
};

Result<Lens> lens_of(const Camera& camera) {
  if (const auto m = expressed_as<RadialTangentialModel>(camera.model)) {
    const auto& k = m->coefficients();
    const bool rational = std::any_of(k.begin() + 5, k.end(), [](double v) { return v != 0; });
    if (rational) return Lens{m->pinhole(), "rational_polynomial", {k.begin(), k.end()}};
    return Lens{m->pinhole(), "plumb_bob", {k.begin(), k.begin() + 5}};
  }
  if (const auto m = expressed_as<EquidistantModel>(camera.model)) {
    return Lens{m->pinhole(), "equidistant", {m->coefficients().begin(), m->coefficients().end()}};
  }
  return rig_detail::cannot_hold(camera, fmt::format("ROS has no model like {}", name_of(camera.model)));
}

// Rows along the baseline, the line of sight between those of the eyes: turns into the rectified frame.
struct Rectification {
  Eigen::Matrix3d rectified_from_left;
  double baseline_m;  // below zero where the right eye stands to the left
};
Rectification rectify(const Pose& left_from_right) {
  const Eigen::Vector3d& t = left_from_right.translation();
  const double sign = t.x() < 0 ? -1 : 1;
  const Eigen::Vector3d x = sign * t.normalized();
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ() + left_from_right.rotation() * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d y = ahead.cross(x);
  if (y.norm() < 1e-3) y = x.unitOrthogonal();
  y.normalize();
  Eigen::Matrix3d rows;
  rows << x.transpose(), y.transpose(), x.cross(y).transpose();
  return {rows, sign * t.norm()};
}

}  // namespace

Result<ReadRig> read_ros_calib(const std::string& left_path, const std::string& right_path) {
  auto left = read_eye(left_path, "left");
  if (!left) return failure(std::move(left));
  auto right = read_eye(right_path, "right");
  if (!right) return failure(std::move(right));
  // p_rectified = R p_camera − place, the same for both eyes' points.
  const Eigen::Vector3d apart = right->place_m - left->place_m;
  if (apart.norm() < 1e-9) {
    return failure(ErrorCode::configuration, "projection_matrix: Tx is that of the left file: the baseline is zero",
                   right_path,
                   "calibrate both eyes together; a calibration of each alone does not know how they stand");
  }
  const Eigen::Quaterniond right_from_rectified = right->rectified_from_camera.conjugate();
  const Pose right_from_left(right_from_rectified * left->rectified_from_camera, right_from_rectified * -apart);
  auto rig = rig_detail::validated(
      rig_of_one_pair("ros", std::move(left->camera), std::move(right->camera), right_from_left), right_path);
  if (!rig) return failure(std::move(rig));
  return ReadRig{std::move(*rig),
                 CalibrationFormat::ros,
                 {left_path, right_path},
                 {"body: the left camera, turned to x forward, y left, z up"}};
}

Result<CalibrationFiles> rig_detail::write_ros_calib(const Rig& rig, const std::string& path) {
  const auto eyes = only_pair(rig, CalibrationFormat::ros);
  if (!eyes) return failure(eyes);
  const auto left = lens_of(*eyes->left), right = lens_of(*eyes->right);
  if (!left) return failure(left);
  if (!right) return failure(right);
  const Pose left_from_right = rig.right_from_left(*eyes->pair).inverse();
  const Rectification rectified = rectify(left_from_right);
  // The rectified pictures look like the mean of both.
  const double fx = 0.5 * (left->pinhole.fx + right->pinhole.fx), fy = 0.5 * (left->pinhole.fy + right->pinhole.fy);
  const double cx = 0.5 * (left->pinhole.cx + right->pinhole.cx), cy = 0.5 * (left->pinhole.cy + right->pinhole.cy);
  const auto text = [&](const Camera& camera, const Lens& lens, const Eigen::Matrix3d& r, double x_m) {
    const PinholeModel& k = lens.pinhole;
    const int count = static_cast<int>(lens.coefficients.size());
    return fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", camera.size.width, camera.size.height,
                       camera.name) +
           matrix_lines("camera_matrix", 3, 3, fmt::format("{}, 0, {}, 0, {}, {}, 0, 0, 1", k.fx, k.cx, k.fy, k.cy)) +
           fmt::format("distortion_model: {}\n", lens.kind) +
           matrix_lines("distortion_coefficients", 1, count, fmt::format("{}", fmt::join(lens.coefficients, ", "))) +
           matrix_lines("rectification_matrix", 3, 3, rows_of(r, ", ")) +
           matrix_lines("projection_matrix", 3, 4,
                        fmt::format("{}, 0, {}, {}, 0, {}, {}, 0, 0, 0, 1, 0", fx, cx, 0 - fx * x_m, fy, cy));
  };
  const PairOfFiles names = names_of_pair(path);
  const Eigen::Matrix3d rectified_from_right = rectified.rectified_from_left * left_from_right.rotation_matrix();
  return CalibrationFiles{{names.left, text(*eyes->left, *left, rectified.rectified_from_left, 0)},
                          {names.right, text(*eyes->right, *right, rectified_from_right, rectified.baseline_m)}};
}

}  // namespace spartan
