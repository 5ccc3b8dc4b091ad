// Recordings of streams: what they state, and their end where they were interrupted.
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/camera/internal/layouts/spartan_format.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/core/options.h"

namespace spartan {

Status finish_interrupted_recording(const std::string& folder, const StreamInfo& info) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::exists(folder + "/recording.yaml", error)) return {};
  std::vector<std::string> tables{folder + "/frames.csv"};
  const fs::path sensors = fs::path(folder) / "sensors";
  for (const std::string& name : list_folder(sensors.string()).value_or(std::vector<std::string>()))
    tables.push_back((sensors / name).string());
  for (const std::string& path : tables) {
    auto table = read_file(path);
    if (!table) return failure(table);
    const std::size_t whole = table->rfind('\n') + 1;  // 0: no row
    if (whole == table->size()) continue;
    if (Status s = write_file_atomically(path, std::string_view(*table).substr(0, whole)); !s) return s;
  }
  const internal::RecordingFile file{.schema = 1, .about = recording_options_of(info)};
  return write_file_atomically(folder + "/recording.yaml", dump_options(file));
}

RecordingOptions recording_options_of(const StreamInfo& info) {
  RecordingOptions options;
  options.name = info.name;
  options.description = info.description;
  options.noise = info.noise;
  if (info.gravity_m_s2) options.gravity_m_s2 = *info.gravity_m_s2;
  return options;
}

}  // namespace spartan
