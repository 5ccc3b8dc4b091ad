#include "spartan/sim/internal/live_simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <thread>
#include <utility>

#include "spartan/sim/internal/drive/motion_sensors.h"

namespace spartan::sim::internal {
namespace {

StreamInfo info_of(const Scenario& scenario, const Rig& nominal) {
  StreamInfo info;
  info.path = "sim:" + scenario.name;
  info.rig = nominal;
  info.rig_source = "scenario " + scenario.name;
  info.name = scenario.name;
  info.description = scenario.description;
  info.gravity_m_s2 = scenario.gravity_m_s2;
  info.noise = specified_noise(scenario.imu, scenario.compass, scenario.inclinometer);
  return info;
}

// Depends on the frame alone, not on the frames before it.
double delay_s(const ArrivalOptions& options, int seed, std::size_t frame) {
  std::mt19937_64 random(static_cast<std::uint64_t>(seed) * 1000003U + frame);
  return 1e-3 * (options.delay_ms + std::abs(std::normal_distribution<double>(0, 1)(random)) * options.jitter_ms);
}

template <class Samples>
std::size_t first_after(const Samples& samples, Stamp stamp) {
  const auto found = std::find_if(samples.begin(), samples.end(), [&](const auto& s) { return s.stamp > stamp; });
  return static_cast<std::size_t>(found - samples.begin());
}

}  // namespace

LiveSimulation::LiveSimulation(SimulationRequest request, double speed, const ThreadPool& workers)
    : request_(std::make_unique<const SimulationRequest>(std::move(request))),
      speed_(speed),
      workers_(workers),
      simulator_(*request_, workers_),
      info_(info_of(request_->scenario, simulator_.nominal())) {
  const Scenario& scenario = request_->scenario;
  const auto seed = static_cast<std::uint64_t>(scenario.seed);
  const SensorFaults& faults = scenario.sensor_faults;
  const BodyMotion& motion = simulator_.motion();
  imu_ = measure_imu(motion, scenario.imu, scenario.gravity_m_s2, faults, seed);
  wheels_ = measure_wheels(motion, scenario.chassis, scenario.wheels, faults, seed);
  compass_ = measure_compass(motion, scenario.compass, faults, seed);
  inclinometer_ = measure_inclinometer(motion, scenario.inclinometer, faults, seed);
  info_.has_imu = !imu_.empty();
}

std::optional<std::size_t> LiveSimulation::first_frame(const std::string& pair) const {
  const std::vector<PlannedFrame>& frames = request_->drive.frames();
  const auto found = std::find_if(frames.begin(), frames.end(), [&](const PlannedFrame& f) { return f.pair == pair; });
  if (found == frames.end()) return std::nullopt;
  return static_cast<std::size_t>(found - frames.begin());
}

Result<StereoFrame> LiveSimulation::preview(const std::string& pair, std::size_t index) {
  const auto first = first_frame(pair);
  if (!first || index > 0)
    return failure(ErrorCode::input, fmt::format("pair '{}' has no preview {}", pair, index), info_.path);
  return simulator_.render(*first, {}).frame;
}

Status LiveSimulation::set_exposure(const std::string& pair, const ExposureSettings& settings) {
  if (request_->rig.find_pair(pair) == nullptr)
    return failure(ErrorCode::input, "has no pair '" + pair + "'", info_.path);
  if (!(settings.exposure_us > 0) || !(settings.gain >= 1)) {
    return failure(ErrorCode::input,
                   fmt::format("exposure {} us and gain {} are not possible", settings.exposure_us, settings.gain),
                   info_.path);
  }
  const std::lock_guard lock(mutex_);
  exposures_[pair] = {1e-6 * settings.exposure_us, settings.gain};
  return {};
}

void LiveSimulation::set_angles(const PlannedAngles& angles) {
  const std::lock_guard lock(mutex_);
  angles_ = angles;
}

FrameCommands LiveSimulation::commands_for(const std::string& pair) {
  const std::lock_guard lock(mutex_);
  FrameCommands commands;
  if (const auto found = exposures_.find(pair); found != exposures_.end()) commands.exposure = found->second;
  const bool moves = request_->rig.find_camera(request_->rig.find_pair(pair)->left)->mount != "body";
  if (moves) commands.angles = angles_;
  return commands;
}

void LiveSimulation::begin() {
  start_ = Clock::now();
  start_stamp_ = stamp_at(0);
  if (!start_after_) return;
  start_stamp_ = std::max(start_stamp_, *start_after_);
  imu_index_ = first_after(imu_, *start_after_);
  wheel_index_ = first_after(wheels_, *start_after_);
  compass_index_ = first_after(compass_, *start_after_);
  inclinometer_index_ = first_after(inclinometer_, *start_after_);
  const std::vector<PlannedFrame>& frames = request_->drive.frames();
  while (frame_ < frames.size() && stamp_at(frames[frame_].time_s) <= *start_after_) ++frame_;
}

// Of events at the same time, an exposure comes first.
LiveSimulation::Event LiveSimulation::next_event() const {
  Event next;
  const auto consider = [&](bool is_there, EventKind kind, auto stamp) {
    if (!is_there) return;
    const Event event{stamp(), kind};
    if (next.kind == EventKind::none || event.stamp < next.stamp) next = event;
  };
  const std::vector<PlannedFrame>& frames = request_->drive.frames();
  consider(frame_ < frames.size(), EventKind::exposure, [&] { return stamp_at(frames[frame_].time_s); });
  consider(!arrivals_.empty(), EventKind::arrival, [&] { return arrivals_.front().stamp; });
  consider(imu_index_ < imu_.size(), EventKind::imu, [&] { return imu_[imu_index_].stamp; });
  consider(wheel_index_ < wheels_.size(), EventKind::wheels, [&] { return wheels_[wheel_index_].stamp; });
  consider(compass_index_ < compass_.size(), EventKind::compass, [&] { return compass_[compass_index_].stamp; });
  consider(inclinometer_index_ < inclinometer_.size(), EventKind::inclinometer,
           [&] { return inclinometer_[inclinometer_index_].stamp; });
  return next;
}

// False: not before `until`.
bool LiveSimulation::wait_for(Stamp stamp, Clock::time_point until) {
  if (speed_ == 0) return true;
  const std::chrono::duration<double> after(seconds_between(start_stamp_, stamp) / speed_);
  const auto due = *start_ + std::chrono::duration_cast<Clock::duration>(after);
  std::this_thread::sleep_until(std::min(due, until));
  return due <= until;
}

void LiveSimulation::expose() {
  const std::size_t i = frame_++;
  const PlannedFrame& planned = request_->drive.frames()[i];
  const FrameFaultState fault = simulator_.fault_at(i);
  if (fault.dropped) return;
  const auto begin = Clock::now();
  Arrival arrival;
  arrival.frame = simulator_.render(i, fault, commands_for(planned.pair)).frame;
  *start_ += Clock::now() - begin;  // the rover's time stands still
  arrival.stamp = stamp_at(planned.time_s + delay_s(request_->scenario.arrival, request_->scenario.seed, i));
  // In order within each pair.
  for (const Arrival& before : arrivals_) {
    if (before.frame.pair == planned.pair) arrival.stamp = std::max(arrival.stamp, before.stamp);
  }
  const auto later = std::find_if(arrivals_.begin(), arrivals_.end(),
                                  [&](const Arrival& other) { return other.stamp > arrival.stamp; });
  arrivals_.insert(later, std::move(arrival));
}

Sample LiveSimulation::take(EventKind kind) {
  switch (kind) {
    case EventKind::imu:
      return imu_[imu_index_++];
    case EventKind::wheels:
      return wheels_[wheel_index_++];
    case EventKind::compass:
      return compass_[compass_index_++];
    case EventKind::inclinometer:
      return inclinometer_[inclinometer_index_++];
    default:
      break;
  }
  StereoFrame frame = std::move(arrivals_.front().frame);
  arrivals_.pop_front();
  return frame;
}

Result<StreamRead> LiveSimulation::read(std::chrono::nanoseconds timeout) {
  if (!start_) begin();
  const auto until = Clock::now() + timeout;
  for (;;) {
    const Event event = next_event();
    StreamRead read;
    if (event.kind == EventKind::none) return read;
    read.state = StreamRead::State::none_yet;
    if (!wait_for(event.stamp, until)) return read;
    if (event.kind == EventKind::exposure) {
      expose();
      continue;
    }
    read.state = StreamRead::State::sample;
    read.sample = take(event.kind);
    read.arrived = Clock::now();
    return read;
  }
}

}  // namespace spartan::sim::internal
