// Reader of EuRoC/ASL calibration (Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016).
#include <fmt/format.h>

#include <filesystem>

#include "spartan/core/files.h"
#include "spartan/rig/rig_files.h"
#include "spartan/rig/yaml_bridge.h"

namespace spartan {
namespace {

using rig_detail::YamlFaults;
using rig_detail::YamlMap;

// T_BS: body from sensor, 4×4 row by row.
std::optional<Pose> read_body_from_sensor(YamlMap& root) {
  const auto node = root.node("T_BS");
  if (!node) return std::nullopt;
  // Both forms are in use: {rows, cols, data: […]} and the plain list.
  std::optional<std::vector<double>> numbers;
  if (node->IsMap()) {
    numbers = YamlMap(*node, root.path("T_BS"), root.faults()).numbers("data", {16});
  } else {
    numbers = root.numbers("T_BS", {16});
  }
  if (!numbers) return std::nullopt;
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers->data());
  if (!is_rotation(matrix.topLeftCorner<3, 3>(), 1e-4) || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    root.fault("T_BS", "is not a rigid transform");
    return std::nullopt;
  }
  return Pose(nearest_rotation(matrix.topLeftCorner<3, 3>()), matrix.topRightCorner<3, 1>());
}

CameraModel read_model(YamlMap& root) {
  root.choice("camera_model", {"pinhole"});
  const auto distortion_model = root.choice("distortion_model", {"radial-tangential", "radtan", "none"});
  PinholeModel pinhole;
  if (const auto k = root.numbers("intrinsics", {4})) pinhole = {(*k)[0], (*k)[1], (*k)[2], (*k)[3]};
  if (!distortion_model || *distortion_model == "none") return pinhole;
  RadialTangentialModel::Coefficients coefficients{};
  if (const auto d = root.numbers("distortion_coefficients", {4, 5, 8})) {
    std::copy(d->begin(), d->end(), coefficients.begin());
  }
  return RadialTangentialModel(pinhole, coefficients);
}

Result<Camera> read_sensor(const std::string& path, const std::string& name) {
  auto text = read_file(path);
  if (!text) {
    text.error().code = ErrorCode::configuration;
    return failure(text);
  }
  // OpenCV's "%YAML:1.0" is no directive of YAML; as a comment it keeps its line.
  if (text->starts_with("%YAML")) text->front() = '#';
  const auto loaded = rig_detail::load_yaml(*text, path);
  if (!loaded) return failure(loaded);
  YamlFaults faults(path);
  YamlMap root(*loaded, "", faults);
  Camera camera;
  camera.name = name;
  if (const auto size = root.numbers("resolution", {2})) {
    for (const double side : *size) {
      if (!(side >= 1 && side <= 1e6 && std::floor(side) == side)) {
        root.fault("resolution", "must be two whole numbers above zero");
        break;
      }
    }
    if (!faults.touches("resolution")) camera.size = {static_cast<int>((*size)[0]), static_cast<int>((*size)[1])};
  }
  camera.model = read_model(root);
  if (!faults.touches("intrinsics")) {
    for (std::size_t i = 0; i < 2; ++i) {
      if (parameters(camera.model)[0][i] <= 0) root.fault("intrinsics", "the focal lengths must be above zero");
    }
  }
  camera.mount_from_camera = read_body_from_sensor(root).value_or(Pose());
  if (const Status status = faults.status(); !status) return failure(status);
  return camera;
}

}  // namespace

Result<Rig> read_euroc_calib(const std::string& mav0_folder) {
  Rig rig;
  rig.name = "euroc";
  rig.pairs = {{"stereo", "cam0", "cam1"}};
  Error both{ErrorCode::configuration, "", "", ""};
  for (const char* name : {"cam0", "cam1"}) {
    const std::string path = (std::filesystem::path(mav0_folder) / name / "sensor.yaml").string();
    auto camera = read_sensor(path, name);
    if (camera) {
      rig.cameras.push_back(std::move(*camera));
    } else {
      both.what += (both.what.empty() ? "" : "\n") + camera.error().message();
    }
  }
  if (!both.what.empty()) return tl::unexpected<Error>(both);
  if (const Status status = rig.validate(mav0_folder); !status) return failure(status);
  return rig;
}

}  // namespace spartan
