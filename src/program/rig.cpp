// spartan rig: calibrations.
#include "program/rig_convert.h"
#include "program/rig_design.h"
#include "program/rig_inspect.h"
#include "program/verbs.h"

namespace spartan::program {

void add_rig(CLI::App& app, Context& context) {
  CLI::App* rig = app.add_subcommand(
      "rig", "Calibrations and stereo pairs: what was understood, what pictures say, other formats, what to build");
  rig->require_subcommand(1);
  add_rig_inspect(*rig, context);
  add_rig_convert(*rig, context);
  add_rig_design(*rig, context);
}

}  // namespace spartan::program
