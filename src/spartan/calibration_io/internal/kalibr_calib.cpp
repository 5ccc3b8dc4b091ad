// Reader and writer of Kalibr's camchain.yaml and camchain-imucam.yaml (Furgale et al.; Kalibr wiki, "Yaml formats").
#include <fmt/format.h>

#include <cmath>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_readers.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/file_frame.h"
#include "spartan/calibration_io/internal/yaml_camera.h"

namespace spartan {

using namespace internal;

namespace {

// Tolerance in m and rad between the transforms of the chain and those of the IMU, which are results of one
// calibration.
constexpr double kConsistency = 1e-3;
constexpr std::size_t kMaxCameras = 100;
/// Kalibr estimates the offset of each camera: those of one clock differ by less.
constexpr double kOneClock_s = 0.001;

std::string camera_key(std::size_t i) {
  return fmt::format("cam{}", i);
}

// A 4×4 matrix as a list of four rows.
std::optional<Pose> read_transform(YamlMap& camera, std::string_view key) {
  const auto node = camera.node(key);
  if (!node) return std::nullopt;
  std::vector<double> rows;
  if (node->is_list() && node->items().size() == 4) {
    for (const YamlNode& row : node->items()) {
      if (!row.is_list() || row.items().size() != 4) break;
      for (const YamlNode& entry : row.items()) {
        const auto value = entry.is_scalar() ? parse_finite_number(entry.scalar()) : std::nullopt;
        if (value) rows.push_back(*value);
      }
    }
  }
  if (rows.size() == 16) return read_rigid(camera, key, rows);
  camera.add_error(key, "must be four rows of four finite numbers");
  return std::nullopt;
}

// The cameras of a chain. While reading, `mount_from_camera` is the pose in the frame of cam0.
struct Chain {
  std::vector<Camera> cameras;
  std::optional<Pose> first_from_imu;
  std::string imu_key;  // the key that gives it
  double time_offset_s = 0;
  std::vector<RigDifference> ignored;
};

bool consistent(const Pose& a, const Pose& b) {
  const Pose apart = a.inverse() * b;
  return apart.translation().norm() <= kConsistency && rotation_angle(apart) <= kConsistency;
}

// Kalibr writes T_cam_imu; the files of OpenVINS have its inverse, T_imu_cam.
struct ImuOfCamera {
  std::string key;
  Pose camera_from_imu;
};
std::optional<ImuOfCamera> read_imu(YamlMap& entry) {
  std::optional<ImuOfCamera> imu;
  for (const char* key : {"T_imu_cam", "T_cam_imu"}) {
    if (!entry.has(key)) continue;
    const auto pose = read_transform(entry, key);
    if (!pose) return std::nullopt;
    const Pose camera_from_imu = key == std::string("T_cam_imu") ? *pose : pose->inverse();
    if (imu && !consistent(imu->camera_from_imu, camera_from_imu))
      entry.add_error(key, "is inconsistent with T_imu_cam");
    imu = {key, camera_from_imu};
  }
  return imu;
}

// The first camera with a transform to the IMU defines the body; the transforms of the others must be consistent.
void read_link(YamlMap& entry, Chain& chain, Camera& camera) {
  const auto imu = read_imu(entry);
  if (!chain.cameras.empty()) {
    if (!entry.has("T_cn_cnm1") && imu && chain.first_from_imu) {
      camera.mount_from_camera = *chain.first_from_imu * imu->camera_from_imu.inverse();
      return;
    }
    const auto link = read_transform(entry, "T_cn_cnm1");
    if (!link) return;
    camera.mount_from_camera = chain.cameras.back().mount_from_camera * link->inverse();
  }
  if (!imu) return;
  const Pose first_from_imu = camera.mount_from_camera * imu->camera_from_imu;
  if (!chain.first_from_imu) {
    chain.first_from_imu = first_from_imu;
    chain.imu_key = imu->key;
  } else if (!consistent(first_from_imu, *chain.first_from_imu)) {
    entry.add_error(imu->key, "is inconsistent with T_cn_cnm1");
  }
}

Chain read_chain(YamlMap& root) {
  Chain chain;
  // A missing cam1 is an error: a pair needs two cameras.
  for (std::size_t i = 0; i < kMaxCameras && (i < 2 || root.has(camera_key(i))); ++i) {
    const auto node = root.node(camera_key(i));
    if (!node) continue;
    YamlMap entry(*node, root.path(camera_key(i)), root.errors());
    Camera camera;
    camera.name = camera_key(i);
    camera.size = read_resolution(entry, "resolution");
    camera.model = read_kalibr_model(entry, "distortion_coeffs");
    if (entry.has("timeshift_cam_imu")) {
      // Stamp of the IMU = stamp of the camera + shift. One clock of both cameras is assumed.
      const double shift = entry.number("timeshift_cam_imu").value_or(0);
      if (i == 0) chain.time_offset_s = shift;
      if (std::abs(shift - chain.time_offset_s) > kOneClock_s) {
        chain.ignored.push_back(
            {camera.name + ".timeshift_cam_imu",
             fmt::format("the camera's clock is {} s off that of cam0", shift - chain.time_offset_s)});
      }
    }
    read_link(entry, chain, camera);
    chain.cameras.push_back(std::move(camera));
  }
  if (!chain.first_from_imu && chain.time_offset_s != 0) {
    chain.ignored.insert(chain.ignored.begin(),
                         {camera_key(0) + ".timeshift_cam_imu",
                          fmt::format("the camera's clock is {} s off the IMU's", chain.time_offset_s)});
  }
  return chain;
}

std::string transform_lines(const char* key, const Pose& pose) {
  std::string text = fmt::format("  {}:\n", key);
  const Eigen::Matrix4d matrix = pose.matrix();
  for (int row = 0; row < 4; ++row) {
    text += fmt::format("  - [{}]\n", list_of(matrix.row(row).transpose(), ", "));
  }
  return text;
}

}  // namespace

Result<LoadedRig> read_kalibr_calib(const std::string& path) {
  const auto loaded = load_yaml_file(path);
  if (!loaded) return failure(loaded);
  YamlErrors errors(path);
  YamlMap root(*loaded, "", errors);
  Chain chain = read_chain(root);
  if (const Status status = errors.status(); !status) return failure(status);

  const bool has_imu = chain.first_from_imu.has_value();
  const Pose body_from_first = has_imu ? chain.first_from_imu->inverse() : optical_from_forward().inverse();
  for (Camera& camera : chain.cameras) camera.mount_from_camera = body_from_first * camera.mount_from_camera;
  Rig rig;
  rig.name = "kalibr";
  rig.convention = has_imu ? PoseConvention::body : PoseConvention::left_optical;
  rig.cameras = std::move(chain.cameras);
  if (has_imu) rig.imu.time_offset_s = chain.time_offset_s;
  rig.pairs = {{"stereo", camera_key(0), camera_key(1)}};
  auto valid = validated(std::move(rig), path);
  if (!valid) return failure(std::move(valid));
  return LoadedRig{std::move(*valid),
                   CalibrationFormat::kalibr,
                   {path},
                   {},
                   has_imu ? "the IMU of " + chain.imu_key : kBodyIsLeftCamera,
                   std::move(chain.ignored)};
}

Result<CalibrationFiles> internal::write_kalibr_calib(const Rig& rig, const std::string& path) {
  const bool with_body = !body_is_left_camera(rig, rig.pairs.front());
  std::string text;
  Pose body_from_previous;
  const auto cameras = cameras_pair_first(rig);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const auto model = kalibr_model_lines(*cameras[i], "distortion_coeffs", "  ");
    if (!model) return failure(model);
    const Pose body_from_camera = rig.body_from_camera(cameras[i]->name);
    text += fmt::format("{}:\n", camera_key(i));
    if (with_body) text += transform_lines("T_cam_imu", body_from_camera.inverse());
    if (i > 0) text += transform_lines("T_cn_cnm1", body_from_camera.inverse() * body_from_previous);
    text += *model + fmt::format("  resolution: [{}, {}]\n  rostopic: /{}/image_raw\n", cameras[i]->size.width,
                                 cameras[i]->size.height, camera_key(i));
    if (with_body) text += fmt::format("  timeshift_cam_imu: {}\n", rig.imu.time_offset_s);
    body_from_previous = body_from_camera;
  }
  return CalibrationFiles{{path, text}};
}

}  // namespace spartan
