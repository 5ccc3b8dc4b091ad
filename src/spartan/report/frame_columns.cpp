
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "spartan/report/report.h"
#include "spartan/system/run_folder.h"

namespace spartan {
namespace {

using Json = nlohmann::json;

double rounded(double value, double unit) {
  return std::round(value / unit) * unit;
}

Json position(const std::optional<UncertainPose>& pose) {
  if (!pose) return nullptr;
  const Eigen::Vector3d& t = pose->pose.translation();
  return {rounded(t.x(), 1e-4), rounded(t.y(), 1e-4), rounded(t.z(), 1e-4)};
}

std::optional<UncertainPose> best_pose(const FrameRecord& frame) {
  for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
    if (auto pose = pose_of(frame, kind)) return pose;
  }
  return std::nullopt;
}

// The covariance of the right perturbation is along the axes of the body.
Eigen::Matrix3d world_covariance(const UncertainPose& pose) {
  const Eigen::Matrix3d turn = pose.pose.rotation_matrix();
  return turn * pose.covariance.topLeftCorner<3, 3>() * turn.transpose();
}

void add_best(const FrameRecord& frame, Json& columns) {
  const auto best = best_pose(frame);
  if (!best) {
    for (const char* name : {"pose", "sigma_m", "ellipse_m2"}) columns[name].push_back(nullptr);
    return;
  }
  Json pose = position(best);
  const Eigen::Quaterniond& q = best->pose.rotation();
  for (const double part : {q.x(), q.y(), q.z(), q.w()}) pose.push_back(rounded(part, 1e-6));
  columns["pose"].push_back(pose);
  const Eigen::Matrix3d covariance = world_covariance(*best);
  Json sigma = Json::array();
  for (int i = 0; i < 3; ++i) sigma.push_back(std::sqrt(std::max(0.0, covariance(i, i))));
  columns["sigma_m"].push_back(sigma);
  columns["ellipse_m2"].push_back({covariance(0, 0), covariance(0, 1), covariance(1, 1)});
}

// Of one frame; stages that the frame did not have are null, stages that are new begin with nulls.
void add_named(Json& table, const std::string& name, const Json& value, std::size_t frame) {
  Json& column = table[name];
  if (column.is_null()) column = Json::array();
  while (column.size() < frame) column.push_back(nullptr);
  if (column.size() == frame) column.push_back(value);
}

void fill_up(Json& table, std::size_t frames) {
  for (auto& [name, column] : table.items()) {
    while (column.size() < frames) column.push_back(nullptr);
  }
}

}  // namespace

struct FrameColumns::State {
  State(std::size_t from, Stamp start_in);
  Json columns;
  Stamp start;
  std::size_t frames = 0;  // that were added

  void add_localization(const LocalizationRecord& localization);
};

void FrameColumns::State::add_localization(const LocalizationRecord& localization) {
  constexpr double kMost = 1e6;  // the quotient of a singular covariance has no meaning
  for (const LocalizationRecord::Sensor& sensor : localization.sensors) {
    add_named(columns["sensors"], sensor.name, sensor.state, frames);
    if (!sensor.test) continue;
    const double quotient = std::min(sensor.test->nis / sensor.test->gate, kMost);
    add_named(columns["innovations"], sensor.name, rounded(quotient, 1e-4), frames);
  }
}

FrameColumns::State::State(std::size_t from, Stamp start_in) : start(start_in) {
  columns = {{"from", from}, {"stages", Json::object()}, {"sensors", Json::object()}, {"innovations", Json::object()}};
  for (const char* name : {"t_s", "stamp_ns", "status", "message", "inliers", "matches", "landmarks", "rms_px", "pose",
                           "sigma_m", "ellipse_m2", "latency_ms", "odometry", "slam", "localization", "smoothed"})
    columns[name] = Json::array();
}

FrameColumns::FrameColumns(std::size_t from, Stamp start) : state_(std::make_unique<State>(from, start)) {}
FrameColumns::FrameColumns(FrameColumns&&) noexcept = default;
FrameColumns& FrameColumns::operator=(FrameColumns&&) noexcept = default;
FrameColumns::~FrameColumns() = default;

void FrameColumns::add(const FrameRecord& frame) {
  Json& columns = state_->columns;
  columns["t_s"].push_back(rounded(seconds_between(state_->start, frame.stamp), 1e-3));
  columns["stamp_ns"].push_back(std::to_string(frame.stamp.ns));
  columns["status"].push_back(frame.status);
  columns["message"].push_back(frame.message);
  columns["inliers"].push_back(frame.motion.inliers);
  columns["matches"].push_back(frame.motion.matches);
  columns["landmarks"].push_back(frame.motion.landmarks);
  columns["rms_px"].push_back(rounded(frame.motion.rms_px, 1e-3));
  columns["latency_ms"].push_back(frame.latency_ms ? Json(rounded(*frame.latency_ms, 1e-3)) : Json(nullptr));
  add_best(frame, columns);
  for (const TrajectoryKind kind : kTrajectories)
    columns[std::string(name_of(kind))].push_back(position(pose_of(frame, kind)));
  for (const StageTime& time : frame.times) {
    const bool is_part = time.stage.find('.') != std::string::npos;
    if (!is_part) add_named(columns["stages"], time.stage, rounded(time.wall_ms, 1e-3), state_->frames);
  }
  if (frame.localization) state_->add_localization(*frame.localization);
  ++state_->frames;
}

std::string FrameColumns::json() {
  Json& columns = state_->columns;
  columns["total"] = columns["from"].get<std::size_t>() + state_->frames;
  for (const char* table : {"stages", "sensors", "innovations"}) fill_up(columns[table], state_->frames);
  return columns.dump();
}

}  // namespace spartan
