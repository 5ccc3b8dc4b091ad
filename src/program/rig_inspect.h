// spartan rig inspect: a calibration in words, and what pictures say about it.
#pragma once

#include "program/context.h"

namespace spartan::program {

void add_rig_inspect(CLI::App& rig, Context& context);

}  // namespace spartan::program
