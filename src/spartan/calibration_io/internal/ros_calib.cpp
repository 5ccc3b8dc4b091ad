// Reader and writer of ROS camera_info files: as written by camera_calibration_parsers, or messages as printed by
// `rostopic echo` (sensor_msgs/CameraInfo; REP 104). R rectifies each camera; in P of the right one Tx = −fx' b.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_readers.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/pair_of_files.h"
#include "spartan/calibration_io/internal/yaml_camera.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

using namespace internal;

namespace {

// One file: the camera, its rotation into the rectified frame, its position there, and the rectified pinhole.
struct CameraInfo {
  Camera camera;
  Eigen::Quaterniond rectified_from_camera = Eigen::Quaterniond::Identity();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  PinholeModel rectified;
};

// The key of an entry: that of a calibration file, or that of a message (upper case in ROS 1, lower case in ROS 2).
std::string key_of(YamlMap& root, const std::string& in_file, const std::string& in_message) {
  if (root.has(in_file)) return in_file;
  std::string small = in_message;
  std::transform(small.begin(), small.end(), small.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  for (const std::string& key : {in_message, small}) {
    if (root.has(key)) return key;
  }
  return in_file;
}

// {rows, cols, data: […]} or a plain list.
std::optional<std::vector<double>> numbers(YamlMap& root, const std::string& key, const std::vector<int>& counts) {
  const auto node = root.node(key);
  if (!node) return std::nullopt;
  if (node->is_map()) return YamlMap(*node, root.path(key), root.errors()).numbers("data", counts);
  return root.numbers(key, counts);
}

ImageSize read_size(YamlMap& root) {
  ImageSize size;
  const auto side = [&](const std::string& key) {
    const int pixels = root.integer(key).value_or(1);
    if (pixels < 1) root.add_error(key, fmt::format("is {}, must be above zero", pixels));
    return pixels;
  };
  size.width = side(key_of(root, "image_width", "width"));
  size.height = side(key_of(root, "image_height", "height"));
  return size;
}

CameraModel read_ros_model(YamlMap& root) {
  const std::string k_key = key_of(root, "camera_matrix", "K"), d_key = key_of(root, "distortion_coefficients", "D");
  PinholeModel pinhole;
  if (const auto k = numbers(root, k_key, {9})) {
    pinhole = read_camera_matrix(root, k_key, *k).value_or(PinholeModel{});
  }
  // In messages of cameras without distortion the name is empty.
  const auto named = root.optional_node("distortion_model");
  const bool unnamed = named && named->is_scalar() && named->scalar().empty();
  const auto kind = unnamed ? std::optional<std::string>("none")
                            : root.choice("distortion_model", {"plumb_bob", "rational_polynomial", "equidistant",
                                                               "fisheye", "radtan", "none"});
  if (!kind) return pinhole;
  if (*kind == "none") {
    const auto d = root.has(d_key) ? numbers(root, d_key, {0, 4, 5, 8, 12, 14}) : std::nullopt;
    if (d && std::any_of(d->begin(), d->end(), [](double v) { return v != 0; })) {
      root.add_error(d_key, "are not zero, but distortion_model has no coefficients");
    }
    return pinhole;
  }
  if (*kind == "equidistant" || *kind == "fisheye") {
    const auto d = numbers(root, d_key, {4});
    return d ? EquidistantModel(pinhole, {(*d)[0], (*d)[1], (*d)[2], (*d)[3]}) : EquidistantModel(pinhole, {});
  }
  RadialTangentialModel::Coefficients coefficients{};
  const auto d = numbers(root, d_key, *kind == "rational_polynomial" ? std::vector{8} : std::vector{4, 5});
  if (d) std::copy(d->begin(), d->end(), coefficients.begin());
  return RadialTangentialModel(pinhole, coefficients);
}

// With a region of interest or binning, the calibration in the file does not apply to the images.
void reject_roi_and_binning(YamlMap& root, ImageSize size) {
  for (const char* key : {"binning_x", "binning_y"}) {
    if (root.has(key) && root.integer(key).value_or(0) > 1) root.add_error(key, "binned images are not supported");
  }
  const auto node = root.optional_node("roi");
  if (!node) return;
  YamlMap roi(*node, root.path("roi"), root.errors());
  if (!node->is_map()) return;
  const auto number = [&](const char* key) { return roi.has(key) ? roi.integer(key).value_or(0) : 0; };
  const int x = number("x_offset"), y = number("y_offset"), width = number("width"), height = number("height");
  // Zeros mean the whole image.
  const bool whole = x == 0 && y == 0 && (width == 0 || width == size.width) && (height == 0 || height == size.height);
  if (!whole) root.add_error("roi", "is a part of the image, which is not supported");
}

void read_rectification(YamlMap& root, CameraInfo& info) {
  const std::string r_key = key_of(root, "rectification_matrix", "R"), p_key = key_of(root, "projection_matrix", "P");
  if (const auto r = numbers(root, r_key, {9})) {
    const Eigen::Matrix3d matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r->data());
    if (is_rotation(matrix, 1e-4)) {
      info.rectified_from_camera = Eigen::Quaterniond(nearest_rotation(matrix));
    } else {
      root.add_error(r_key, "is not a rotation matrix");
    }
  }
  if (const auto p = numbers(root, p_key, {12})) {
    if (!((*p)[0] > 0 && (*p)[5] > 0)) return root.add_error(p_key, "the focal lengths must be above zero");
    if ((*p)[11] != 0) {
      return root.add_error(p_key,
                            "its last number must be 0: the cameras must be side by side or one above the other");
    }
    info.position_m = {-(*p)[3] / (*p)[0], -(*p)[7] / (*p)[5], 0};
    info.rectified = {(*p)[0], (*p)[5], (*p)[2], (*p)[6]};
  }
}

Result<CameraInfo> read_camera_info(const std::string& path, const std::string& name) {
  const auto loaded = load_yaml_file(path);
  if (!loaded) return failure(loaded);
  YamlErrors errors(path);
  YamlMap root(*loaded, "", errors);
  CameraInfo info;
  info.camera.name = name;
  info.camera.size = read_size(root);
  info.camera.model = read_ros_model(root);
  read_rectification(root, info);
  reject_roi_and_binning(root, info.camera.size);
  if (const Status status = errors.status(); !status) return failure(status);
  return info;
}

// The rectification that Spartan writes for a pair: rows parallel to the baseline, the optical axis between those of
// the cameras, and the mean of both intrinsics.
struct RectifiedView {
  PinholeModel pinhole;
  Eigen::Matrix3d from_left, from_right;
  double baseline_m = 0;  // negative if the right camera is to the left of the left one
};

RectifiedView rectified_view(const PinholeModel& left, const PinholeModel& right, const Pose& left_from_right) {
  const Eigen::Vector3d& t = left_from_right.translation();
  const double sign = t.x() < 0 ? -1 : 1;
  const Eigen::Vector3d x = sign * t.normalized();
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitZ() + left_from_right.rotation() * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d y = forward.cross(x);
  if (y.norm() < 1e-3) y = x.unitOrthogonal();
  y.normalize();
  RectifiedView view;
  view.from_left << x.transpose(), y.transpose(), x.cross(y).transpose();
  view.from_right = view.from_left * left_from_right.rotation_matrix();
  view.baseline_m = sign * t.norm();
  view.pinhole = {0.5 * (left.fx + right.fx), 0.5 * (left.fy + right.fy), 0.5 * (left.cx + right.cx),
                  0.5 * (left.cy + right.cy)};
  return view;
}

PinholeModel pinhole_of(const CameraModel& model) {
  const ModelParameters numbers = parameters(model);
  return PinholeModel::from_parameters(numbers);
}

// A Rig does not represent a rectification. It is lost unless it equals the one that rectified_view() computes.
std::vector<RigDifference> lost_view(const CameraInfo& left, const CameraInfo& right, const Pose& left_from_right) {
  constexpr double kTolerance = 1e-9;
  const RectifiedView own =
      rectified_view(pinhole_of(left.camera.model), pinhole_of(right.camera.model), left_from_right);
  const auto same = [&](const CameraInfo& info, const Eigen::Matrix3d& rectification) {
    const PinholeModel &a = info.rectified, &b = own.pinhole;
    const Eigen::Vector4d difference(a.fx - b.fx, a.fy - b.fy, a.cx - b.cx, a.cy - b.cy);
    return difference.norm() <= kTolerance * b.fx &&
           (info.rectified_from_camera.toRotationMatrix() - rectification).norm() <= kTolerance;
  };
  if (same(left, own.from_left) && same(right, own.from_right) && left.position_m.norm() <= kTolerance) return {};
  return {{"projection_matrix",
           fmt::format("the rectification of the files, R and P (fx {:.6g}, cx {:.6g}; right {:.6g}, {:.6g}), is not "
                       "kept, only the extrinsics",
                       left.rectified.fx, left.rectified.cx, right.rectified.fx, right.rectified.cx)}};
}

// --- writing ---

std::string matrix_lines(const char* key, int rows, int columns, const std::string& data) {
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: [{}]\n", key, rows, columns, data);
}

struct RosLens {
  PinholeModel pinhole;
  const char* kind;
  std::vector<double> coefficients;
};

Result<RosLens> ros_lens(const Camera& camera) {
  if (const auto m = converted_to<RadialTangentialModel>(camera.model)) {
    const auto& k = m->coefficients();
    if (is_rational(*m)) return RosLens{m->pinhole(), "rational_polynomial", {k.begin(), k.end()}};
    return RosLens{m->pinhole(), "plumb_bob", {k.begin(), k.begin() + 5}};
  }
  if (const auto m = converted_to<EquidistantModel>(camera.model)) {
    return RosLens{m->pinhole(), "equidistant", {m->coefficients().begin(), m->coefficients().end()}};
  }
  return cannot_hold(camera, fmt::format("camera_info does not support the model {}", name_of(camera.model)));
}

}  // namespace

