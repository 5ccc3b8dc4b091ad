// Reader and writer of JPL's camera files .cahv, .cahvor, .cahvore (Di and Li, "CAHVOR camera model and its
// photogrammetric conversion for planetary applications", JGR 2004; keys as written by JPL's and Ames' programs and
// mrcal).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/file_frame.h"
#include "spartan/calibration_io/internal/text_matrices.h"
#include "spartan/core/strict_yaml.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

using namespace internal;

namespace {

// Skews relative to the focal length. In files with nine or more digits a skew below kNoSkew is a rounding error and is
// set to 0; the rounding errors of files with fewer digits are kept, and formats without skew drop them
// (to_calibration_files()). OpenCV's distortion models have no skew; with them up to kNoSkewBesideOpencv is ignored.
constexpr double kNoSkew = 1e-9, kNoSkewBesideOpencv = 1e-5;

struct CahvWithPose {
  CahvModel cahv;
  Pose file_from_camera;
};

// C, A, H, V: z along A, x along the component of H perpendicular to A. An A that is not exactly a unit vector scales H
// and V.
Result<CahvWithPose> read_cahv(const TextMatrices& file) {
  const auto c = file.vector("C");
  if (!c) return failure(c);
  const auto a = file.vector("A");
  if (!a) return failure(a);
  const auto h = file.vector("H");
  if (!h) return failure(h);
  const auto v = file.vector("V");
  if (!v) return failure(v);
  const double length = a->norm();
  if (!(std::abs(length - 1) <= 1e-3))
    return file.error_at("A", fmt::format("has length {:.6g}, must have length 1", length));
  const Eigen::Vector3d z = *a / length;
  const Eigen::Vector3d across = *h / length - z.dot(*h / length) * z;
  if (!(across.norm() > 0) || !across.allFinite()) return file.error_at("H", "the focal length must be above zero");
  Eigen::Matrix3d axes;
  axes.col(0) = across.normalized();
  axes.col(1) = z.cross(axes.col(0));
  axes.col(2) = z;
  axes = nearest_rotation(axes);
  const Eigen::Vector3d along_h = axes.transpose() * *h / length, along_v = axes.transpose() * *v / length;
  const PinholeModel core{along_h.x(), along_v.y(), along_h.z(), along_v.z()};
  if (!(core.fy > 0))
    return file.error_at("V", "the focal length must be above zero: V must point downwards in the image");
  const double skew = std::abs(along_v.x()) <= kNoSkew * core.fy ? 0 : along_v.x();
  return CahvWithPose{{core, skew}, Pose(axes, *c)};
}

// The model type of the line "Model" or the keys T and P: CAHVORE type 1 is perspective, 2 is fisheye, 3 is general
// with its linearity after a comma or in P.
struct CahvorKind {
  bool cahvore = false;
  double linearity = 1;
};
Result<CahvorKind> linearity_of(const TextMatrices& file, int type, const std::optional<double>& own, const char* key) {
  if (type == 1) return CahvorKind{true, 1};
  if (type == 2) return CahvorKind{true, 0};
  if (type == 3 && own && std::abs(*own) <= 1) return CahvorKind{true, *own};
  return file.error_at(key, "must be CAHVORE of type 1, 2, or 3 with a linearity between -1 and 1");
}

Result<CahvorKind> read_kind(const TextMatrices& file) {
  std::string model;
  if (file.has("Model")) {
    const auto values = file.text("Model");
    if (!values) return failure(values);
    model = values->substr(0, values->find_first_of(" \t="));
  }
  if (model.starts_with("CAHVORE") && model.size() > 7) {
    std::optional<double> linearity;
    if (model.size() > 8 && model[8] == ',') linearity = parse_finite_number(std::string_view(model).substr(9));
    return linearity_of(file, model[7] - '0', linearity, "Model");
  }
  if (!model.empty() && model != "CAHV" && model != "CAHVOR" && model != "CAHVORE") {
    return file.error_at("Model",
                         fmt::format("{} is not supported; supported: CAHV, CAHVOR, CAHVORE", model.substr(0, 40)));
  }
  if (file.has("T")) {
    const auto type = file.numbers("T", 1);
    if (!type) return failure(type);
    std::optional<double> linearity;
    if (file.has("P")) {
      const auto values = file.numbers("P", 1);
      if (!values) return failure(values);
      linearity = values->front();
    }
    return linearity_of(file,
                        type->front() == std::floor(type->front()) && std::abs(type->front()) < 10
                            ? static_cast<int>(type->front())
                            : 0,
                        linearity, "T");
  }
  if (model == "CAHVORE" || file.has("E")) {
    return file.error_at(
        "E", "a CAHVORE file must state its type, for example \"Model = CAHVORE2 = fish-eye\" or \"T = 2\"");
  }
  return CahvorKind{};
}

// The line in which mrcal stores an OpenCV distortion, which JPL's models do not have.
Result<std::optional<CameraModel>> read_opencv_line(const TextMatrices& file, const PinholeModel& core) {
  for (const std::size_t count : {12U, 8U, 5U, 4U}) {
    for (const char* prefix : {"LENSMODEL", "DISTORTION"}) {
      const std::string key = fmt::format("{}_OPENCV{}", prefix, count);
      if (!file.has(key)) continue;
      const auto values = file.numbers(key, count);
      if (!values) return failure(values);
      RadialTangentialModel::Coefficients k{};
      for (std::size_t i = 0; i < count; ++i) {
        if (i < k.size()) {
          k[i] = (*values)[i];
        } else if ((*values)[i] != 0) {
          return file.error_at(key, "thin-prism coefficients are not supported");
        }
      }
      return CameraModel(RadialTangentialModel(core, k));
    }
  }
  return std::optional<CameraModel>();
}

Result<CameraModel> read_cahvor_model(const TextMatrices& file, const CahvWithPose& cahv_with_pose) {
  auto by_opencv = read_opencv_line(file, cahv_with_pose.cahv.core);
  if (!by_opencv) return failure(std::move(by_opencv));
  if (*by_opencv) {
    if (std::abs(cahv_with_pose.cahv.skew_px) > kNoSkewBesideOpencv * cahv_with_pose.cahv.core.fy)
      return file.error_at("V", "has a skew, which OpenCV's distortion models do not support");
    return **by_opencv;
  }
  const auto kind = read_kind(file);
  if (!kind) return failure(kind);
  if (!kind->cahvore && !file.has("R")) {
    if (cahv_with_pose.cahv.skew_px != 0) return cahv_with_pose.cahv;
    return cahv_with_pose.cahv.core;
  }
  const auto o = file.vector("O");
  if (!o) return failure(o);
  if (!(std::abs(o->norm() - 1) <= 1e-3)) {
    return file.error_at("O", fmt::format("has length {:.6g}, must have length 1", o->norm()));
  }
  Eigen::Vector3d axis = cahv_with_pose.file_from_camera.rotation().conjugate() * *o;
  // An axis that equals A up to rounding is set to A.
  if ((axis - Eigen::Vector3d::UnitZ()).norm() <= 1e-14) axis = Eigen::Vector3d::UnitZ();
  const auto r = file.vector("R");
  if (!r) return failure(r);
  const CahvorModel::Radial radial{r->x(), r->y(), r->z()};
  if (!kind->cahvore) return CahvorModel(cahv_with_pose.cahv, axis, radial);
  const auto e = file.vector("E");
  if (!e) return failure(e);
  return CahvoreModel(cahv_with_pose.cahv, axis, radial, {e->x(), e->y(), e->z()}, kind->linearity);
}

Result<CameraOfFile> read_cahvor_camera(const std::string& path, const std::string& name, ImageSize size) {
  const auto file = TextMatrices::read(path, '=');
  if (!file) return failure(file);
  Camera camera;
  camera.name = name;
  const auto cahv_with_pose = read_cahv(*file);
  if (!cahv_with_pose) return failure(cahv_with_pose);
  auto model = read_cahvor_model(*file, *cahv_with_pose);
  if (!model) return failure(std::move(model));
  camera.model = std::move(*model);
  camera.mount_from_camera = cahv_with_pose->file_from_camera;
  camera.size = size;
  if (file->has("Dimensions")) {
    const auto sides = file->numbers("Dimensions", 2);
    if (!sides) return failure(sides);
    const auto known = whole_size((*sides)[0], (*sides)[1]);
    if (!known) return file->error_at("Dimensions", "must be two whole numbers above zero");
    camera.size = *known;
  }
  if (camera.size.empty()) return unknown_size(path);
  return CameraOfFile{std::move(camera)};
}

// --- writing ---

std::string vector_line(const char* key, const Eigen::Vector3d& v) {
  return fmt::format("{} = {}\n", key, list_of(v));
}

std::string core_lines(const Camera& camera, const std::string& model, const CahvModel& m, const Pose& pose) {
  return fmt::format("Model = {}\nDimensions = {} {}\n", model, camera.size.width, camera.size.height) +
         vector_line("C", pose.translation()) + vector_line("A", pose.rotation() * Eigen::Vector3d::UnitZ()) +
         vector_line("H", pose.rotation() * m.h()) + vector_line("V", pose.rotation() * m.v());
}

std::string radial_lines(const CahvoreModel& m, const Pose& pose) {
  const Eigen::Vector3d radial(m.radial()[0], m.radial()[1], m.radial()[2]);
  return vector_line("O", pose.rotation() * m.optical_axis().normalized()) + vector_line("R", radial);
}

Result<std::string> cahvor_text(const Camera& camera, const Pose& pose) {
  if (const auto m = converted_to<CahvModel>(camera.model)) {
    return core_lines(camera, "CAHV = perspective, linear", *m, pose);
  }
  if (const auto m = converted_to<CahvoreModel>(camera.model)) {
    if (converted_to<CahvorModel>(camera.model)) {
      return core_lines(camera, "CAHVOR = perspective, distortion", m->cahv(), pose) + radial_lines(*m, pose);
    }
    // L = 1 and L = 0 could be written as types 1 and 2, but mrcal reads only type 3.
    const double l = m->linearity();
    return core_lines(camera, fmt::format("CAHVORE3,{} = general", l), m->cahv(), pose) + radial_lines(*m, pose) +
           vector_line("E", {m->entrance_m()[0], m->entrance_m()[1], m->entrance_m()[2]}) +
           fmt::format("T = 3\nP = {}\n", l);
  }
  if (const auto m = converted_to<RadialTangentialModel>(camera.model)) {
    return "# The distortion is in the line LENSMODEL_OPENCV8, which only mrcal reads; other programs read a CAHV "
           "without "
           "distortion.\n" +
           core_lines(camera, "CAHV = perspective, linear", {m->pinhole(), 0}, pose) +
           fmt::format("LENSMODEL_OPENCV8 = {}\n", fmt::join(m->coefficients(), " "));
  }
  return cannot_hold(camera, fmt::format(".cahvor files do not support the model {}", name_of(camera.model)));
}

}  // namespace

Result<LoadedRig> read_cahvor_calib(const std::string& left_path, const std::string& right_path, ImageSize size) {
  return read_two_files(
      CalibrationFormat::cahvor, left_path, right_path,
      [&](const std::string& path, const std::string& name) { return read_cahvor_camera(path, name, size); });
}

Result<CalibrationFiles> internal::write_cahvor_calib(const Rig& rig, const std::string& path) {
  return write_two_files(rig, CalibrationFormat::cahvor, path, cahvor_text);
}

}  // namespace spartan
