#include "spartan/system/internal/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "spartan/core/time.h"
#include "spartan/core/trajectory.h"
#include "spartan/system/internal/wheel_slip.h"
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

Json stages(const std::vector<FrameRecord>& frames, const std::vector<StageTime>& commits) {
  struct Series {
    std::vector<double> wall, cpu;
  };
  std::vector<std::string> order;
  std::map<std::string, Series> series;
  const auto add = [&](const std::vector<StageTime>& times) {
    for (const StageTime& time : times) {
      if (!series.contains(time.stage)) order.push_back(time.stage);
      series[time.stage].wall.push_back(time.wall_ms);
      series[time.stage].cpu.push_back(time.cpu_ms);
    }
  };
  for (const FrameRecord& frame : frames) add(frame.times);
  add(commits);
  Json json = Json::object();
  for (const std::string& stage : order) {
    const Series& s = series[stage];
    json[stage] = {{"count", s.wall.size()}, {"wall_ms", distribution(s.wall)}, {"cpu_ms", distribution(s.cpu)}};
  }
  return json;
}

Json latency(const std::vector<float>& values_ms) {
  const std::vector<double> values(values_ms.begin(), values_ms.end());
  return {{"count", values.size()},
          {"median", percentile(values, 0.5)},
          {"p99", percentile(values, 0.99)},
          {"max", percentile(values, 1)}};
}

// Null where the stream was not recorded.
Json recording(const std::optional<RecorderProgress>& progress) {
  if (!progress) return nullptr;
  return {{"frames", progress->frames},
          {"sensor_samples", progress->sensor_samples},
          {"dropped", progress->dropped},
          {"rejected", progress->rejected},
          {"error", progress->status ? Json(nullptr) : Json(progress->status.error().message())}};
}

// Null where the cameras are not controlled.
Json exposure(const std::optional<ExposureStatistics>& statistics) {
  if (!statistics) return nullptr;
  return {{"frames", statistics->frames},
          {"changes", statistics->changes},
          {"saturated_frames", statistics->saturated_frames},
          {"dark_frames", statistics->dark_frames}};
}

Json camera(const CameraReport& report) {
  return {{"camera", report.camera},
          {"images", report.images},
          {"incomplete", report.incomplete},
          {"not_received", report.not_received},
          {"duplicates", report.duplicates},
          {"reversed", report.reversed},
          {"wrong_stamps", report.wrong_stamps},
          {"triggers", report.triggers},
          {"unanswered", report.unanswered},
          {"untriggered", report.untriggered},
          {"losses", report.losses},
          {"clock_sigma_ms", report.clock_sigma_ms},
          {"clock_rate_ppm", report.clock_rate_ppm}};
}

Json camera_pairs(const std::vector<CameraPairReport>& reports) {
  Json pairs = Json::array();
  for (const CameraPairReport& report : reports) {
    Json cameras = Json::array();
    for (const CameraReport& one : report.cameras) cameras.push_back(camera(one));
    pairs.push_back({{"pair", report.pair},
                     {"frames", report.pairs},
                     {"left_alone", report.left_alone},
                     {"right_alone", report.right_alone},
                     {"incomplete", report.incomplete},
                     {"apart", report.apart},
                     {"wrong_size", report.wrong_size},
                     {"stamps_reversed", report.stamps_reversed},
                     {"not_taken", report.not_taken},
                     {"mean_skew_ms", report.mean_skew_ms},
                     {"largest_skew_ms", report.largest_skew_ms},
                     {"cameras", cameras}});
  }
  return pairs;
}

