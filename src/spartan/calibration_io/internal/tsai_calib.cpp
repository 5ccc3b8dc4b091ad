// Reader and writer of pinhole cameras of the Ames Stereo Pipeline, .tsai (its documentation, "Pinhole models").
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/file_frame.h"
#include "spartan/calibration_io/internal/text_matrices.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

using namespace internal;

namespace {

Result<Eigen::Matrix3d> rotation_or_error(const TextMatrices& file, const char* key, const Eigen::Matrix3d& matrix) {
  constexpr double kTolerance = 1e-4;  // for matrices rounded to a few digits
  if (!is_rotation(matrix, kTolerance)) return file.error_at(key, "is not a rotation matrix");
  return nearest_rotation(matrix);
}

// R rotates from the camera into the world frame of the file. u, v, w are the image axes in the camera frame, usually
// the identity.
Result<Pose> read_pose(const TextMatrices& file) {
  const auto r = file.numbers("R", 9);
  if (!r) return failure(r);
  const auto world_from_camera =
      rotation_or_error(file, "R", Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r->data()));
  if (!world_from_camera) return failure(world_from_camera);
  const auto centre = file.vector("C");
  if (!centre) return failure(centre);
  Eigen::Matrix3d rows;
  for (const auto& [row, key] : {std::pair{0, "u_direction"}, {1, "v_direction"}, {2, "w_direction"}}) {
    const auto axis = file.vector(key);
    if (!axis) return failure(axis);
    rows.row(row) = axis->transpose();
  }
  const auto image_from_camera = rotation_or_error(file, "u_direction", rows);
  if (!image_from_camera) {
    return file.error_at("u_direction", "with v_direction and w_direction is not a rotation matrix");
  }
  return Pose(*world_from_camera * image_from_camera->transpose(), *centre);
}

// The line with the name of the distortion; in old files it is missing and means TSAI.
Result<std::string> distortion_name(const TextMatrices& file) {
  std::string name;
  for (const TextMatrices::Word& word : file.words()) {
    if (word.text.starts_with("VERSION_") || word.text == "PINHOLE") continue;
    std::string lower = word.text;
    std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
    if (lower != "tsai" && lower != "null") {
      return failure(
          ErrorCode::configuration,
          fmt::format("'{}' is not supported; supported: PINHOLE with TSAI or NULL", word.text.substr(0, 40)),
          fmt::format("{}:{}", file.name(), word.line));
    }
    name = lower;
  }
  return name.empty() ? "tsai" : name;
}

Result<CameraModel> read_tsai_model(const TextMatrices& file) {
  double pitch = 1;
  if (file.has("pitch")) {
    const auto values = file.numbers("pitch", 1);
    if (!values) return failure(values);
    pitch = values->front();
    if (!(pitch > 0)) return file.error_at("pitch", fmt::format("is {}, must be above zero", pitch));
  }
  std::array<double, 4> core{};
  const std::array<const char*, 4> keys{"fu", "fv", "cu", "cv"};
  for (std::size_t i = 0; i < core.size(); ++i) {
    const auto values = file.numbers(keys[i], 1);
    if (!values) return failure(values);
    if (i < 2 && !(values->front() > 0)) return file.error_at(keys[i], "the focal length must be above zero");
    core[i] = values->front() / pitch;
  }
  const PinholeModel pinhole{core[0], core[1], core[2], core[3]};
  const auto name = distortion_name(file);
  if (!name) return failure(name);
  if (*name == "null") return pinhole;
  RadialTangentialModel::Coefficients k{};
  const std::array<const char*, 5> names{"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i == 4 && !file.has(names[i])) break;
    const auto values = file.numbers(names[i], 1);
    if (!values) return failure(values);
    k[i] = values->front();
  }
  return RadialTangentialModel(pinhole, k);
}

Result<CameraOfFile> read_tsai_camera(const std::string& path, const std::string& name, ImageSize size) {
  const auto file = TextMatrices::read(path, '=');
  if (!file) return failure(file);
  auto model = read_tsai_model(*file);
  if (!model) return failure(std::move(model));
  const auto pose = read_pose(*file);
  if (!pose) return failure(pose);
  if (size.empty()) return unknown_size(path);
  Camera camera;
  camera.name = name;
  camera.size = size;
  camera.model = std::move(*model);
  camera.mount_from_camera = *pose;
  return CameraOfFile{std::move(camera)};
}

Result<std::string> tsai_text(const Camera& camera, const Pose& file_from_camera) {
  const auto model = converted_to<RadialTangentialModel>(camera.model);
  if (!model) {
    return cannot_hold(camera, fmt::format(".tsai files do not support the model {}", name_of(camera.model)));
  }
  const auto& k = model->coefficients();
  if (is_rational(*model)) {
    return cannot_hold(camera, ".tsai files do not support the coefficients k4, k5, k6");
  }
  const PinholeModel& p = model->pinhole();
  std::string text = fmt::format(
      "VERSION_4\nPINHOLE\nfu = {}\nfv = {}\ncu = {}\ncv = {}\nu_direction = 1 0 0\nv_direction = 0 1 0\n"
      "w_direction = 0 0 1\nC = {}\nR = {}\npitch = 1\n",
      p.fx, p.fy, p.cx, p.cy, list_of(file_from_camera.translation()), rows_of(file_from_camera.rotation_matrix()));
  if (converted_to<PinholeModel>(camera.model)) return text + "NULL\n";
  text += fmt::format("TSAI\nk1 = {}\nk2 = {}\np1 = {}\np2 = {}\n", k[0], k[1], k[2], k[3]);
  return k[4] == 0 ? text : text + fmt::format("k3 = {}\n", k[4]);
}

}  // namespace

Result<LoadedRig> read_tsai_calib(const std::string& left_path, const std::string& right_path, ImageSize size) {
  return read_two_files(
      CalibrationFormat::tsai, left_path, right_path,
      [&](const std::string& path, const std::string& name) { return read_tsai_camera(path, name, size); });
}

Result<CalibrationFiles> internal::write_tsai_calib(const Rig& rig, const std::string& path) {
  return write_two_files(rig, CalibrationFormat::tsai, path, tsai_text);
}

}  // namespace spartan
