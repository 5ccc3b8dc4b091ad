// Spartan layout: recording.yaml, rig.yaml, frames.csv, images/, sensors/, truth/ (docs/reference/recording.md).
#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/frame_tables.h"
#include "spartan/camera/internal/layouts/spartan_format.h"
#include "spartan/camera/internal/recording_index.h"
#include "spartan/camera/internal/sensor_tables.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

Result<std::vector<FrameEntry>> read_frames(const fs::path& folder, const Rig& rig) {
  auto table = TableReader::open((folder / "frames.csv").string(), spartan_frames_format());
  if (!table) return failure(table);
  return read_spartan_frames(std::move(*table), folder.string(), rig);
}

}  // namespace

Result<RecordingIndex> index_spartan(const LayoutChoice& layout, const OpenOptions& options) {
  const fs::path folder = layout.folder;
  std::error_code error;
  if (!fs::exists(folder / "recording.yaml", error)) {
    return failure(ErrorCode::input, "has no recording.yaml: the recording was not finished", folder.string(),
                   "resume or repeat the recording");
  }
  auto file = load_options<RecordingFile>((folder / "recording.yaml").string());
  if (!file) return failure(file);
  RecordingIndex index;
  index.info.name = file->about.name;
  index.info.description = file->about.description;
  index.info.gravity_m_s2 = file->about.gravity_m_s2;
  index.info.noise = file->about.noise;
  const std::string rig_file = (folder / "rig.yaml").string();
  auto rig = choose_rig(options, rig_file, {}, [&] { return read_rig_yaml(rig_file); });
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  auto frames = read_frames(folder, index.info.rig);
  if (!frames) return failure(frames);
  index.frames = std::move(*frames);
  if (const fs::path truth = folder / "truth" / "poses.tum"; fs::exists(truth, error))
    index.info.truth_file = truth.string();

  const fs::path sensors = folder / "sensors";
  const auto stream = [&](const char* name, const char* header, std::size_t fields,
                          const RowReader& reader) -> SampleStreamFactory {
    if (!fs::exists(sensors / name, error)) return {};
    index.sensor_files.push_back((sensors / name).string());
    return stream_of_table((sensors / name).string(), {.separator = ',', .header = header, .ends_with_newline = true},
                           fields, reader);
  };
  index.imu = stream("imu.csv", kImuHeader, 7, read_imu_row(Eigen::Quaterniond::Identity()));
  for (SampleStreamFactory other : {stream("wheels.csv", kWheelsHeader, 3, read_wheel_row),
                                    stream("compass.csv", kCompassHeader, 3, read_compass_row),
                                    stream("inclinometer.csv", kInclinometerHeader, 4, read_inclinometer_row)}) {
    if (other) index.other_sensors.push_back(std::move(other));
  }
  return index;
}

}  // namespace spartan::internal