// Null of a recording.
Json live(const std::optional<LiveFacts>& facts) {
  if (!facts) return nullptr;
  return {{"latency_ms", latency(facts->latencies.all_ms)},
          {"latency_at_stops_ms", latency(facts->latencies.at_stops_ms)},
          {"map_after_stop_ms", latency(facts->latencies.maps_ms)},
          {"dropped",
           {{"odometry", facts->dropped.odometry},
            {"views", facts->dropped.views},
            {"sensor_samples", facts->dropped.sensor_samples}}},
          {"queue_peak_bytes", facts->queue_peak_bytes},
          {"files_discarded", facts->files_discarded},
          {"recording", recording(facts->recording)},
          {"exposure", exposure(facts->exposure)},
          {"cameras", camera_pairs(facts->cameras)}};
}

// Consecutive frames without a pose.
struct GapWithoutPose {
  int frames = 0;
  Stamp from;  // of the last pose before it
  const FrameRecord* first_lost = nullptr;
  const FrameRecord* first = nullptr;

  void add(const FrameRecord& frame, Stamp last_pose) {
    if (frames++ == 0) {
      from = last_pose;
      first = &frame;
    }
    if (first_lost == nullptr && frame.status == name_of(TrackingStatus::lost)) first_lost = &frame;
  }

  // Why the rover counts as lost in the gap that ends at `to`; none if it does not.
  std::optional<std::string> reason_of_loss(Stamp to) const {
    if (first_lost != nullptr) return first_lost->message;
    const double seconds = seconds_between(from, to);
    if (frames < kFewestSkippedFrames || seconds <= kLongestSkippedSpan_s) return std::nullopt;
    return fmt::format("{} frames skipped in {:.1f} s, the first: {}", frames, seconds, first->fault);
  }
};

// Null without wheels.
Json wheel_slip(const std::vector<FrameRecord>& frames, double limit) {
  const auto slip = wheel_slip_of(frames, limit);
  if (!slip) return nullptr;
  Json alarms = Json::array();
  for (const SlipAlarm& alarm : slip->alarms)
    alarms.push_back({{"from_ns", alarm.from.ns}, {"to_ns", alarm.to.ns}, {"largest", alarm.largest}});
  return {{"median", slip->median}, {"largest", slip->largest}, {"alarms", alarms}};
}

}  // namespace

std::vector<LostSpan> lost_spans(const std::vector<FrameRecord>& frames) {
  std::vector<LostSpan> spans;
  GapWithoutPose gap;
  std::optional<Stamp> last_pose;
  const auto close = [&](Stamp to) {
    if (const auto reason = gap.reason_of_loss(to)) spans.push_back({gap.from, to, *reason});
    gap = {};
  };
  Stamp last;
  for (const FrameRecord& frame : frames) {
    if (frame.fault == name_of(FrameFault::stamp_reversed)) continue;  // its stamp tells no time
    last = frame.stamp;
    if (!frame.has_pose) {
      gap.add(frame, last_pose.value_or(frame.stamp));
      continue;
    }
    close(frame.stamp);
    last_pose = frame.stamp;
  }
  close(last);
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
        {"gravity", facts.level_by_ground    ? "ground"
                    : facts.gravity_measured ? "measured"
                                             : "assumed"}}},
      {"frames", processed},
      {"skipped", skipped},
      {"predicted_frames", predicted},
      {"skipped_sensor_rows", {{"reversed", facts.sensor_rows_reversed}, {"unreadable", facts.sensor_rows_unreadable}}},
      {"distance_m", path_length(trajectory_of(frames, TrajectoryKind::odometry))},
      {"wall_seconds", facts.wall_seconds},
      {"cpu_seconds", facts.cpu_seconds},
      {"peak_memory_bytes", facts.peak_memory_bytes},
      {"threads", facts.threads},
      {"absent", facts.absent},
      {"live", live(facts.live)},
      {"stages", stages(frames, facts.commits)},
      {"health",
       {{"odometry", health}, {"localization", sensors}, {"wheel_slip", wheel_slip(frames, facts.slip_alarm)}}},
      {"lost_spans", spans},
      {"resumed_from_frame", facts.resumed_from_frame ? Json(*facts.resumed_from_frame) : Json(nullptr)},
  };
  // Paths need not be UTF-8: their other bytes are replaced.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace spartan::internal
