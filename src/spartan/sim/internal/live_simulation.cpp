#include "spartan/sim/internal/live_simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
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
      info_(info_of(request_->scenario, simulator_.nominal())),
      start_stamp_(stamp_at(0)),
      newest_(start_stamp_) {
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

bool LiveSimulation::is_on_mast(const std::string& pair) const {
  return request_->rig.find_camera(request_->rig.find_pair(pair)->left)->mount != "body";
}

PanTiltControl* LiveSimulation::pan_tilt() {
  const std::vector<StereoPair>& pairs = request_->rig.pairs;
  const bool moves = std::any_of(pairs.begin(), pairs.end(), [&](const StereoPair& p) { return is_on_mast(p.name); });
  return moves ? this : nullptr;
}

// With the lock. While an image is rendered, the rover's time stands still.
Stamp LiveSimulation::now() const {
  if (!start_) return start_stamp_;
  if (speed_ == 0) return newest_;
  const std::chrono::duration<double> passed = still_since_.value_or(Clock::now()) - *start_;
  return stamp_at(seconds_between(stamp_at(0), start_stamp_) + passed.count() * speed_);
}

// With the lock, after a command.
PanTiltAngles LiveSimulation::angles_at(Stamp stamp) const {
  const double most = kPanTiltRate_rad_s * std::max(0.0, seconds_between(motion_->begin, stamp));
  const auto moved = [&](double from, double to) { return from + std::clamp(to - from, -most, most); };
  return {moved(motion_->from.pan_rad, motion_->to.pan_rad), moved(motion_->from.tilt_rad, motion_->to.tilt_rad)};
}

Status LiveSimulation::trigger(const std::string& pair) {
  if (request_->rig.find_pair(pair) == nullptr)
    return failure(ErrorCode::configuration, "has no pair '" + pair + "'", info_.path);
  const std::lock_guard lock(mutex_);
  triggers_.push_back({pair, now()});
  return {};
}

Status LiveSimulation::move_to(const PanTiltAngles& angles) {
  constexpr double kMostPan_rad = std::numbers::pi, kMostTilt_rad = std::numbers::pi / 2;
  if (request_->rig.pan_tilt_units.empty()) return failure(ErrorCode::input, "has no pan-tilt unit", info_.path);
  if (!(std::abs(angles.pan_rad) <= kMostPan_rad && std::abs(angles.tilt_rad) <= kMostTilt_rad)) {
    return failure(ErrorCode::input, "the angles are beyond the limits of the pan-tilt unit, 180 and 90 deg",
                   info_.path);
  }
  const std::lock_guard lock(mutex_);
  const PanTiltUnit& unit = request_->rig.pan_tilt_units.front();
  const PanTiltAngles from = motion_ ? angles_at(now()) : PanTiltAngles{unit.rest_pan_rad, unit.rest_tilt_rad};
  motion_ = Motion{from, angles, now()};
  return {};
}

Result<PanTiltReading> LiveSimulation::read() {
  const std::lock_guard lock(mutex_);
  if (!motion_) {
    if (request_->rig.pan_tilt_units.empty()) return PanTiltReading();
    const PanTiltUnit& unit = request_->rig.pan_tilt_units.front();
    return PanTiltReading{{unit.rest_pan_rad, unit.rest_tilt_rad}, false};
  }
  const PanTiltAngles angles = angles_at(now());
  return PanTiltReading{angles, angles.pan_rad != motion_->to.pan_rad || angles.tilt_rad != motion_->to.tilt_rad};
}

void LiveSimulation::set_angles(const PanTiltAngles& angles) {
  const std::lock_guard lock(mutex_);
  motion_ = Motion{angles, angles, now()};
}

FrameCommands LiveSimulation::commands_for(const std::string& pair, double time_s) {
  const std::lock_guard lock(mutex_);
  FrameCommands commands;
  if (const auto found = exposures_.find(pair); found != exposures_.end()) commands.exposure = found->second;
  if (motion_ && is_on_mast(pair)) commands.angles = angles_at(stamp_at(time_s));
  return commands;
}

void LiveSimulation::begin() {
  const std::lock_guard lock(mutex_);
  start_ = Clock::now();
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
  {
    const std::lock_guard lock(mutex_);
    consider(!triggers_.empty(), EventKind::trigger, [&] { return triggers_.front().stamp; });
  }
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

void LiveSimulation::expose_planned() {
  const std::size_t i = frame_++;
  const PlannedFrame& planned = request_->drive.frames()[i];
  const FrameFaultState fault = simulator_.fault_at(i);
  const FrameCommands commands = commands_for(planned.pair, planned.time_s);
  const bool waits_for_trigger = commands.angles && !request_->rig.find_pair(planned.pair)->for_odometry;
  if (!fault.dropped && !waits_for_trigger) expose(i, fault, commands);
}

void LiveSimulation::expose_triggered() {
  Trigger trigger;
  {
    const std::lock_guard lock(mutex_);
    trigger = triggers_.front();
    triggers_.pop_front();
  }
  const double time_s = seconds_between(stamp_at(0), trigger.stamp);
  FrameCommands commands = commands_for(trigger.pair, time_s);
  const std::vector<PlannedFrame>& frames = request_->drive.frames();
  commands.trigger = FrameCommands::Trigger{trigger.pair, time_s, frames.size() + triggered_number_++};
  const std::size_t before = frame_ == 0 ? 0 : frame_ - 1;
  expose(before,
         fault_state(request_->scenario.camera_faults, trigger.pair, time_s, commands.trigger->number,
                     static_cast<std::uint64_t>(request_->scenario.seed)),
         commands);
}

void LiveSimulation::expose(std::size_t frame, const FrameFaultState& fault, const FrameCommands& commands) {
  const auto begin = Clock::now();
  {
    const std::lock_guard lock(mutex_);
    still_since_ = begin;
  }
  Arrival arrival;
  arrival.frame = simulator_.render(frame, fault, commands).frame;
  {
    const std::lock_guard lock(mutex_);
    *start_ += Clock::now() - begin;
    still_since_.reset();
  }
  const auto number = static_cast<std::size_t>(arrival.frame.frame_id);
  arrival.stamp = stamp_at(seconds_between(stamp_at(0), arrival.frame.left_stamp) +
                           delay_s(request_->scenario.arrival, request_->scenario.seed, number));
  // In order within each pair.
  for (const Arrival& before : arrivals_) {
    if (before.frame.pair == arrival.frame.pair) arrival.stamp = std::max(arrival.stamp, before.stamp);
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
    {
      const std::lock_guard lock(mutex_);
      newest_ = std::max(newest_, event.stamp);
    }
    if (event.kind == EventKind::exposure || event.kind == EventKind::trigger) {
      event.kind == EventKind::exposure ? expose_planned() : expose_triggered();
      continue;
    }
    read.state = StreamRead::State::sample;
    read.sample = take(event.kind);
    read.arrived = Clock::now();
    return read;
  }
}

}  // namespace spartan::sim::internal
