// What a run has to say about itself: summary.json (docs/formats.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/time.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// What only the running program knows.
struct RunFacts {
  std::string version;
  std::string input;
  std::string format;
  bool gravity_measured = false;
  bool heading_east = false;
  int threads = 1;
  std::vector<std::string> absent;           ///< what the options leave out of the run
  double wall_seconds = 0, cpu_seconds = 0;  ///< of this call of the program
  std::int64_t peak_memory_bytes = 0;
  std::optional<std::int64_t> resumed_from_frame;  ///< frame_id of the first frame that was processed after --resume
};

/// A stretch of time without a measured pose.
struct LostSpan {
  Stamp from, to;
  std::string reason;
};

/// Spans between the last pose before and the first pose after each loss (or the end of the drive).
std::vector<LostSpan> lost_spans(const std::vector<FrameRecord>& frames);

/// The text of summary.json.
std::string to_summary_json(const RunFacts& facts, const std::vector<FrameRecord>& frames);

}  // namespace spartan
