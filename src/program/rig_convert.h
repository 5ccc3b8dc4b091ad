// `spartan rig convert`, and what the `rig` commands share.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "program/context.h"
#include "spartan/rig/rig.h"

namespace spartan::program {

void add_rig_convert(CLI::App& rig, Context& context);

/// Self-mask paths are relative to the rig file: returns the rig with paths relative to another file. Symbolic links
/// are resolved; neither file has to exist.
Rig with_masks_moved(Rig rig, const std::string& from_file, const std::string& to_file);

/// Code `input` if the file or folder does not exist; of "LEFT,RIGHT" both must exist.
Status calibration_is_there(const std::string& path);

}  // namespace spartan::program
