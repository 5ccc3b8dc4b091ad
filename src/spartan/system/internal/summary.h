// Summary of a run: summary.json (docs/reference/json.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/recording_writer.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/time.h"
#include "spartan/system/internal/exposure_stage.h"
#include "spartan/system/internal/latency_record.h"
#include "spartan/system/internal/sample_queue.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// What only a live run has.
struct LiveFacts {
  LatencyRecord latencies;
  DroppedFrames dropped;
  std::size_t queue_peak_bytes = 0;
  std::int64_t files_discarded = 0;              ///< terrain views and maps whose files the disk was too slow for
  std::optional<RecorderProgress> recording;     ///< of the stream, if it was recorded
  std::optional<ExposureStatistics> exposure{};  ///< of cameras that are controlled
  std::vector<CameraPairReport> cameras{};       ///< of cameras that run now
};

/// Facts about a run that are not in its store.
struct RunFacts {
  std::string version;
  std::string input;
  std::string format;
  bool gravity_measured = false;
  bool level_by_ground = false;  ///< not measured by a sensor: z of the world is the normal of the first ground
  bool heading_east = false;
  double slip_alarm = 1;  ///< slip of the wheels beyond which there is an alarm
  int threads = 1;
  std::vector<std::string> absent;           ///< stages that the options disable
  double wall_seconds = 0, cpu_seconds = 0;  ///< of the whole run
  std::int64_t peak_memory_bytes = 0;
  /// Rows of sensor tables that were discarded: stamps that do not increase, and rows that cannot be parsed.
  std::int64_t sensor_rows_reversed = 0, sensor_rows_unreadable = 0;
  std::vector<StageTime> commits;  ///< of this execution
  std::optional<LiveFacts> live;
  std::optional<std::int64_t> resumed_from_frame;  ///< frame_id of the first frame processed after --resume
};

/// Skipped frames in a row count as a loss if they are at least this many and leave the rover without a pose for longer
/// than this. Fewer or shorter ones are bridged by the odometry.
constexpr int kFewestSkippedFrames = 3;
constexpr double kLongestSkippedSpan_s = 2;

/// An interval in which the odometry was lost or had no frames.
struct LostSpan {
  Stamp from, to;
  std::string reason;
};

/// The interval of each loss, from the last pose before it to the first pose after it (or the end of the run). Frames
/// with reversed stamps do not count.
std::vector<LostSpan> lost_spans(const std::vector<FrameRecord>& frames);

/// The content of summary.json.
std::string to_summary_json(const RunFacts& facts, const std::vector<FrameRecord>& frames);

}  // namespace spartan::internal
