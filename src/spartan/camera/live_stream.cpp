// The kinds of live streams.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/cameras/camera_stream.h"
#include "spartan/camera/internal/cameras/plugin_camera.h"
#include "spartan/camera/internal/replay_stream.h"
#include "spartan/camera/internal/sensor_line_stream.h"
#include "spartan/camera/recording.h"
#include "spartan/camera/sample_stream.h"

namespace spartan {
namespace {

constexpr std::string_view kReplay = "replay:", kLive = "live:";

using StreamResult = Result<std::unique_ptr<SampleStream>>;

StreamResult open_cameras(const std::string& address, const std::string& rig_file, Rig rig, const OpenOptions& open,
                          const LiveOptions& options) {
  StreamInfo info;
  info.path = address;
  info.rig = std::move(rig);
  info.rig_source = rig_file;
  info.name = std::filesystem::path(rig_file).stem().string();
  internal::CameraStreamOptions camera_options;
  camera_options.pair_tolerance_s = open.pair_tolerance_s;
  camera_options.should_stop = options.should_stop;
  std::unique_ptr<internal::SensorLineReader> lines;
  if (!options.sensors.empty()) {
    auto opened =
        internal::SensorLineReader::open(options.sensors, info.rig.imu.body_from_imu.rotation(), camera_options.clock);
    if (!opened) return failure(opened);
    lines = std::move(*opened);
  }
  auto cameras = internal::CameraStream::create(info, internal::open_plugin_camera, camera_options, options.log);
  if (!cameras) return failure(cameras);
  if (!lines) return std::move(*cameras);
  return std::make_unique<internal::SensorLineStream>(std::move(*cameras), std::move(lines));
}

// The sources of the left and the right camera in an address: the ids of two cameras, or one pipeline.
Result<std::array<std::string, 2>> sources_of(const std::string& address) {
  if (!address.starts_with(internal::kAravis)) return std::array{address, address};
  const std::string ids = address.substr(internal::kAravis.size());
  const std::size_t comma = ids.find(',');
  if (comma == 0 || comma == std::string::npos || comma + 1 == ids.size() ||
      ids.find(',', comma + 1) != std::string::npos)
    return failure(ErrorCode::usage, "does not name two cameras", address, "use aravis:LEFT,RIGHT");
  const std::string kind(internal::kAravis);
  return std::array{kind + ids.substr(0, comma), kind + ids.substr(comma + 1)};
}

// The cameras of an address take the place of those of the odometry's pair; no other pair has drivers.
StreamResult open_address(const std::string& address, const OpenOptions& open, const LiveOptions& options) {
  if (open.rig_file.empty()) {
    return failure(ErrorCode::usage, "needs a calibration of its cameras", address,
                   "name it with --rig, or name the cameras in a rig file and use live:RIG");
  }
  const auto sources = sources_of(address);
  if (!sources) return failure(sources);
  auto rig = read_rig(open.rig_file);
  if (!rig) return failure(rig);
  const auto pair = std::find_if(rig->pairs.begin(), rig->pairs.end(), [](const auto& p) { return p.for_odometry; });
  if (pair == rig->pairs.end()) return failure(ErrorCode::configuration, "has no pair for odometry", open.rig_file);
  for (Camera& camera : rig->cameras) {
    if (camera.name != pair->left && camera.name != pair->right) {
      camera.driver.reset();
      continue;
    }
    if (!camera.driver) camera.driver.emplace();
    camera.driver->source = (*sources)[camera.name == pair->left ? 0 : 1];
  }
  return open_cameras(address, open.rig_file, std::move(*rig), open, options);
}

StreamResult open_replay(const std::string& address, const OpenOptions& open, const LiveOptions& options) {
  if (!options.sensors.empty())
    return failure(ErrorCode::usage, "brings the samples of its sensors along", address, "omit --sensors");
  auto recording = open_recording(address.substr(kReplay.size()), open);
  if (!recording) return failure(recording);
  return std::make_unique<internal::ReplayStream>(std::move(*recording), options.speed, options.passes);
}

StreamResult open_rig_cameras(const std::string& address, const OpenOptions& open, const LiveOptions& options) {
  const std::string file = address.substr(kLive.size());
  if (!open.rig_file.empty()) {
    return failure(ErrorCode::usage, "names the rig itself, so " + open.rig_file + " would have no effect", address,
                   "omit --rig, or use live:" + open.rig_file);
  }
  auto rig = read_rig_yaml(file);
  if (!rig) return failure(rig);
  return open_cameras(address, file, std::move(*rig), open, options);
}

}  // namespace

bool is_live_address(std::string_view input) {
  return input.starts_with(kReplay) || input.starts_with(kLive) || input.starts_with(internal::kAravis) ||
         input.starts_with(internal::kGStreamer);
}

Result<std::unique_ptr<SampleStream>> open_live_stream(const std::string& address, const OpenOptions& open,
                                                       const LiveOptions& options) {
  if (!is_live_address(address)) {
    return failure(ErrorCode::usage, "is not the address of a live stream", address,
                   "use replay:FOLDER, live:RIG, aravis:LEFT,RIGHT or gst:PIPELINE");
  }
  if (!(options.speed > 0) || options.passes < 1) {
    return failure(ErrorCode::usage,
                   fmt::format("speed {} and {} passes must be positive", options.speed, options.passes), address);
  }
  if (address.starts_with(kReplay)) return open_replay(address, open, options);
  if (address.starts_with(kLive)) return open_rig_cameras(address, open, options);
  return open_address(address, open, options);
}

}  // namespace spartan
