// What a run notes of its recording (input.yaml). It is beside config.yaml, which does not depend on paths.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/core/options.h"
#include "spartan/system/run_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

// The content of input.yaml.
struct RunInputFile {
  std::string recording, format, left, right, times;
  double fps = 0;
  int bits = 0;
  double pair_tolerance_s = OpenOptions().pair_tolerance_s;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("recording", recording, "The recording that is run.");
    v.field("format", format, "Its layout, as --format.");
    v.field("left", left, "Images of the left camera, as --left.");
    v.field("right", right, "Images of the right camera, as --right.");
    v.field("times", times, "File of frame times, as --times.");
    v.field("fps", fps, "Frames per second, as --fps; 0: not stated.", between(0, OpenOptions::kMostFps));
    v.field("bits", bits, "Significant bits of 16-bit images, as --bits; 0: not stated.",
            between(0, OpenOptions::kMostBits));
    v.field("pair_tolerance_s", pair_tolerance_s, "Largest difference of the stamps of a frame, as --pair-tolerance.",
            between(0, OpenOptions::kMostPairTolerance_s));
  }
};

std::string absolute(const std::string& path) {
  std::error_code error;
  return path.empty() ? path : fs::weakly_canonical(fs::absolute(path, error), error).string();
}

// Of a run of an older version, which states its recording at its end, as it was typed.
RunInputFile input_of_summary(const RunFolder& folder) {
  RunInputFile file;
  const auto text = read_file(folder.summary());
  const auto json = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  if (json.is_object() && json.contains("input") && json["input"].is_string())
    file.recording = json["input"].get<std::string>();
  return file;
}

}  // namespace

Result<RunInput> complete_run_input(RunInput given, const RunFolder& folder) {
  std::error_code error;
  auto noted = fs::exists(folder.input(), error) ? load_options<RunInputFile>(folder.input())
                                                 : Result<RunInputFile>(input_of_summary(folder));
  if (!noted) return failure(noted);
  OpenOptions& open = given.open;
  if (!open.format && !noted->format.empty()) {
    const auto format = parse_recording_format(noted->format);
    if (!format) return failure(ErrorCode::configuration, format.error().what, folder.input());
    open.format = *format;
  }
  if (open.left_images.empty() && open.right_images.empty()) {
    open.left_images = std::move(noted->left);
    open.right_images = std::move(noted->right);
  }
  if (open.times_file.empty() && open.fps == 0) {
    open.times_file = std::move(noted->times);
    open.fps = noted->fps;
  }
  if (open.bits == 0) open.bits = noted->bits;
  if (open.pair_tolerance_s == OpenOptions().pair_tolerance_s) open.pair_tolerance_s = noted->pair_tolerance_s;
  if (open.rig_file.empty()) open.rig_file = folder.rig();
  if (given.recording.empty() && fs::exists(noted->recording, error)) given.recording = std::move(noted->recording);
  return given;
}

Status write_run_input(const RunInput& input, const RunFolder& folder) {
  const OpenOptions& open = input.open;
  const RunInputFile file{absolute(input.recording),
                          open.format ? std::string(name_of(*open.format)) : std::string(),
                          open.left_images,
                          open.right_images,
                          absolute(open.times_file),
                          open.fps,
                          open.bits,
                          open.pair_tolerance_s};
  return write_file_atomically(folder.input(), dump_options(file));
}

}  // namespace spartan
