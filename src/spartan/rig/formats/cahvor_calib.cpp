// JPL's camera files, .cahv, .cahvor, .cahvore (Di and Li, "CAHVOR camera model and its photogrammetric conversion for
// planetary applications", JGR 2004; the keys as JPL's and Ames' programs and mrcal write them).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "spartan/rig/formats/calibration_text.h"
#include "spartan/rig/formats/calibration_writers.h"
#include "spartan/rig/formats/file_frame.h"
#include "spartan/rig/formats/rig_files.h"
#include "spartan/rig/formats/text_matrices.h"
#include "spartan/rig/models/model_equivalents.h"
#include "spartan/rig/yaml_bridge.h"

namespace spartan {
namespace {

using rig_detail::EyeOfFile;
using rig_detail::TextMatrices;

// Of files with nine digits or more less skew than this, by the focal length, is their rounding; what shorter ones
// leave is kept, and formats without a skew drop it (rig_writing.h). OpenCV's models have none, so that beside them it
// passes.
constexpr double kNoSkew = 1e-9, kNoSkewBesideOpencv = 1e-5;

struct PlacedCahv {
  CahvModel cahv;
  Pose file_from_camera;
};

// C, A, H, V: z along A, x along the part of H across A. An A that is not quite of length 1 scales H and V.
Result<PlacedCahv> read_cahv(const TextMatrices& file) {
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
    return file.fault("A", fmt::format("has length {:.6g}, must have length 1", length));
  const Eigen::Vector3d z = *a / length;
  const Eigen::Vector3d across = *h / length - z.dot(*h / length) * z;
  if (!(across.norm() > 0) || !across.allFinite()) return file.fault("H", "the focal length must be above zero");
  Eigen::Matrix3d axes;
  axes.col(0) = across.normalized();
  axes.col(1) = z.cross(axes.col(0));
  axes.col(2) = z;
  axes = nearest_rotation(axes);
  const Eigen::Vector3d along_h = axes.transpose() * *h / length, along_v = axes.transpose() * *v / length;
  const PinholeModel core{along_h.x(), along_v.y(), along_h.z(), along_v.z()};
  if (!(core.fy > 0)) return file.fault("V", "the focal length must be above zero: V must point down the picture");
  const double skew = std::abs(along_v.x()) <= kNoSkew * core.fy ? 0 : along_v.x();
  return PlacedCahv{{core, skew}, Pose(axes, *c)};
}

// What the "Model" line and the keys T and P say: 1 is perspective, 2 fisheye, 3 has its linearity behind a comma or P.
struct Kind {
  bool cahvore = false;
  double linearity = 1;
};
Result<Kind> linearity_of(const TextMatrices& file, int type, const std::optional<double>& own, const char* key) {
  if (type == 1) return Kind{true, 1};
  if (type == 2) return Kind{true, 0};
  if (type == 3 && own && std::abs(*own) <= 1) return Kind{true, *own};
  return file.fault(key, "must be CAHVORE of type 1, 2, or 3 with a linearity within -1 and 1");
}

Result<Kind> read_kind(const TextMatrices& file) {
  std::string model;
  if (file.has("Model")) {
    const auto held = file.text("Model");
    if (!held) return failure(held);
    model = held->substr(0, held->find_first_of(" \t="));
  }
  if (model.starts_with("CAHVORE") && model.size() > 7) {
    std::optional<double> linearity;
    if (model.size() > 8 && model[8] == ',') linearity = rig_detail::parse_number(std::string_view(model).substr(9));
    return linearity_of(file, model[7] - '0', linearity, "Model");
  }
  if (!model.empty() && model != "CAHV" && model != "CAHVOR" && model != "CAHVORE") {
    return file.fault("Model", fmt::format("{} is not supported, only CAHV, CAHVOR, CAHVORE", model.substr(0, 40)));
  }
  if (file.has("T")) {
    const auto type = file.numbers("T", 1);
    if (!type) return failure(type);
    std::optional<double> linearity;
    if (file.has("P")) {
      const auto held = file.numbers("P", 1);
      if (!held) return failure(held);
      linearity = held->front();
    }
    return linearity_of(file,
                        type->front() == std::floor(type->front()) && std::abs(type->front()) < 10
                            ? static_cast<int>(type->front())
                            : 0,
                        linearity, "T");
  }
  if (model == "CAHVORE" || file.has("E")) {
    return file.fault("E", "a CAHVORE must say its type, as in \"Model = CAHVORE2 = fish-eye\" or \"T = 2\"");
  }
  return Kind{};
}

// The comment-like line with which mrcal says a distortion that JPL's models have not.
Result<std::optional<CameraModel>> read_opencv_line(const TextMatrices& file, const PinholeModel& core) {
  for (const std::size_t count : {12U, 8U, 5U, 4U}) {
    for (const char* prefix : {"LENSMODEL", "DISTORTION"}) {
      const std::string key = fmt::format("{}_OPENCV{}", prefix, count);
      if (!file.has(key)) continue;
      const auto held = file.numbers(key, count);
      if (!held) return failure(held);
      RadialTangentialModel::Coefficients k{};
      for (std::size_t i = 0; i < count; ++i) {
        if (i < k.size()) {
          k[i] = (*held)[i];
        } else if ((*held)[i] != 0) {
          return file.fault(key, "thin-prism coefficients are not supported");
        }
      }
      return CameraModel(RadialTangentialModel(core, k));
    }
  }
  return std::optional<CameraModel>();
}

Result<CameraModel> read_model(const TextMatrices& file, const PlacedCahv& placed) {
  auto by_opencv = read_opencv_line(file, placed.cahv.core);
  if (!by_opencv) return failure(std::move(by_opencv));
  if (*by_opencv) {
    if (std::abs(placed.cahv.skew_px) > kNoSkewBesideOpencv * placed.cahv.core.fy)
      return file.fault("V", "has a skew, which OpenCV's distortion does not go with");
    return **by_opencv;
  }
  const auto kind = read_kind(file);
  if (!kind) return failure(kind);
  if (!kind->cahvore && !file.has("R")) {
    if (placed.cahv.skew_px != 0) return placed.cahv;
    return placed.cahv.core;
  }
  const auto o = file.vector("O");
  if (!o) return failure(o);
  if (!(std::abs(o->norm() - 1) <= 1e-3)) {
    return file.fault("O", fmt::format("has length {:.6g}, must have length 1", o->norm()));
  }
  Eigen::Vector3d axis = placed.file_from_camera.rotation().conjugate() * *o;
  // Along A to rounding is along A.
  if ((axis - Eigen::Vector3d::UnitZ()).norm() <= 1e-14) axis = Eigen::Vector3d::UnitZ();
  const auto r = file.vector("R");
  if (!r) return failure(r);
  const CahvorModel::Radial radial{r->x(), r->y(), r->z()};
  if (!kind->cahvore) return CahvorModel(placed.cahv, axis, radial);
  const auto e = file.vector("E");
  if (!e) return failure(e);
  return CahvoreModel(placed.cahv, axis, radial, {e->x(), e->y(), e->z()}, kind->linearity);
}

Result<EyeOfFile> read_eye(const std::string& path, const std::string& name, ImageSize size) {
  const auto file = TextMatrices::read(path, '=');
  if (!file) return failure(file);
  Camera camera;
  camera.name = name;
  const auto placed = read_cahv(*file);
  if (!placed) return failure(placed);
  auto model = read_model(*file, *placed);
  if (!model) return failure(std::move(model));
  camera.model = std::move(*model);
  camera.mount_from_camera = placed->file_from_camera;
  camera.size = size;
  if (file->has("Dimensions")) {
    const auto sides = file->numbers("Dimensions", 2);
    if (!sides) return failure(sides);
    const auto known = rig_detail::whole_size((*sides)[0], (*sides)[1]);
    if (!known) return file->fault("Dimensions", "must be two whole numbers above zero");
    camera.size = *known;
  }
  if (camera.size.empty()) return rig_detail::unknown_size(path);
  return EyeOfFile{std::move(camera)};
}

// --- writing ---

std::string vector_line(const char* key, const Eigen::Vector3d& v) {
  return fmt::format("{} = {}\n", key, rig_detail::list_of(v));
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

Result<std::string> text_of(const Camera& camera, const Pose& pose) {
  if (const auto m = expressed_as<CahvModel>(camera.model)) {
    return core_lines(camera, "CAHV = perspective, linear", *m, pose);
  }
  if (const auto m = expressed_as<CahvoreModel>(camera.model)) {
    if (expressed_as<CahvorModel>(camera.model)) {
      return core_lines(camera, "CAHVOR = perspective, distortion", m->cahv(), pose) + radial_lines(*m, pose);
    }
    // Types 1 and 2 are those of L = 1 and 0, but mrcal reads none but the third.
    const double l = m->linearity();
    return core_lines(camera, fmt::format("CAHVORE3,{} = general", l), m->cahv(), pose) + radial_lines(*m, pose) +
           vector_line("E", {m->entrance_m()[0], m->entrance_m()[1], m->entrance_m()[2]}) +
           fmt::format("T = 3\nP = {}\n", l);
  }
  if (const auto m = expressed_as<RadialTangentialModel>(camera.model)) {
    return "# The distortion is in the line LENSMODEL_OPENCV8, as mrcal reads it; other programs see a CAHV without "
           "it.\n" +
           core_lines(camera, "CAHV = perspective, linear", {m->pinhole(), 0}, pose) +
           fmt::format("LENSMODEL_OPENCV8 = {}\n", fmt::join(m->coefficients(), " "));
  }
  return rig_detail::cannot_hold(camera, fmt::format(".cahvor has no model like {}", name_of(camera.model)));
}

}  // namespace

Result<ReadRig> read_cahvor_calib(const std::string& left_path, const std::string& right_path, ImageSize size) {
  return rig_detail::read_two_files(
      CalibrationFormat::cahvor, left_path, right_path,
      [&](const std::string& path, const std::string& eye) { return read_eye(path, eye, size); });
}

Result<CalibrationFiles> rig_detail::write_cahvor_calib(const Rig& rig, const std::string& path) {
  return write_two_files(rig, CalibrationFormat::cahvor, path, text_of);
}

}  // namespace spartan
