// Tables in which recordings list their frames. Errors have code `input` and name file and line.
#pragma once

#include <string>
#include <vector>

#include "spartan/camera/internal/recording_index.h"
#include "spartan/camera/internal/table.h"

namespace spartan::internal {

/// KITTI odometry, times.txt: one time in seconds per row.
Result<std::vector<Stamp>> read_kitti_times(TableReader table);

/// KITTI raw, timestamps.txt: one UTC date and time per row, e.g. "2011-09-26 13:02:25.964389445". Stamps count from
/// 1970.
Result<std::vector<Stamp>> read_kitti_raw_times(TableReader table);
/// Table format of timestamps.txt.
inline TableFormat kitti_raw_times_format() {
  return {.separator = ' ', .header = {}, .ends_with_newline = false};
}

/// Images of one camera.
struct EurocImages {
  std::vector<Stamp> stamps;
  std::vector<std::string> files;  ///< names as in the table
};
/// EuRoC, data.csv: a time in nanoseconds and a file name per row.
Result<EurocImages> read_euroc_images(TableReader table);

/// Spartan, frames.csv (docs/reference/recording.md). `folder` is prepended to the image paths; an empty field stays
/// empty. `unfinished`: the frames before the first row that cannot be parsed, where the writing of the table has
/// ended.
Result<std::vector<FrameEntry>> read_spartan_frames(TableReader table, const std::string& folder, const Rig& rig,
                                                    bool unfinished = false);
/// Table format of frames.csv.
TableFormat spartan_frames_format();

}  // namespace spartan::internal
