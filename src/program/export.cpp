#include "spartan/system/export.h"

#include <memory>

#include "program/verbs.h"

namespace spartan::program {
namespace {

struct ExportArguments {
  std::string run, format, output, trajectory;
};

Result<ExitCode> export_verb(const ExportArguments& arguments) {
  const auto format = parse_export_format(arguments.format);
  if (!format) return failure(format);
  if (Status written = export_run(arguments.run, *format, arguments.output); !written) return failure(written);
  return kDone;
}

}  // namespace

void add_export(CLI::App& app, Context& context) {
  auto a = std::make_shared<ExportArguments>();
  CLI::App* verb = add_verb(app, context, "export", "Write a run's results in other formats",
                            "export run_06 --format kitti -o 06.txt", [a] { return export_verb(*a); });
  verb->add_option("run", a->run, "the run folder")->required();
  verb->add_option("--format", a->format, "tum, kitti, euroc, csv (trajectories) or ply (terrain)")->required();
  verb->add_option("-o,--output", a->output, "the file to write")->required();
  verb->add_option("--trajectory", a->trajectory, "which one; a run has one so far: odometry")
      ->check(CLI::IsMember({"odometry"}));
}

}  // namespace spartan::program
