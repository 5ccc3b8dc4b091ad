#include "spartan/system/export.h"

#include <memory>

#include "program/verbs.h"

namespace spartan::program {
namespace {

struct ExportArguments {
  std::string run, format, output, trajectory;
};

Result<ExitCode> export_verb(const Context& context, const ExportArguments& arguments) {
  const auto format = parse_export_format(arguments.format);
  if (!format) return failure(format);
  const auto kind = parse_trajectory_kind(arguments.trajectory);
  const Workers workers(context.threads);
  if (Status s = export_run(arguments.run, *format, kind, workers, arguments.output); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_export(CLI::App& app, Context& context) {
  auto a = std::make_shared<ExportArguments>();
  CLI::App* verb =
      add_verb(app, context, "export", "Write a run's results in other formats",
               "export run_06 --format kitti -o 06.txt", [&context, a] { return export_verb(context, *a); });
  verb->add_option("run", a->run, "the run folder")->required();
  verb->add_option("--format", a->format,
                   "tum, kitti, euroc, csv (trajectories), geotiff (the global map) or ply (terrain)")
      ->required();
  verb->add_option("-o,--output", a->output, "the file to write")->required();
  verb->add_option(
          "--trajectory", a->trajectory,
          "which one: odometry, slam or localization (default: the best that the run has, which is the last of them)")
      ->check(CLI::IsMember({"odometry", "slam", "localization"}));
  add_threads_option(*verb, context);
}

}  // namespace spartan::program
