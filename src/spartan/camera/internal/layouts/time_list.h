// Lists of frame times in text files.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/core/time.h"

namespace spartan::internal {

struct TimeRow {
  Stamp stamp;
  std::vector<std::string> names;  ///< of image files; may be empty
};

struct TimeList {
  std::vector<TimeRow> rows;
  std::string unit;  ///< "nanoseconds" …
};

/// Reads rows of a time and, optionally, file names, separated by commas, semicolons or blanks: the first number of a
/// row is the time, fields that are not numbers are names. Times with a decimal point are seconds; the unit of integers
/// follows from their values (stamp_unit(), else seconds). A first row without a number is a header. Code `input` for a
/// row without a time, with file and line.
Result<TimeList> read_time_list(const std::string& path);

}  // namespace spartan::internal
