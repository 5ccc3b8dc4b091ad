// The tables by which recordings announce their shots. Errors have code `input` and name file and line.
#pragma once

#include <string>
#include <vector>

#include "spartan/camera/recording_index.h"
#include "spartan/camera/table.h"

namespace spartan {

/// KITTI odometry, times.txt: a time in seconds in each row.
Result<std::vector<Stamp>> read_kitti_times(TableReader table);

/// KITTI raw, timestamps.txt: "2011-09-26 13:02:25.964389445" in each row, taken as nanoseconds since 1970.
Result<std::vector<Stamp>> read_kitti_raw_times(TableReader table);
/// The format of that table.
inline TableFormat kitti_raw_times_format() {
  return {.separator = ' ', .header = {}, .ends_with_newline = false};
}

/// The images of one eye.
struct EurocImages {
  std::vector<Stamp> stamps;
  std::vector<std::string> files;  ///< as the table names them
};
/// EuRoC, data.csv: a time in nanoseconds and a file name in each row.
Result<EurocImages> read_euroc_images(TableReader table);

/// Spartan, frames.csv (docs/formats.md). Paths are below `folder`; an empty field stays empty.
Result<std::vector<Shot>> read_spartan_shots(TableReader table, const std::string& folder, const Rig& rig);
/// The format of that table.
TableFormat spartan_shots_format();

}  // namespace spartan
