#include "spartan/calibration_io/internal/yaml_camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/core/files.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan::internal {
namespace {

bool positive_focal_lengths(YamlMap& map, std::string_view key, double fx, double fy) {
  if (fx > 0 && fy > 0) return true;
  map.add_error(key, "the focal lengths must be above zero");
  return false;
}

bool is_zero(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double v) { return v == 0; });
}

CameraModel read_pinhole(YamlMap& map, const std::string& distortion, std::string_view distortion_key) {
  PinholeModel pinhole;
  if (const auto k = map.numbers("intrinsics", {4})) {
    pinhole = {(*k)[0], (*k)[1], (*k)[2], (*k)[3]};
    if (!positive_focal_lengths(map, "intrinsics", pinhole.fx, pinhole.fy)) pinhole = {};
  }
  if (distortion == "none") return pinhole;
  if (distortion == "equidistant") {
    const auto d = map.numbers(distortion_key, {4});
    return d ? EquidistantModel(pinhole, {(*d)[0], (*d)[1], (*d)[2], (*d)[3]}) : EquidistantModel(pinhole, {});
  }
  RadialTangentialModel::Coefficients coefficients{};
  if (const auto d = map.numbers(distortion_key, {4, 5, 8})) std::copy(d->begin(), d->end(), coefficients.begin());
  return RadialTangentialModel(pinhole, coefficients);
}

// omni, ds and eucm: their own parameters followed by those of a pinhole; an additional distortion is not supported.
CameraModel read_sphere(YamlMap& map, const std::string& kind, const std::string& distortion,
                        std::string_view distortion_key) {
  if (distortion != "none" && map.has(distortion_key)) {
    const auto d = map.numbers(distortion_key, {0, 4, 5, 8});
    if (d && !is_zero(*d)) {
      map.add_error(distortion_key, fmt::format("{} with an additional distortion is not supported", kind));
    }
  }
  const auto k = map.numbers("intrinsics", {kind == "omni" ? 5 : 6});
  if (!k) return DoubleSphereModel{};
  const std::size_t at = k->size() - 4;
  const PinholeModel pinhole{(*k)[at], (*k)[at + 1], (*k)[at + 2], (*k)[at + 3]};
  if (!positive_focal_lengths(map, "intrinsics", pinhole.fx, pinhole.fy)) return DoubleSphereModel{};
  if (kind == "omni") return DoubleSphereModel{pinhole, (*k)[0], 0};
  const double alpha = kind == "ds" ? (*k)[1] : (*k)[0];
  if (!(alpha >= 0 && alpha <= 1))
    map.add_error("intrinsics", fmt::format("alpha is {}, must be between 0 and 1", alpha));
  if (kind == "ds") return DoubleSphereModel{pinhole, (*k)[0], alpha};
  if ((*k)[1] != 1)
    map.add_error("intrinsics", fmt::format("eucm with beta = {} is not supported, only beta = 1", (*k)[1]));
  return DoubleSphereModel{pinhole, 0, alpha};
}

}  // namespace

Result<YamlNode> load_yaml_file(const std::string& path) {
  auto text = read_calibration_text(path);
  if (!text) return failure(text);
  // As a comment it keeps the line numbers.
  if (text->starts_with("%YAML")) text->front() = '#';
  return parse_yaml(*text, path);
}

ImageSize read_resolution(YamlMap& map, std::string_view key) {
  const auto size = map.numbers(key, {2});
  if (!size) return {};
  const auto known = whole_size((*size)[0], (*size)[1]);
  if (!known) map.add_error(key, "must be two whole numbers above zero");
  return known.value_or(ImageSize{});
}

CameraModel read_kalibr_model(YamlMap& map, std::string_view distortion_key) {
  const auto kind = map.choice("camera_model", {"pinhole", "omni", "ds", "eucm"});
  std::string distortion = "none";
  if (kind == "pinhole" || map.has("distortion_model")) {
    distortion =
        map.choice("distortion_model", {"radtan", "radial-tangential", "equidistant", "none"}).value_or("none");
  }
  if (!kind) return PinholeModel{};
  if (*kind == "pinhole") return read_pinhole(map, distortion, distortion_key);
  return read_sphere(map, *kind, distortion, distortion_key);
}

Result<std::string> kalibr_model_lines(const Camera& camera, std::string_view distortion_key, std::string_view indent) {
  const auto lines = [&](const char* kind, const std::string& own, const PinholeModel& p, const char* distortion,
                         const std::vector<double>& d) {
    return fmt::format(
        "{0}camera_model: {1}\n{0}intrinsics: [{2}{3}, {4}, {5}, {6}]\n{0}distortion_model: {7}\n"
        "{0}{8}: [{9}]\n",
        indent, kind, own, p.fx, p.fy, p.cx, p.cy, distortion, distortion_key, fmt::join(d, ", "));
  };
  if (const auto m = converted_to<PinholeModel>(camera.model)) return lines("pinhole", "", *m, "none", {});
  if (const auto m = converted_to<EquidistantModel>(camera.model)) {
    return lines("pinhole", "", m->pinhole(), "equidistant", {m->coefficients().begin(), m->coefficients().end()});
  }
  if (const auto m = converted_to<DoubleSphereModel>(camera.model)) {
    return lines("ds", fmt::format("{}, {}, ", m->xi, m->alpha), m->pinhole, "none", {});
  }
  if (const auto m = converted_to<RadialTangentialModel>(camera.model)) {
    const auto& k = m->coefficients();
    if (std::any_of(k.begin() + 4, k.end(), [](double v) { return v != 0; })) {
      return cannot_hold(camera, "this format supports four coefficients of radial_tangential, this camera has more");
    }
    return lines("pinhole", "", m->pinhole(), "radtan", {k.begin(), k.begin() + 4});
  }
  return cannot_hold(camera, fmt::format("this format does not support the model {}", name_of(camera.model)));
}

std::optional<Pose> read_rigid(YamlMap& map, std::string_view key, const std::vector<double>& rows) {
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(rows.data());
  constexpr double kTolerance = 1e-4;  // for matrices rounded to a few digits
  if (!is_rotation(matrix.topLeftCorner<3, 3>(), kTolerance) || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    map.add_error(key, "is not a rigid transform");
    return std::nullopt;
  }
  return Pose(nearest_rotation(matrix.topLeftCorner<3, 3>()), matrix.topRightCorner<3, 1>());
}

std::optional<PinholeModel> read_camera_matrix(YamlMap& map, std::string_view key, const std::vector<double>& rows) {
  const auto pinhole = pinhole_of_rows(rows);
  if (!pinhole) {
    map.add_error(key, "is not a camera matrix (fx 0 cx; 0 fy cy; 0 0 1)");
    return std::nullopt;
  }
  if (!positive_focal_lengths(map, key, pinhole->fx, pinhole->fy)) return std::nullopt;
  return pinhole;
}

}  // namespace spartan::internal
