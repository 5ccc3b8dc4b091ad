#include "spartan/system/internal/summary.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "spartan/core/trajectory.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {
namespace {

using Json = nlohmann::ordered_json;

// Nearest-rank percentile; `fraction` in 0 … 1. The values need not be sorted.
double percentile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(std::ceil(fraction * static_cast<double>(values.size())));
  return values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
}

Json distribution(const std::vector<double>& values) {
  double total = 0;
  for (const double value : values) total += value;
  return {{"median", percentile(values, 0.5)}, {"p95", percentile(values, 0.95)}, {"total", total}};
}

Json stages(const std::vector<FrameRecord>& frames) {
  struct Series {
    std::vector<double> wall, cpu;
  };
  std::vector<std::string> order;
  std::map<std::string, Series> series;
  for (const FrameRecord& frame : frames) {
    for (const StageTime& time : frame.times) {
      if (!series.contains(time.stage)) order.push_back(time.stage);
      series[time.stage].wall.push_back(time.wall_ms);
      series[time.stage].cpu.push_back(time.cpu_ms);
    }
  }
  Json json = Json::object();
  for (const std::string& stage : order) {
    const Series& s = series[stage];
    json[stage] = {{"count", s.wall.size()}, {"wall_ms", distribution(s.wall)}, {"cpu_ms", distribution(s.cpu)}};
  }
  return json;
}

bool is_lost(const FrameRecord& frame) {
  return frame.status == name_of(TrackingStatus::lost);
}

}  // namespace

std::vector<LostSpan> lost_spans(const std::vector<FrameRecord>& frames) {
  std::vector<LostSpan> spans;
  bool open = false;
  std::optional<Stamp> last_pose;
  for (const FrameRecord& frame : frames) {
    if (is_lost(frame) && !open) {
      spans.push_back({last_pose.value_or(frame.stamp), frame.stamp, frame.message});
      open = true;
    } else if (open && frame.status != "missing") {
      spans.back().to = frame.stamp;
      open = is_lost(frame);
    }
    if (frame.has_pose) last_pose = frame.stamp;
  }
  return spans;
}

std::string to_summary_json(const RunFacts& facts, const std::vector<FrameRecord>& frames) {
  std::map<std::string, int> skipped;
  std::map<std::string, int> health{{"tracking", 0}, {"degraded", 0}, {"lost", 0}, {"standing", 0}};
  int processed = 0;
  Json predicted = Json::array();
  for (const FrameRecord& frame : frames) {
    if (frame.status == "missing") {
      ++skipped[frame.fault];
    } else {
      ++processed;
      ++health[frame.status];
    }
    if (!frame.has_pose) predicted.push_back(frame.frame_id);
  }
  // Number of frames per state of each sensor of the localization.
  Json sensors = Json::object();
  for (const FrameRecord& frame : frames) {
    if (!frame.localization) continue;
    for (const LocalizationRecord::Sensor& sensor : frame.localization->sensors) {
      Json& counts = sensors[sensor.name];
      if (counts.is_null()) counts = {{"ok", 0}, {"suspect", 0}, {"excluded", 0}, {"missing", 0}};
      counts[sensor.state] = counts[sensor.state].get<int>() + 1;
    }
  }
  Json spans = Json::array();
  for (const LostSpan& span : lost_spans(frames)) {
    spans.push_back({{"from_ns", span.from.ns}, {"to_ns", span.to.ns}, {"reason", span.reason}});
  }
  const Json json = {
      {"schema", 1},
      {"version", facts.version},
      {"input", facts.input},
      {"format", facts.format},
      {"world",
       {{"heading", facts.heading_east ? "east" : "start"},
        {"gravity", facts.gravity_measured ? "measured" : "assumed"}}},
      {"frames", processed},
      {"skipped", skipped},
      {"predicted_frames", predicted},
      {"distance_m", path_length(trajectory_of(frames, TrajectoryKind::odometry))},
      {"wall_seconds", facts.wall_seconds},
      {"cpu_seconds", facts.cpu_seconds},
      {"peak_memory_bytes", facts.peak_memory_bytes},
      {"threads", facts.threads},
      {"absent", facts.absent},
      {"stages", stages(frames)},
      {"health", {{"odometry", health}, {"localization", sensors}}},
      {"lost_spans", spans},
      {"resumed_from_frame", facts.resumed_from_frame ? Json(*facts.resumed_from_frame) : Json(nullptr)},
  };
  return json.dump(2) + "\n";
}

}  // namespace spartan::internal
