// `spartan rig convert`, and what the verbs of `rig` share.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "program/context.h"
#include "spartan/rig/rig.h"

namespace spartan::program {

void add_rig_convert(CLI::App& rig, Context& context);

/// A self-mask's path counts from its rig file: the rig with masks that are found from another file too. Folders that
/// are links are looked through; neither file needs to be there.
Rig with_masks_moved(Rig rig, const std::string& from_file, const std::string& to_file);

/// Code `input` where there is no such file or folder; of "LEFT,RIGHT" both have to be there.
Status calibration_is_there(const std::string& path);

}  // namespace spartan::program
