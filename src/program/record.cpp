#include <fmt/format.h>

#include <chrono>
#include <memory>

#include "program/commands.h"
#include "program/interrupt.h"
#include "program/json.h"
#include "program/live_input.h"
#include "program/progress.h"
#include "program/recording_arguments.h"
#include "program/standard_error.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/camera/sample_stream.h"

namespace spartan::program {
namespace {

constexpr std::chrono::milliseconds kReadTimeout{50};

struct RecordArguments {
  std::string input, output, images = "pnm";
  RecordingArguments recording;
  LiveArguments live;
  double seconds = 0;
};

// Records until the end of the stream, an interrupt, or the time of `--seconds`.
Status record_stream(SampleStream& stream, StreamRecorder& recorder, double seconds, Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  while (!interrupted() && (seconds == 0 || elapsed_s() < seconds)) {
    auto read = stream.read(kReadTimeout);
    if (!read) return failure(read);
    if (read->state == StreamRead::State::end) break;
    if (read->state == StreamRead::State::sample) recorder.add(*read->sample);
    const RecorderProgress written = recorder.progress();
    if (!written.status) return written.status;
    progress.show(static_cast<int>(written.frames), 0, fmt::format("{:.1f} s", elapsed_s()));
  }
  return {};
}

Result<ExitCode> record_command(const Context& context, const RecordArguments& arguments) {
  auto open = open_options(arguments.recording);
  if (!open) return failure(open);
  const auto stream = open_live_input(context, arguments.input, *open, arguments.live);
  if (!stream) return failure(stream);
  auto recorder = StreamRecorder::create(arguments.output, (*stream)->info(), image_files_of(arguments.images));
  if (!recorder) return failure(recorder);
  const StandardErrorBuffer standard_error;  // the cameras do not wait for a terminal
  Progress progress(context.quiet);
  const Status recorded = record_stream(**stream, **recorder, arguments.seconds, progress);
  const Status finished = (*recorder)->finish();
  accept_interrupt();
  if (!recorded) return failure(recorded);
  if (!finished) return failure(finished);
  const RecorderProgress written = (*recorder)->progress();
  if (written.dropped > 0)
    context.log.warning(fmt::format("{} frames were not recorded: the disk is too slow", written.dropped));
  const DiscardedSamples discarded = (*stream)->discarded();
  for (const std::string& line : describe(discarded)) context.log.warning(line);
  for (const CameraPairReport& report : (*stream)->camera_reports()) context.log.info(describe(report));
  const Json json = {{"schema", 1},
                     {"recording", arguments.output},
                     {"frames", written.frames},
                     {"sensor_samples", written.sensor_samples},
                     {"dropped", written.dropped},
                     {"rejected", written.rejected},
                     {"skipped_sensor_rows", {{"reversed", discarded.reversed}, {"unreadable", discarded.unreadable}}}};
  const std::string text = fmt::format("{} frames and {} sensor samples recorded in {}\n", written.frames,
                                       written.sensor_samples, arguments.output);
  const Status printed = print(context.json ? text_of(json) + "\n" : text);
  if (!printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_record(CLI::App& app, Context& context) {
  auto a = std::make_shared<RecordArguments>();
  CLI::App* command = add_command(
      app, context, "record", "Record a live stream: images and sensor samples at their full rate",
      "record replay:$SPARTAN_DATA/kitti_06 -o recorded_06", [&context, a] { return record_command(context, *a); });
  command
      ->add_option(
          "input", a->input,
          "Address of the live stream: live:RIG, aravis:LEFT,RIGHT, gst:PIPELINE, replay:FOLDER or sim:SCENARIO.")
      ->required();
  command->add_option("-o,--output", a->output, "Folder of the recording to create.")->required();
  command->add_option("--rig", a->recording.rig,
                      "Calibration file to use, in any supported format (default: that of the stream). live:RIG and "
                      "sim:SCENARIO have theirs.");
  add_recording_options(*command, a->recording);
  command
      ->add_option("--seconds", a->seconds,
                   "Stop after so many seconds (default 0: at the end of the stream, or at Ctrl-C).")
      ->check(CLI::NonNegativeNumber);
  add_live_options(*command, a->live);
  add_recorded_images_option(*command, a->images);
  add_threads_option(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
