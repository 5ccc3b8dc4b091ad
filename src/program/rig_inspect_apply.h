// `rig inspect --apply`: the rig with what was found put right.
#pragma once

#include <string>
#include <vector>

#include "program/inspected_pair.h"
#include "spartan/core/result.h"
#include "spartan/rig/formats/rig_files.h"

namespace spartan::program {

/// Writes it and says in words, a sentence each, what kind of rig the file now holds and what is to be known of it.
/// Code `input` where nothing explains the pictures of a pair: then there is nothing to write.
Result<std::vector<std::string>> write_corrected_rig(const ReadRig& read, const std::vector<InspectedPair>& inspected,
                                                     const std::string& path);

}  // namespace spartan::program
