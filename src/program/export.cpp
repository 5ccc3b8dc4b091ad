#include <memory>

#include "program/commands.h"
#include "spartan/system/run_folder.h"

namespace spartan::program {
namespace {

struct ExportArguments {
  std::string run, format, output, trajectory;
};

Result<ExitCode> export_command(const Context& context, const ExportArguments& arguments) {
  const auto format = parse_export_format(arguments.format);
  if (!format) return failure(format);
  if (Status s = expect_new_file(context, arguments.output); !s) return failure(s);
  const auto kind = parse_trajectory_kind(arguments.trajectory);
  const ThreadPool workers(context.threads);
  if (Status s = export_run(arguments.run, *format, kind, workers, arguments.output); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_export(CLI::App& app, Context& context) {
  auto a = std::make_shared<ExportArguments>();
  CLI::App* command =
      add_command(app, context, "export", "Export a run's trajectory, map or point cloud in other formats",
                  "export run_06 --format kitti -o 06.txt", [&context, a] { return export_command(context, *a); });
  command->add_option("run", a->run, "Run folder.")->required();
  command
      ->add_option("--format", a->format,
                   "Format: tum, kitti, euroc or csv (trajectory), geotiff or octomap (global map), ply or pcd "
                   "(terrain point cloud).")
      ->required();
  command->add_option("-o,--output", a->output, "File to write.")->required();
  command
      ->add_option("--trajectory", a->trajectory,
                   "Trajectory: odometry, slam or localization (default: the last of these that exists), or smoothed.")
      ->check(CLI::IsMember({"odometry", "slam", "localization", "smoothed"}));
  add_force_flag(*command, context);
  add_threads_option(*command, context);
}

}  // namespace spartan::program
