// `rig inspect --apply`: writes the corrected rig.
#pragma once

#include <string>
#include <vector>

#include "program/inspected_pair.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/result.h"

namespace spartan::program {

/// Writes the rig and returns sentences: first what the file holds (the corrected rig, or the given one), then notes.
/// Code `input` if no hypothesis explains the images of a pair; then nothing is written.
Result<std::vector<std::string>> write_corrected_rig(const LoadedRig& read, const std::vector<InspectedPair>& inspected,
                                                     const std::string& path);

}  // namespace spartan::program
