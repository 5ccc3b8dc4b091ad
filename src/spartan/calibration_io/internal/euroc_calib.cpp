// Reader and writer of EuRoC/ASL calibrations (Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016).
#include <fmt/format.h>

#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/yaml_camera.h"

namespace spartan {

using namespace internal;

namespace {

namespace fs = std::filesystem;

constexpr int kMaxCameraFolders = 100;

fs::path sensor_file(const std::string& folder, const std::string& camera) {
  return fs::path(folder) / camera / "sensor.yaml";
}

// T_BS: body from sensor, 4×4 in row-major order. Two notations are in use: {rows, cols, data: […]} and a plain list.
std::optional<Pose> read_body_from_sensor(YamlMap& root) {
  const auto node = root.node("T_BS");
  if (!node) return std::nullopt;
  const auto numbers = node->is_map() ? YamlMap(*node, root.path("T_BS"), root.errors()).numbers("data", {16})
                                      : root.numbers("T_BS", {16});
  return numbers ? read_rigid(root, "T_BS", *numbers) : std::nullopt;
}

Result<Camera> read_sensor(const std::string& path, const std::string& name) {
  const auto loaded = load_yaml_file(path);
  if (!loaded) return failure(loaded);
  YamlErrors errors(path);
  YamlMap root(*loaded, "", errors);
  Camera camera;
  camera.name = name;
  camera.size = read_resolution(root, "resolution");
  camera.model = read_kalibr_model(root, "distortion_coefficients");
  camera.mount_from_camera = read_body_from_sensor(root).value_or(Pose());
  if (const Status status = errors.status(); !status) return failure(status);
  return camera;
}

}  // namespace

Result<Rig> read_euroc_calib(const std::string& mav0_folder) {
  Rig rig;
  rig.name = "euroc";
  rig.pairs = {{"stereo", "cam0", "cam1"}};
  Error errors{ErrorCode::configuration, "", "", ""};
  std::error_code error;
  for (int i = 0; i < kMaxCameraFolders; ++i) {
    const std::string name = fmt::format("cam{}", i);
    const fs::path file = sensor_file(mav0_folder, name);
    if (i > 1 && !fs::exists(file, error)) break;
    auto camera = read_sensor(file.string(), name);
    if (camera) {
      rig.cameras.push_back(std::move(*camera));
    } else {
      if (!errors.what.empty()) errors.what += '\n';
      errors.what += camera.error().message();
    }
  }
  if (!errors.what.empty()) return tl::unexpected<Error>(errors);
  return validated(std::move(rig), mav0_folder);
}

Result<CalibrationFiles> internal::write_euroc_calib(const Rig& rig, const std::string& folder) {
  CalibrationFiles files;
  for (const Camera* camera : cameras_pair_first(rig)) {
    const auto model = kalibr_model_lines(*camera, "distortion_coefficients", "");
    if (!model) return failure(model);
    const Pose body_from_sensor = rig.body_from_camera(camera->name);
    std::string text = "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [";
    for (int row = 0; row < 3; ++row) {
      text += fmt::format("{}, {},\n         ", list_of(body_from_sensor.rotation_matrix().row(row).transpose(), ", "),
                          body_from_sensor.translation()[row]);
    }
    text += fmt::format("0, 0, 0, 1]\nresolution: [{}, {}]\n", camera->size.width, camera->size.height);
    files.push_back({sensor_file(folder, fmt::format("cam{}", files.size())).string(), text + *model});
  }
  return files;
}

}  // namespace spartan
