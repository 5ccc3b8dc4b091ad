// Reader and writer of mrcal's .cameramodel (mrcal's documentation, "The camera-model data structure" and "lens
// models").
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/file_frame.h"
#include "spartan/calibration_io/internal/python_dict.h"
#include "spartan/core/files.h"
#include "spartan/core/strict_yaml.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

using namespace internal;

namespace {

// Content of the files that a Rig cannot represent.
constexpr std::array<std::pair<const char*, const char*>, 2> kIgnored{
    {{"valid_intrinsics_region", "the region of valid intrinsics is not kept"},
     {"optimization_inputs", "the inputs of the optimization are not kept"}}};

constexpr std::string_view kCahvore = "CAHVORE_linearity=";

// How many numbers follow fx, fy, cx, cy; nullopt for an unsupported model.
std::optional<std::size_t> further_numbers(std::string_view model) {
  if (model == "PINHOLE") return 0;
  if (model == "OPENCV4") return 4;
  if (model == "OPENCV5") return 5;
  if (model == "OPENCV8") return 8;
  if (model == "OPENCV12") return 12;
  if (model == "CAHVOR") return 5;
  if (model.starts_with(kCahvore)) return 8;
  return std::nullopt;
}

// The optical axis O from its azimuth alpha about y and its elevation beta out of the xz plane.
Eigen::Vector3d axis_from_angles(double alpha, double beta) {
  return {std::sin(alpha) * std::cos(beta), std::sin(beta), std::cos(alpha) * std::cos(beta)};
}

Result<CameraModel> read_mrcal_model(const PythonDict& file) {
  const char* key = file.has("lensmodel") ? "lensmodel" : file.has("lens_model") ? "lens_model" : "distortion_model";
  const auto name = file.text(file.has(key) ? key : "lensmodel");
  if (!name) return failure(name);
  const std::string_view model = std::string_view(*name).substr(std::min(name->find('_') + 1, name->size()));
  const bool prefixed = name->starts_with("LENSMODEL_") || name->starts_with("DISTORTION_");
  const auto further = prefixed ? further_numbers(model) : std::nullopt;
  if (!further) {
    return file.error_at(key, fmt::format("{} is not supported; supported: PINHOLE, OPENCV4, 5, 8, CAHVOR, CAHVORE",
                                          name->substr(0, 60)));
  }
  const auto values = file.numbers("intrinsics", 4 + *further);
  if (!values) return failure(values);
  const std::vector<double>& k = *values;
  const PinholeModel pinhole{k[0], k[1], k[2], k[3]};
  if (!(k[0] > 0 && k[1] > 0)) return file.error_at("intrinsics", "the focal lengths must be above zero");
  if (model == "PINHOLE") return pinhole;
  if (model.starts_with("OPENCV")) {
    RadialTangentialModel::Coefficients coefficients{};
    for (std::size_t i = 4; i < k.size(); ++i) {
      if (i < 12) {
        coefficients[i - 4] = k[i];
      } else if (k[i] != 0) {
        return file.error_at("intrinsics", "thin-prism coefficients are not supported");
      }
    }
    return RadialTangentialModel(pinhole, coefficients);
  }
  const Eigen::Vector3d axis = axis_from_angles(k[4], k[5]);
  if (model == "CAHVOR") return CahvorModel({pinhole, 0}, axis, {k[6], k[7], k[8]});
  const auto linearity = parse_finite_number(model.substr(kCahvore.size()));
  if (!linearity || std::abs(*linearity) > 1)
    return file.error_at(key, "the linearity must be a number between -1 and 1");
  return CahvoreModel({pinhole, 0}, axis, {k[6], k[7], k[8]}, {k[9], k[10], k[11]}, *linearity);
}

Result<CameraOfFile> read_mrcal_camera(const std::string& path, const std::string& name) {
  const auto text = read_calibration_text(path, kLargestModelFile_bytes);
  if (!text) return failure(text);
  const auto file = PythonDict::parse(*text, path);
  if (!file) return failure(file);
  Camera camera;
  camera.name = name;
  auto model = read_mrcal_model(*file);
  if (!model) return failure(std::move(model));
  camera.model = std::move(*model);
  const auto size = file->numbers("imagersize", 2);
  if (!size) return failure(size);
  const auto known = whole_size((*size)[0], (*size)[1]);
  if (!known) return file->error_at("imagersize", "must be two whole numbers above zero");
  camera.size = *known;
  const auto e = file->numbers("extrinsics", 6);
  if (!e) return failure(e);
  const auto rotation = rotation_of_vector({(*e)[0], (*e)[1], (*e)[2]});
  if (!rotation) return file->error_at("extrinsics", "its first three numbers are not a rotation");
  camera.mount_from_camera = Pose(*rotation, {(*e)[3], (*e)[4], (*e)[5]}).inverse();
  CameraOfFile result{std::move(camera)};
  for (const auto& [key, what] : kIgnored) {
    if (file->has(key)) result.ignored.push_back({fmt::format("{}.{}", name, key), what});
  }
  return result;
}

struct MrcalLens {
  std::string name;
  std::vector<double> numbers;
};

void append(std::vector<double>& numbers, const auto& more, std::size_t count) {
  numbers.insert(numbers.end(), more.begin(), more.begin() + static_cast<std::ptrdiff_t>(count));
}

void append_cahvor(std::vector<double>& numbers, const Eigen::Vector3d& axis, const CahvorModel::Radial& radial) {
  const Eigen::Vector3d o = axis.normalized();
  numbers.push_back(std::atan2(o.x(), o.z()));
  numbers.push_back(std::asin(std::clamp(o.y(), -1.0, 1.0)));
  append(numbers, radial, radial.size());
}

Result<MrcalLens> mrcal_lens(const Camera& camera) {
  const auto core = [](const PinholeModel& p) { return std::vector{p.fx, p.fy, p.cx, p.cy}; };
  if (const auto m = converted_to<PinholeModel>(camera.model)) return MrcalLens{"PINHOLE", core(*m)};
  if (const auto m = converted_to<RadialTangentialModel>(camera.model)) {
    const auto& k = m->coefficients();
    const std::size_t count = is_rational(*m) ? 8 : k[4] != 0 ? 5 : 4;
    MrcalLens lens{fmt::format("OPENCV{}", count), core(m->pinhole())};
    append(lens.numbers, k, count);
    return lens;
  }
  if (const auto m = converted_to<CahvoreModel>(camera.model)) {
    MrcalLens lens{fmt::format("{}{}", kCahvore, m->linearity()), core(m->cahv().core)};
    append_cahvor(lens.numbers, m->optical_axis(), m->radial());
    if (converted_to<CahvorModel>(camera.model)) {
      lens.name = "CAHVOR";
    } else {
      append(lens.numbers, m->entrance_m(), 3);
    }
    return lens;
  }
  return cannot_hold(camera, fmt::format("mrcal files do not support the model {}", name_of(camera.model)));
}

Result<std::string> mrcal_text(const Camera& camera, const Pose& file_from_camera) {
  const auto lens = mrcal_lens(camera);
  if (!lens) return failure(lens);
  const Pose from_reference = file_from_camera.inverse();
  return fmt::format(
      "{{\n    'lensmodel':  'LENSMODEL_{}',\n\n    # fx, fy, cx, cy, distortion\n    'intrinsics': [{}],\n\n"
      "    # rotation vector and translation from the reference frame\n    'extrinsics': [{}, {}],\n\n"
      "    'imagersize': [{}, {}],\n}}\n",
      lens->name, fmt::join(lens->numbers, ", "), list_of(log_so3(from_reference.rotation()), ", "),
      list_of(from_reference.translation(), ", "), camera.size.width, camera.size.height);
}

}  // namespace

Result<LoadedRig> read_mrcal_calib(const std::string& left_path, const std::string& right_path) {
  return read_two_files(CalibrationFormat::mrcal, left_path, right_path, read_mrcal_camera);
}

Result<CalibrationFiles> internal::write_mrcal_calib(const Rig& rig, const std::string& path) {
  return write_two_files(rig, CalibrationFormat::mrcal, path, mrcal_text);
}

}  // namespace spartan
