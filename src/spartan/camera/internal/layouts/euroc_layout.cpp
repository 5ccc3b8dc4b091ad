// EuRoC/ASL layout: cam0/data.csv, cam0/data/<file>, cam1/…, imu0/data.csv, each with a sensor.yaml.
// Source: Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016.
#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/frame_tables.h"
#include "spartan/camera/internal/recording_index.h"
#include "spartan/camera/internal/sensor_tables.h"
#include "spartan/camera/internal/stamp_order.h"
#include "spartan/core/files.h"
#include "spartan/core/strict_yaml.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

// The images of one camera folder, file names expanded to paths.
Result<EurocImages> read_images(const fs::path& camera) {
  auto table = TableReader::open((camera / "data.csv").string(), {});
  if (!table) return failure(table);
  auto images = read_euroc_images(std::move(*table));
  if (!images) return failure(images);
  for (std::string& file : images->files) file = (camera / "data" / file).string();
  return images;
}

struct EurocImu {
  Pose body_from_imu;
  ImuNoise noise;
};

// T_BS (body from sensor). Two notations are in use: {rows, cols, data: […]} and a plain list.
std::optional<Pose> pose_of(YamlMap& root) {
  const auto node = root.optional_node("T_BS");
  if (!node) return Pose();
  const auto data = node->is_map() ? YamlMap(*node, root.path("T_BS"), root.errors()).numbers("data", {16})
                                   : root.numbers("T_BS", {16});
  if (!data) return std::nullopt;
  const std::vector<double>& m = *data;
  Eigen::Matrix3d rotation;
  rotation << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  if (!is_rotation(rotation, 1e-3)) {
    root.add_error("T_BS", "its rotation part is not a rotation matrix");
    return std::nullopt;
  }
  return Pose(Eigen::Quaterniond(nearest_rotation(rotation)), Eigen::Vector3d(m[3], m[7], m[11]));
}

// A noise density; 0 (unknown) where the key is missing.
double density(YamlMap& root, const char* key) {
  const double value = root.has(key) ? root.number(key).value_or(0) : 0;
  if (!(value >= 0 && value < 10)) root.add_error(key, fmt::format("is {}, must be at least 0 and below 10", value));
  return value;
}

// Reads imu0/sensor.yaml; defaults where the file is missing.
Result<EurocImu> read_imu(const std::string& path) {
  EurocImu imu;
  std::error_code error;
  if (!fs::exists(path, error)) return imu;
  auto text = read_file(path);
  if (!text) return failure(text);
  if (text->starts_with("%YAML:"))
    text->erase(0, text->find('\n'));  // the %YAML:1.0 header of OpenCV is not valid YAML
  const auto file = parse_yaml(*text, path);
  if (!file) return failure(file);
  YamlErrors errors(path);
  YamlMap root(*file, "", errors);
  imu.body_from_imu = pose_of(root).value_or(Pose());
  imu.noise.gyro_noise_rad_s_sqrt_hz = density(root, "gyroscope_noise_density");
  imu.noise.gyro_walk_rad_s2_sqrt_hz = density(root, "gyroscope_random_walk");
  imu.noise.accel_noise_m_s2_sqrt_hz = density(root, "accelerometer_noise_density");
  imu.noise.accel_walk_m_s3_sqrt_hz = density(root, "accelerometer_random_walk");
  if (Status status = errors.status(); !status) return failure(status);
  return imu;
}

// cam0/sensor.yaml; where it is missing, the camchain of Kalibr that TUM-VI keeps in the folder dso beside mav0.
std::string find_camera_calibration(const fs::path& mav) {
  std::string own = (mav / "cam0" / "sensor.yaml").string();
  std::error_code error;
  if (fs::exists(own, error)) return own;
  const fs::path above = fs::absolute(mav, error).lexically_normal().parent_path();
  for (const fs::path& folder : {mav, above, above / "dso"}) {
    for (const std::string& name : list_folder(folder.string()).value_or(std::vector<std::string>())) {
      if (name.starts_with("camchain") && name.ends_with(".yaml")) return (folder / name).string();
    }
  }
  return own;
}

// Its mount is the one that the rig states. T_BS counts where the body of the rig is that of cam0/sensor.yaml
// (`own_body`).
Status index_imu(const fs::path& folder, bool own_body, RecordingIndex& index) {
  const std::string table = (folder / "data.csv").string();
  std::error_code error;
  if (!fs::exists(table, error)) return {};
  const auto about = read_imu((folder / "sensor.yaml").string());
  if (!about) return failure(about);
  Rig& rig = index.info.rig;
  if (own_body) rig.imu.body_from_imu = about->body_from_imu;
  // A calibration of two cameras alone has the left one for its body, to which the axes of the IMU are not known.
  if (rig.convention == PoseConvention::left_optical && rig.imu == ImuMount()) {
    index.info.sequence.warnings.push_back(
        fmt::format("{}: is left out: {} does not state the mount of the IMU; give a rig.yaml with imu, or a camchain "
                    "with T_cam_imu, with --rig",
                    table, index.info.rig_source));
    return {};
  }
  index.info.noise.imu = about->noise;
  index.sensor_files.push_back(table);
  index.imu = stream_of_table(table, {}, 7, read_imu_row(rig.imu.body_from_imu.rotation()));
  return {};
}

FrameEntry make_entry(const StampMatch& match, const EurocImages& left, const EurocImages& right) {
  FrameEntry entry;
  const Stamp any = match.left ? left.stamps[*match.left] : right.stamps[*match.right];
  entry.left_stamp = entry.right_stamp = any;
  entry.right_only = !match.left;
  if (match.left) entry.left_file = left.files[*match.left];
  if (match.right) {
    entry.right_file = right.files[*match.right];
    entry.right_stamp = right.stamps[*match.right];
  }
  if (!match.left || !match.right) {
    const bool no_left = !match.left;
    entry.fault = no_left ? FrameFault::left_missing : FrameFault::right_missing;
    entry.message = fmt::format("{}: has no {} image within the pairing tolerance at {} ns",
                                no_left ? entry.right_file : entry.left_file, no_left ? "left" : "right", any.ns);
  }
  return entry;
}

}  // namespace

Result<RecordingIndex> index_euroc(const LayoutChoice& layout, const OpenOptions& options) {
  const fs::path folder = layout.folder;
  RecordingIndex index;
  const auto left = read_images(folder / "cam0");
  if (!left) return failure(left);
  const auto right = read_images(folder / "cam1");
  if (!right) return failure(right);
  const std::string calibration = find_camera_calibration(folder);
  const bool camchain = !calibration.ends_with("sensor.yaml");
  auto rig = choose_rig(options, calibration, {},
                        [&] { return camchain ? read_rig(calibration) : read_euroc_calib(folder.string()); });
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  const std::string pair = default_pair(index.info.rig);
  for (const StampMatch& match : match_stamps(left->stamps, right->stamps, options.pair_tolerance_s)) {
    FrameEntry entry = make_entry(match, *left, *right);
    entry.frame_id = static_cast<std::int64_t>(index.frames.size());
    entry.pair = pair;
    index.frames.push_back(std::move(entry));
  }
  std::error_code error;
  for (const char* name : {"state_groundtruth_estimate0", "mocap0"}) {  // EuRoC, TUM-VI
    const fs::path truth = folder / name / "data.csv";
    if (index.info.truth_file.empty() && fs::exists(truth, error)) index.info.truth_file = truth.string();
  }
  const bool own_body = options.rig_file.empty() && !camchain;
  if (Status status = index_imu(folder / "imu0", own_body, index); !status) return failure(status);
  return index;
}

}  // namespace spartan::internal
