// spartan rig: calibrations.
#include "program/rig_inspect.h"
#include "program/verbs.h"

namespace spartan::program {

void add_rig(CLI::App& app, Context& context) {
  CLI::App* rig = app.add_subcommand("rig", "Calibrations: say in words what was understood, check it on pictures");
  rig->require_subcommand(1);
  add_rig_inspect(*rig, context);
}

}  // namespace spartan::program
