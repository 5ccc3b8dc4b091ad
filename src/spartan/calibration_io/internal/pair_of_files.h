// The two files of a stereo pair in formats with one file per camera. Internal to calibration_io.
#pragma once

#include <string>

#include "spartan/core/result.h"

namespace spartan::internal {

struct PairOfFiles {
  std::string left, right;
};

/// From "LEFT,RIGHT", or from one of the two: the other file is in the same folder and its name differs by left/right,
/// cam0/cam1, or, as separate words, l/r, L/R, 0/1. Code `configuration` if there is no such file or more than one.
Result<PairOfFiles> find_pair_of_files(const std::string& path);

/// The paths to write: "LEFT,RIGHT" unchanged; for "pair.ext", pair_left.ext and pair_right.ext.
PairOfFiles names_of_pair(const std::string& path);

}  // namespace spartan::internal
