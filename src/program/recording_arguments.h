// Command-line options that say how a recording is read.
#pragma once

#include <string>

#include "program/context.h"
#include "spartan/camera/recording.h"
#include "spartan/camera/recording_writer.h"

namespace spartan::program {

struct RecordingArguments {
  std::string rig, format, left, right, times;
  double fps = 0;
  int bits = 0;
  double pair_tolerance_s = OpenOptions().pair_tolerance_s;
};

/// `--format`, `--left`, `--right`, `--times`, `--fps`, `--bits`, `--pair-tolerance`, for commands that read a
/// recording.
void add_recording_options(CLI::App& command, RecordingArguments& arguments);
/// The same without `--format`.
void add_recorded_frames_options(CLI::App& command, RecordingArguments& arguments);
/// Code `usage` for an unknown format.
Result<OpenOptions> open_options(const RecordingArguments& arguments);

/// `--record-images png|pnm`, for commands that record a stream.
CLI::Option* add_recorded_images_option(CLI::App& command, std::string& value);
ImageFiles image_files_of(const std::string& value);

/// Logs what a recording does not state and is assumed, and irregularities of its files.
void log_remarks(const RecordingInfo& info, const Log& log);

}  // namespace spartan::program
