// The two files of a pair whose format has one for each eye. Internal to rig.
#pragma once

#include <string>

#include "spartan/core/result.h"

namespace spartan::rig_detail {

struct PairOfFiles {
  std::string left, right;
};

/// From "LEFT,RIGHT", or from one of the two: its partner lies beside it and differs by left/right, cam0/cam1, or, at
/// the ends of a word, l/r, L/R, 0/1. Code `configuration` where there is no partner, or more than one.
Result<PairOfFiles> find_pair_of_files(const std::string& path);

/// The names to write: "LEFT,RIGHT" as they are; of "pair.ext" pair_left.ext and pair_right.ext.
PairOfFiles names_of_pair(const std::string& path);

}  // namespace spartan::rig_detail