Result<LoadedRig> read_ros_calib(const std::string& left_path, const std::string& right_path) {
  auto left = read_camera_info(left_path, "left");
  if (!left) return failure(std::move(left));
  auto right = read_camera_info(right_path, "right");
  if (!right) return failure(std::move(right));
  // p_rectified = R p_camera − position, for the points of either camera.
  const Eigen::Vector3d difference = right->position_m - left->position_m;
  if (difference.norm() < 1e-9) {
    return failure(ErrorCode::configuration, "projection_matrix: Tx equals that of the left file: the baseline is zero",
                   right_path, "calibrate both cameras together; separate calibrations do not contain the extrinsics");
  }
  const Eigen::Quaterniond right_from_rectified = right->rectified_from_camera.conjugate();
  const Pose right_from_left(right_from_rectified * left->rectified_from_camera, right_from_rectified * -difference);
  auto rig = validated(rig_of_one_pair("ros", left->camera, right->camera, right_from_left), right_path);
  if (!rig) return failure(std::move(rig));
  return LoadedRig{std::move(*rig),         CalibrationFormat::ros,
                   {left_path, right_path}, {},
                   kBodyIsLeftCamera,       lost_view(*left, *right, right_from_left.inverse())};
}

Result<CalibrationFiles> internal::write_ros_calib(const Rig& rig, const std::string& path) {
  const auto cameras = single_pair(rig, CalibrationFormat::ros);
  if (!cameras) return failure(cameras);
  const auto left = ros_lens(*cameras->left), right = ros_lens(*cameras->right);
  if (!left) return failure(left);
  if (!right) return failure(right);
  const Pose left_from_right = rig.right_from_left(*cameras->pair).inverse();
  const RectifiedView view = rectified_view(left->pinhole, right->pinhole, left_from_right);
  const PinholeModel& p = view.pinhole;
  const auto text = [&](const Camera& camera, const RosLens& lens, const Eigen::Matrix3d& r, double x_m) {
    const PinholeModel& k = lens.pinhole;
    const int count = static_cast<int>(lens.coefficients.size());
    return fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", camera.size.width, camera.size.height,
                       camera.name) +
           matrix_lines("camera_matrix", 3, 3, fmt::format("{}, 0, {}, 0, {}, {}, 0, 0, 1", k.fx, k.cx, k.fy, k.cy)) +
           fmt::format("distortion_model: {}\n", lens.kind) +
           matrix_lines("distortion_coefficients", 1, count, fmt::format("{}", fmt::join(lens.coefficients, ", "))) +
           matrix_lines("rectification_matrix", 3, 3, rows_of(r, ", ")) +
           matrix_lines("projection_matrix", 3, 4,
                        fmt::format("{}, 0, {}, {}, 0, {}, {}, 0, 0, 0, 1, 0", p.fx, p.cx, 0 - p.fx * x_m, p.fy, p.cy));
  };
  const PairOfFiles names = names_of_pair(path);
  return CalibrationFiles{{names.left, text(*cameras->left, *left, view.from_left, 0)},
                          {names.right, text(*cameras->right, *right, view.from_right, view.baseline_m)}};
}

}  // namespace spartan
