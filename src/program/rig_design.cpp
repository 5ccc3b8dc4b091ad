// spartan rig design: finds the stereo pairs that meet a rover's requirements.
#include "program/rig_design.h"

#include <limits>
#include <memory>

#include "program/design_report.h"
#include "program/interrupt.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/report/report.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan::program {
namespace {

struct DesignArguments {
  std::string requirements;
  std::string output;
  std::size_t rows = 10;
  bool all = false;
};

Status write_files(const Context& context, const std::string& folder, const RigRequirements& requirements,
                   const RigDesign& design) {
  if (Status s = make_folder(folder); !s) return s;
  if (Status s = write_file_atomically(folder + "/feasible.csv", design_csv(design)); !s) return s;
  const auto figure = draw_ground(requirements, design);
  if (!figure) {
    context.log.warning("no pair to draw is feasible or published: no figure is written");
    return {};
  }
  if (Status s = write_file_atomically(folder + "/ground.svg", figure->svg); !s) return s;
  return write_png(folder + "/ground.png", figure->image);
}

Result<ExitCode> design_command(const Context& context, const DesignArguments& a) {
  if (Status s = expect_new_folder(context, a.output); !s) return failure(s);
  const auto requirements = read_requirements(a.requirements);
  if (!requirements) return failure(requirements);
  const RigDesign design = design_rig(*requirements);
  if (Status s = expect_not_interrupted(); !s) return failure(s);
  if (!a.output.empty()) {
    if (Status s = write_files(context, a.output, *requirements, design); !s) return failure(s);
  }
  if (context.json) {
    if (Status s = write_design_json(design, a.all, print); !s) return failure(s);
    return kDone;
  }
  const std::size_t rows = a.all ? std::numeric_limits<std::size_t>::max() : a.rows;
  if (Status s = print(design_text(*requirements, design, rows)); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_rig_design(CLI::App& rig, Context& context) {
  auto a = std::make_shared<DesignArguments>();
  CLI::App* command = add_command(rig, context, "design",
                                  "Find the stereo pairs that meet a rover's requirements, and the ground they see",
                                  "rig design config/requirements/rover.yaml -o rover_design",
                                  [&context, a] { return design_command(context, *a); });
  command->add_option("requirements", a->requirements, "Requirements file (docs/reference/requirements.md).")
      ->required()
      ->option_text("REQ REQUIRED");
  command->add_option("-o,--output", a->output,
                      "Folder for ground.svg, ground.png and feasible.csv (default: none is written).");
  command->add_option("--rows", a->rows, "Number of feasible combinations to print (default 10).")
      ->check(CLI::Range(0, 2'000'000));
  command->add_flag("--all", a->all, "Print all feasible combinations, also with --json.");
  add_force_flag(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
