// spartan rig inspect: prints a calibration and checks it with images of its pairs.
#pragma once

#include "program/context.h"

namespace spartan::program {

void add_rig_inspect(CLI::App& rig, Context& context);

}  // namespace spartan::program
