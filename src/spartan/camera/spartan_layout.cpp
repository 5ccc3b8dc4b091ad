// Spartan recordings: recording.yaml, rig.yaml, frames.csv, images/, sensors/, truth/ (docs/formats.md, "Recording").
#include <fmt/format.h>

#include <filesystem>

#include "spartan/camera/recording_index.h"
#include "spartan/camera/sensor_tables.h"
#include "spartan/camera/spartan_format.h"
#include "spartan/camera/table.h"
#include "spartan/rig/rig_files.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

using Row = std::vector<std::string_view>;

// One row of frames.csv; an error names the column.
Result<Shot> read_shot(const fs::path& folder, const Rig& rig, const Row& row) {
  const auto bad = [](const char* column, std::string_view text) {
    return failure(ErrorCode::input, fmt::format("{} is '{}'", column, text.substr(0, 40)), {}, "see docs/formats.md");
  };
  const auto frame = parse_number<std::int64_t>(row[0]), position = parse_number<std::int64_t>(row[1]);
  const auto left = parse_stamp_ns(row[3]), right = parse_stamp_ns(row[4]);
  const auto pan = parse_degrees(row[7]), tilt = parse_degrees(row[8]);
  const auto exposure = parse_number<double>(row[9]), gain = parse_number<double>(row[10]);
  const auto bits = parse_number<int>(row[11]);
  if (!frame) return bad("frame_id", row[0]);
  if (!position) return bad("position_id", row[1]);
  if (!rig.find_pair(std::string(row[2]))) return bad("pair (which the rig does not have)", row[2]);
  if (!left) return bad("left_stamp_ns", row[3]);
  if (!right) return bad("right_stamp_ns", row[4]);
  if (!pan) return bad("pan_deg", row[7]);
  if (!tilt) return bad("tilt_deg", row[8]);
  if (!exposure) return bad("exposure_us", row[9]);
  if (!gain) return bad("gain", row[10]);
  if (!bits || *bits < 8 || *bits > 16) return bad("bits", row[11]);
  Shot shot;
  shot.frame_id = *frame;
  shot.position_id = *position;
  shot.pair = std::string(row[2]);
  shot.left_stamp = *left;
  shot.right_stamp = *right;
  shot.left_file = (folder / std::string(row[5])).string();
  shot.right_file = (folder / std::string(row[6])).string();
  shot.pan_rad = *pan;
  shot.tilt_rad = *tilt;
  shot.exposure_us = *exposure;
  shot.gain = *gain;
  shot.bits = *bits;
  return shot;
}

Result<std::vector<Shot>> read_shots(const fs::path& folder, const Rig& rig) {
  auto table = TableReader::open((folder / "frames.csv").string(),
                                 {.separator = ',', .header = kFramesHeader, .ends_with_newline = true});
  if (!table) return failure(table);
  std::vector<Shot> shots;
  for (;;) {
    const auto row = table->next(12);
    if (!row) return failure(row);
    if (!*row) return shots;
    auto shot = read_shot(folder, rig, **row);
    if (!shot) return table->fault(shot.error().what);
    shots.push_back(std::move(*shot));
  }
}

}  // namespace

Result<RecordingIndex> index_spartan(const LayoutChoice& layout, const OpenOptions& options) {
  const fs::path folder = layout.folder;
  std::error_code error;
  if (!fs::exists(folder / "recording.yaml", error)) {
    return failure(ErrorCode::input, "has no recording.yaml: its writing was not finished", folder.string(),
                   "record it again");
  }
  auto file = load_options<RecordingFile>((folder / "recording.yaml").string());
  if (!file) return failure(file);
  RecordingIndex index;
  index.info.name = file->about.name;
  index.info.description = file->about.description;
  index.info.gravity_m_s2 = file->about.gravity_m_s2;
  const std::string rig_file = (folder / "rig.yaml").string();
  auto rig = choose_rig(options, rig_file, {}, [&] { return read_rig_yaml(rig_file); });
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  auto shots = read_shots(folder, index.info.rig);
  if (!shots) return failure(shots);
  index.shots = std::move(*shots);
  if (const fs::path truth = folder / "truth" / "poses.tum"; fs::exists(truth, error))
    index.info.truth_file = truth.string();

  const fs::path sensors = folder / "sensors";
  const auto stream = [&](const char* name, const char* header, std::size_t fields,
                          const RowReader& reader) -> OpenStream {
    if (!fs::exists(sensors / name, error)) return {};
    return stream_of_table((sensors / name).string(), {.separator = ',', .header = header, .ends_with_newline = true},
                           fields, reader);
  };
  index.imu = stream("imu.csv", kImuHeader, 7, read_imu_row(Eigen::Quaterniond::Identity()));
  for (OpenStream other : {stream("wheels.csv", kWheelsHeader, 3, read_wheel_row),
                           stream("compass.csv", kCompassHeader, 3, read_compass_row),
                           stream("inclinometer.csv", kInclinometerHeader, 4, read_inclinometer_row)}) {
    if (other) index.other_sensors.push_back(std::move(other));
  }
  return index;
}

}  // namespace spartan
