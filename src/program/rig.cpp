// spartan rig: calibrations and the design of stereo pairs.
#include "program/commands.h"
#include "program/rig_convert.h"
#include "program/rig_design.h"
#include "program/rig_inspect.h"

namespace spartan::program {

void add_rig(CLI::App& app, Context& context) {
  CLI::App* rig = app.add_subcommand("rig", "Check, convert and correct calibrations; design stereo pairs");
  rig->require_subcommand(1);
  add_rig_inspect(*rig, context);
  add_rig_convert(*rig, context);
  add_rig_design(*rig, context);
}

}  // namespace spartan::program
