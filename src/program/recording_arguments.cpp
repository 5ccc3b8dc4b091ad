#include "program/recording_arguments.h"

namespace spartan::program {

void add_recording_options(CLI::App& command, RecordingArguments& a) {
  command.add_option("--format", a.format,
                     "Layout of the recording: spartan, kitti, kitti-raw, euroc, images or video (default: detected).");
  add_recorded_frames_options(command, a);
}

void add_recorded_frames_options(CLI::App& command, RecordingArguments& a) {
  command.add_option("--left", a.left,
                     "Images of the left camera: a folder, a quoted pattern of file names (\"l*.png\") or a video, "
                     "relative to the recording. Needs --right (default: as the layout has them).");
  command.add_option("--right", a.right,
                     "Images of the right camera, likewise. Images with the same number or time stamp in their names "
                     "are pairs (default: as the layout has them).");
  command.add_option(
      "--times", a.times,
      "File of frame times, one a row, alone or beside file names: decimal seconds, or integers of s, ms, us "
      "or ns, which is found by their size and printed (default: times.txt of the recording, else the file names).");
  command.add_option("--fps", a.fps, "Frames per second, instead of times (default: times of the recording).")
      ->check(CLI::Range(OpenOptions::kLeastFps, OpenOptions::kMostFps));
  command
      .add_option("--bits", a.bits,
                  "Significant bits of the samples of 16-bit images (default: by the calibration, else by the images).")
      ->check(CLI::Range(OpenOptions::kLeastBits, OpenOptions::kMostBits));
  command
      .add_option("--pair-tolerance", a.pair_tolerance_s,
                  "Largest difference in seconds of the time stamps of the two images of a frame (default 0.005); "
                  "raising it pairs images of cameras that are not triggered together.")
      ->check(CLI::Range(0.0, OpenOptions::kMostPairTolerance_s));
}

Result<OpenOptions> open_options(const RecordingArguments& a) {
  OpenOptions open;
  if (!a.format.empty()) {
    const auto format = parse_recording_format(a.format);
    if (!format) return failure(format);
    open.format = *format;
  }
  open.rig_file = a.rig;
  open.left_images = a.left;
  open.right_images = a.right;
  open.times_file = a.times;
  open.fps = a.fps;
  open.bits = a.bits;
  open.pair_tolerance_s = a.pair_tolerance_s;
  return open;
}

CLI::Option* add_recorded_images_option(CLI::App& command, std::string& value) {
  return command
      .add_option("--record-images", value,
                  "Files of recorded images: pnm (default) is fast to write, png half as large; both are lossless.")
      ->check(CLI::IsMember({"pnm", "png"}));
}

ImageFiles image_files_of(const std::string& value) {
  return value == "png" ? ImageFiles::png : ImageFiles::pnm;
}

void log_remarks(const RecordingInfo& info, const Log& log) {
  for (const std::string& warning : info.sequence.warnings) log.warning(warning);
  for (const std::string& remark : info.sequence.remarks) log.info(remark);
}

}  // namespace spartan::program
