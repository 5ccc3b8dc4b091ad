#include <fmt/format.h>

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "program/commands.h"
#include "program/recording_arguments.h"
#include "spartan/camera/recording.h"
#include "spartan/system/run_folder.h"

namespace spartan::program {
namespace {

struct ExportArguments {
  std::string run, format, output, trajectory, recording;
  RecordingArguments reading;
  std::vector<const CLI::Option*> of_recording;
  bool list = false;
};

Result<ExitCode> list_formats() {
  std::string text = fmt::format("{:<9}{:<8}{}\n", "FORMAT", "FILE", "CONTENT");
  for (const ExportDescription& format : export_descriptions())
    text += fmt::format("{:<9}{:<8}{}\n", format.name, format.extension, format.content);
  text += "Parts and layers of the map, and more formats of it: spartan map export.\n";
  if (Status s = print(text); !s) return failure(s);
  return kDone;
}

Result<ExitCode> export_images(const Context& context, const ExportArguments& arguments,
                               std::optional<TrajectoryKind> kind, const ThreadPool& workers) {
  auto options = open_options(arguments.reading);
  if (!options) return failure(options);
  options->unfinished = true;  // what a live run that was killed has recorded
  const auto input = complete_run_input({arguments.recording, std::move(*options)}, RunFolder{arguments.run});
  if (!input) return failure(input);
  if (input->recording.empty())
    return failure(ErrorCode::usage, "needs the images of the recording", "--format colmap", "name it by --recording");
  if (Status s = expect_new_folder(context, arguments.output); !s) return failure(s);
  auto recording = open_recording(input->recording, input->open);
  if (!recording) return failure(recording);
  const auto images = export_colmap(arguments.run, **recording, kind, workers, arguments.output);
  if (!images) return failure(images);
  context.log.info(fmt::format("{} images in {}", *images, arguments.output));
  return kDone;
}

Result<ExitCode> export_command(const Context& context, const ExportArguments& arguments) {
  if (arguments.list) return list_formats();
  for (const auto& [value, name] :
       {std::pair{arguments.run, "run"}, {arguments.format, "--format"}, {arguments.output, "--output"}}) {
    if (value.empty()) return failure(ErrorCode::usage, "is required", name, "see `spartan export --help`");
  }
  const auto format = parse_export_format(arguments.format);
  if (!format) return failure(format);
  const auto kind = parse_trajectory_kind(arguments.trajectory);
  const ThreadPool workers(context.threads);
  if (*format == ExportFormat::colmap) return export_images(context, arguments, kind, workers);
  for (const CLI::Option* option : arguments.of_recording) {
    if (option->count() == 0) continue;
    return failure(ErrorCode::usage, "is of --format colmap only", option->get_name(), "leave it out");
  }
  if (Status s = expect_new_file(context, arguments.output); !s) return failure(s);
  if (Status s = export_run(arguments.run, *format, kind, workers, arguments.output); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_export(CLI::App& app, Context& context) {
  auto a = std::make_shared<ExportArguments>();
  CLI::App* command =
      add_command(app, context, "export", "Export a run's trajectory, map or point cloud in other formats",
                  "export run_06 --format kitti -o 06.txt", [&context, a] { return export_command(context, *a); });
  command->add_option("run", a->run, "Run folder; required but with --list.");
  command->add_flag("--list", a->list, "List the formats, their files and what they contain (default: export).");
  command->add_option("--format", a->format,
                      "Format: tum, kitti, euroc or csv (trajectory), colmap (images and poses), geotiff, gltf or "
                      "octomap (global map), ply or pcd (terrain point cloud). It has no default.");
  command->add_option("-o,--output", a->output, "File to write, for colmap a folder. It has no default.");
  command
      ->add_option("--trajectory", a->trajectory,
                   "Trajectory: odometry, slam or localization (default: the last of these that exists), or smoothed.")
      ->check(CLI::IsMember({"odometry", "slam", "localization", "smoothed"}));
  const std::size_t others = command->get_options().size();
  command->add_option(
      "--recording", a->recording,
      "Recording that was run, whose images colmap needs (default: as the run states it); of a live run "
      "RUN/live/1, and after a resume the next number. How it is read is by default as the run has read "
      "it.");
  command->add_option("--recording-format", a->reading.format, "Its layout, as --format of `run` (default: detected).");
  command->add_option("--rig", a->reading.rig, "Calibration file of the recording (default: that of the run).");
  add_recorded_frames_options(*command, a->reading);
  const std::vector<CLI::Option*> options = command->get_options();
  a->of_recording.assign(options.begin() + static_cast<std::ptrdiff_t>(others), options.end());
  add_force_flag(*command, context);
  add_threads_option(*command, context);
}

}  // namespace spartan::program
