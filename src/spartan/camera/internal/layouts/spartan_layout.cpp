// Spartan layout: recording.yaml, rig.yaml, frames.csv, images/, sensors/, truth/ (docs/reference/recording.md).
#include <algorithm>
#include <filesystem>
#include <string>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/frame_tables.h"
#include "spartan/camera/internal/layouts/spartan_format.h"
#include "spartan/camera/internal/recording_index.h"
#include "spartan/camera/internal/sensor_tables.h"
#include "spartan/core/files.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLeastDigits_ns = 16;  // of a time since 1970 in nanoseconds

// The calibration: rig.yaml, in any format, or the one of another name in the folder.
Result<RigChoice> rig_of(const fs::path& folder, const OpenOptions& options) {
  std::error_code error;
  const std::string own = (folder / "rig.yaml").string();
  if (!options.rig_file.empty() || fs::exists(own, error))
    return choose_rig(options, own, {}, [&] { return read_rig(own); });
  auto found = read_calibration(folder.string());
  if (found) return RigChoice{std::move(found->rig), found->files.empty() ? folder.string() : found->files.front()};
  return failure(ErrorCode::input, "is missing: the recording has no calibration", own,
                 "add the file, or give a calibration with --rig");
}

// The file that states the properties of a recording; empty where there is none, as in a list of frames that was
// written by hand, or in a simulation that is not finished.
std::string properties_file(const fs::path& folder) {
  std::error_code error;
  for (const char* const name : {kFinishedFile, kUnfinishedFile}) {
    if (fs::exists(folder / name, error)) return name;
  }
  return {};
}

Status read_properties(const fs::path& path, RecordingInfo& info) {
  auto file = load_options<RecordingFile>(path.string());
  if (!file) return failure(file);
  info.name = file->about.name;
  info.description = file->about.description;
  info.gravity_m_s2 = file->about.gravity_m_s2;
  info.noise = file->about.noise;
  return {};
}

// What to do with a table of another program under the name frames.csv; empty where it is not recognised.
std::string hint_of_other_table(const fs::path& path) {
  const auto text = read_beginning(path.string(), 256);
  if (!text) return {};
  if (text->starts_with("%time")) return "a ROS topic as text; spartan-bag import reads the bag itself";
  const std::size_t digits = std::min(text->find_first_not_of("0123456789"), text->size());
  if (text->starts_with("#timestamp") || (digits >= kLeastDigits_ns && text->substr(digits, 1) == ",")) {
    return "the table of one camera as in mav0/cam0/data.csv of EuRoC: give the folder that holds mav0, or the folders "
           "of the images with --left and --right";
  }
  return {};
}

}  // namespace

Result<RecordingIndex> index_spartan(const LayoutChoice& layout, const OpenOptions& options) {
  const fs::path folder = layout.folder;
  std::error_code error;
  RecordingIndex index;
  auto table = TableReader::open((folder / "frames.csv").string(), spartan_frames_format());
  const bool by_hand = table && !table->has_all_columns();
  const std::string properties = properties_file(folder);
  if (properties.empty() && !by_hand && !options.unfinished) {
    return failure(ErrorCode::input, "has no recording.yaml: the recording was not finished", folder.string(),
                   "resume or repeat the recording");
  }
  if (!properties.empty()) {
    if (Status status = read_properties(folder / properties, index.info); !status) return failure(status);
  }
  const bool unfinished = properties != kFinishedFile && !by_hand;
  if (unfinished)
    index.info.sequence.warnings.emplace_back("the recording is not finished; what it has until now is used");
  if (!table) {
    table.error().hint = hint_of_other_table(folder / "frames.csv");
    return failure(table);
  }
  auto rig = rig_of(folder, options);
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  auto frames = read_spartan_frames(std::move(*table), folder.string(), index.info.rig, unfinished);
  if (!frames) return failure(frames);
  index.frames = std::move(*frames);
  if (const fs::path truth = folder / "truth" / "poses.tum"; fs::exists(truth, error))
    index.info.truth_file = truth.string();

  const fs::path sensors = folder / "sensors";
  const auto stream = [&](const char* name, const char* header, std::size_t fields,
                          const RowReader& reader) -> SensorStreamFactory {
    const std::string file = (sensors / name).string();
    if (!fs::exists(file, error)) return {};
    const TableFormat format{.separator = ',', .header = header, .ends_with_newline = true};
    if (unfinished) {
      // Interrupted before its header was on disk.
      const auto opened = TableReader::open(file, format);
      if (!opened && opened.error().code == ErrorCode::input) return {};
    }
    index.sensor_files.push_back(file);
    return stream_of_table(file, format, fields, reader);
  };
  index.imu = stream("imu.csv", kImuHeader, 7, read_imu_row(index.info.rig.imu.body_from_imu.rotation()));
  for (SensorStreamFactory other : {stream("wheels.csv", kWheelsHeader, 3, read_wheel_row),
                                    stream("compass.csv", kCompassHeader, 3, read_compass_row),
                                    stream("inclinometer.csv", kInclinometerHeader, 4, read_inclinometer_row)}) {
    if (other) index.other_sensors.push_back(std::move(other));
  }
  return index;
}

}  // namespace spartan::internal
