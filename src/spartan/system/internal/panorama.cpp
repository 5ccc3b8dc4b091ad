#include "spartan/system/internal/panorama.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

namespace spartan::internal {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::chrono::milliseconds kPoll{20};
constexpr std::chrono::milliseconds kRetry{200};  // of a return to rest

const char* reason_of(StationaryCheck::State state) {
  switch (state) {
    case StationaryCheck::State::unknown:
      return "neither frames nor wheels show whether it is stationary";
    case StationaryCheck::State::moves:
      return "frames or wheels show that it moves";
    default:
      return "the gyroscope shows that it moves";
  }
}

}  // namespace

Result<std::unique_ptr<Panorama>> Panorama::create(const Rig& rig, const std::string& odometry_pair,
                                                   const PanoramaOptions& options, PanTiltControl& unit,
                                                   CameraControl* cameras, const RunHooks& hooks) {
  std::unique_ptr<Panorama> panorama(new Panorama(rig, odometry_pair, options, unit, cameras, hooks));
  if (panorama->pairs_.empty()) {
    return failure(ErrorCode::configuration,
                   "has no stereo pair besides the odometry's on a pan-tilt unit, which a panorama needs", rig.name,
                   "set mount of its cameras, or omit --panorama-every and --control");
  }
  return panorama;
}

Panorama::Panorama(const Rig& rig, const std::string& odometry_pair, const PanoramaOptions& options,
                   PanTiltControl& unit, CameraControl* cameras, const RunHooks& hooks)
    : options_(options), unit_(unit), cameras_(cameras), hooks_(hooks) {
  if (rig.pan_tilt_units.empty()) return;
  const PanTiltUnit& mast = rig.pan_tilt_units.front();
  rest_ = {mast.rest_pan_rad, mast.rest_tilt_rad};
  for (const StereoPair& pair : rig.pairs) {
    if (rig.find_camera(pair.left)->mount != mast.name) continue;
    if (pair.name == odometry_pair) {
      odometry_pair_ = odometry_pair;
    } else {
      pairs_.insert(pair.name);
    }
  }
  if (pairs_.empty()) return;
  const bool rests = is_at_rest();
  untouched_ = rests && !(options_.every_m > 0);
  phase_ = rests ? Phase::idle : Phase::returning;
  thread_ = std::thread([this] { run(); });
}

Panorama::~Panorama() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Panorama::request() {
  const std::lock_guard lock(mutex_);
  requested_ = true;
}

void Panorama::update(Stamp stamp) {
  const std::lock_guard lock(mutex_);
  latest_ = std::max(latest_, stamp);
  if (phase_ != Phase::idle || wanted_) {
    rover_moved_ = rover_moved_ || check_.drives();
    return;
  }
  const bool due = options_.every_m > 0 && distance_m_ >= next_at_m_;
  if (!due && !requested_) return;
  const StationaryCheck::State state = check_.state();
  if (state != StationaryCheck::State::stationary) return explain_waiting(stamp, state);
  waits_since_.reset();
  requested_ = rover_moved_ = explained_ = false;
  next_at_m_ = distance_m_ + options_.every_m;
  wanted_ = true;
  changed_.notify_all();
}

// Once for each panorama. One that is due by distance waits for the next stop, however far that is.
void Panorama::explain_waiting(Stamp stamp, StationaryCheck::State state) {
  if (!waits_since_ || (!requested_ && state == StationaryCheck::State::moves)) waits_since_ = stamp;
  if (explained_ || seconds_between(*waits_since_, stamp) < kPatience_s) return;
  explained_ = true;
  hooks_.log.warning(fmt::format("a panorama has waited for {:.0f} s for the rover to be stationary: {}", kPatience_s,
                                 reason_of(state)));
}

void Panorama::meter(const std::function<void(const StereoFrame&)>& measure) {
  std::map<std::string, StereoFrame> frames;
  {
    const std::lock_guard lock(mutex_);
    metered_ = true;
    frames.swap(unused_);
  }
  for (const auto& [pair, frame] : frames) {
    measure(frame);
    const std::lock_guard lock(mutex_);
    if (frame.position_id == position_id_) unmetered_.erase(pair);
  }
  if (!frames.empty()) changed_.notify_all();
}

bool Panorama::label(StereoFrame& frame) {
  const std::lock_guard lock(mutex_);
  latest_ = std::max(latest_, frame.left_stamp);
  if (untouched_) return true;
  frame.position_id = phase_ == Phase::idle || rover_moved_ ? -1 : position_id_;
  const bool one_image = frame.left.empty() != frame.right.empty();
  if (frame.pair == odometry_pair_) {
    frame.pan_rad = rest_.pan_rad;
    frame.tilt_rad = rest_.tilt_rad;
    if (!one_image && missing_.erase(frame.pair) > 0) changed_.notify_all();
    return phase_ == Phase::idle || phase_ == Phase::beginning;
  }
  if (!pairs_.contains(frame.pair)) return true;
  const PanTiltAngles& angles = phase_ == Phase::idle ? rest_ : angles_;
  frame.pan_rad = angles.pan_rad;
  frame.tilt_rad = angles.tilt_rad;
  const bool is_still = phase_ == Phase::idle || phase_ == Phase::taking;
  if (one_image || !is_still) return false;
  if (phase_ == Phase::idle || unmetered_.contains(frame.pair)) {
    if (metered_) unused_[frame.pair] = frame;
    return false;
  }
  if (missing_.erase(frame.pair) == 0) return false;
  ++views_;
  changed_.notify_all();
  return true;
}

void Panorama::run() {
  return_to_rest();
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return wanted_ || ended_; });
      if (ended_) return;
      wanted_ = false;
      // Larger than that of every panorama before, in this run and in one that it resumes.
      position_id_ = std::max(position_id_ + 1, static_cast<std::int64_t>(std::time(nullptr)));
      phase_ = odometry_pair_.empty() ? Phase::moving : Phase::beginning;
      untouched_ = false;
      views_ = 0;
    }
    report(true);
    if (begin_stop()) take_all();
    return_to_rest();
    report(false);
  }
}

void Panorama::report(bool begins) {
  PanoramaEvent event{begins, position_id_, {}, 0};
  {
    const std::lock_guard lock(mutex_);
    event.stamp = latest_;
    event.views = views_;
  }
  if (!begins) hooks_.log.info(fmt::format("panorama of {} views", event.views));
  if (hooks_.panorama) hooks_.panorama(event);
}

// The pipeline makes no map of views without a frame of the odometry at their stop. Where its pair is on the unit, that
// frame is from before the unit moves.
bool Panorama::begin_stop() {
  if (odometry_pair_.empty()) return true;
  {
    const std::lock_guard lock(mutex_);
    missing_ = {odometry_pair_};
  }
  for (int attempt = 1; attempt <= kAttempts; ++attempt) {
    if (wait_for_frames()) return true;
  }
  hooks_.log.warning(fmt::format("no panorama: pair '{}', which it begins with, has no frame", odometry_pair_));
  return false;
}

void Panorama::take_all() {
  std::vector<double> tilts_deg = options_.tilts_deg;
  if (tilts_deg.empty()) tilts_deg = {rest_.tilt_rad / kDegree};
  for (const double tilt_deg : tilts_deg) {
    for (const double pan_deg : options_.pans_deg) {
      if (look_at({pan_deg * kDegree, tilt_deg * kDegree})) continue;
      const std::lock_guard lock(mutex_);
      if (rover_moved_) hooks_.log.warning("the panorama ends early: the rover moves");
      return;
    }
  }
}

// Whether the unit is at rest now, up to the rounding of its angles.
bool Panorama::is_at_rest() {
  constexpr double kLeast_rad = 1e-9;
  const double most_rad = 2 * unit_.sigma_rad() + kLeast_rad;
  const auto reading = unit_.read();
  return reading && !reading->moves && std::abs(reading->angles.pan_rad - rest_.pan_rad) <= most_rad &&
         std::abs(reading->angles.tilt_rad - rest_.tilt_rad) <= most_rad;
}

// Then the phase is idle. The odometry on the unit would go on with wrong angles, so its return is tried for ever.
void Panorama::return_to_rest() {
  {
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::idle) return;
    phase_ = Phase::returning;
  }
  for (int attempt = 1;; ++attempt) {
    const auto reading = settle(rest_);
    if (reading && !wait(std::chrono::duration<double>(options_.settle_s))) return;
    if (reading || !wait({})) break;
    if (attempt <= kAttempts) hooks_.log.warning("panorama, return to rest: " + reading.error().message());
    const bool gives_up = attempt >= kAttempts || reading.error().code == ErrorCode::input;  // beyond its limits
    if (gives_up && odometry_pair_.empty()) break;
    if (attempt == kAttempts) hooks_.log.error("the odometry waits until the pan-tilt unit has returned to rest");
    if (!wait(kRetry)) break;
  }
  set_phase(Phase::idle);
}

// Waits, unless the panorama ends. Whether it goes on.
bool Panorama::wait(std::chrono::duration<double> time) {
  std::unique_lock lock(mutex_);
  return !changed_.wait_for(lock, time, [this] { return ends(); });
}

void Panorama::set_phase(Phase phase) {
  const std::lock_guard lock(mutex_);
  phase_ = phase;
}

// Until the unit is there and no longer moves.
Result<PanTiltReading> Panorama::settle(const PanTiltAngles& angles) {
  const auto until = Clock::now() + std::chrono::duration<double>(options_.timeout_s);
  if (Status moved = unit_.move_to(angles); !moved) return failure(moved);
  for (;;) {
    auto reading = unit_.read();
    if (!reading || !reading->moves) return reading;
    if (Clock::now() > until) {
      return failure(ErrorCode::read_error,
                     fmt::format("the pan-tilt unit still moves after {:.1f} s", options_.timeout_s));
    }
    if (!wait(kPoll)) return failure(ErrorCode::interrupted, "ends early");
  }
}

// Whether the panorama goes on.
bool Panorama::look_at(const PanTiltAngles& angles) {
  set_phase(Phase::moving);
  for (int attempt = 1; attempt <= kAttempts && wait({}); ++attempt) {
    const auto reading = settle(angles);
    if (reading) {
      if (!wait(std::chrono::duration<double>(options_.settle_s))) return false;
      meter_exposure(reading->angles);
      take_frames(reading->angles);
      return wait({});
    }
    if (reading.error().code == ErrorCode::interrupted) return false;
    hooks_.log.warning(fmt::format("panorama, pan {:.1f} deg, tilt {:.1f} deg: {}", angles.pan_rad / kDegree,
                                   angles.tilt_rad / kDegree, reading.error().message()));
    if (reading.error().code == ErrorCode::input) break;  // beyond its limits
  }
  return wait({});
}

// Before the first view: the light was another one at the last panorama, and frames from the rest angles show another
// ground.
void Panorama::meter_exposure(const PanTiltAngles& angles) {
  for (int i = 0; i < kMetered; ++i) {
    {
      const std::lock_guard lock(mutex_);
      if (!metered_ || views_ > 0) return;
      phase_ = Phase::taking;
      angles_ = angles;
      unmetered_ = pairs_;
      missing_.clear();
    }
    trigger(pairs_);
    if (!wait_in_stream([this] { return unmetered_.empty() || ends(); })) break;
  }
  const std::lock_guard lock(mutex_);
  unmetered_.clear();
}

// Cameras that cannot be triggered take frames by themselves.
void Panorama::trigger(const std::set<std::string>& pairs) {
  for (const std::string& pair : pairs) {
    if (cameras_ != nullptr) static_cast<void>(cameras_->trigger(pair));
  }
}

void Panorama::take_frames(const PanTiltAngles& angles) {
  {
    const std::lock_guard lock(mutex_);
    phase_ = Phase::taking;
    angles_ = angles;
    missing_ = pairs_;
  }
  for (int attempt = 1; attempt <= kAttempts; ++attempt) {
    std::set<std::string> missing;
    {
      const std::lock_guard lock(mutex_);
      missing = missing_;
    }
    trigger(missing);
    if (!wait_for_frames()) continue;
    // A frame that was triggered twice may come twice: the second one must not be taken for one at the next angles.
    set_phase(Phase::moving);
    if (attempt > 1) wait_in_stream([this] { return ends(); });
    return;
  }
  const std::lock_guard lock(mutex_);
  if (missing_.empty()) return;  // it came after all
  hooks_.log.warning(
      fmt::format("panorama, pan {:.1f} deg: no frame of pair '{}'", angles.pan_rad / kDegree, *missing_.begin()));
}

bool Panorama::wait_for_frames() {
  return wait_in_stream([this] { return missing_.empty() || ends(); });
}

// At most frame_timeout_s of the stream's time, which stands still while a simulation renders; if the stream has ended,
// some timeout_s of real time. Whether `done`, which is called with the lock.
bool Panorama::wait_in_stream(const std::function<bool()>& done) {
  constexpr double kPatience = 4;
  const auto until = Clock::now() + std::chrono::duration<double>(kPatience * options_.timeout_s);
  std::unique_lock lock(mutex_);
  const Stamp begin = latest_;
  while (seconds_between(begin, latest_) < options_.frame_timeout_s && Clock::now() < until) {
    if (changed_.wait_for(lock, kPoll, done)) return true;
  }
  return false;
}

Result<StreamRead> PanoramaStream::read(std::chrono::nanoseconds timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    const auto left = until - std::chrono::steady_clock::now();
    auto read = behind().read(std::max<std::chrono::nanoseconds>(left, std::chrono::nanoseconds(0)));
    if (!read || !read->sample) return read;
    auto* const missing = std::get_if<MissingFrame>(&*read->sample);
    if (missing != nullptr && missing->partial && !panorama_.label(*missing->partial)) missing->partial.reset();
    auto* const frame = std::get_if<StereoFrame>(&*read->sample);
    if (frame == nullptr || panorama_.label(*frame)) return read;
  }
}

}  // namespace spartan::internal
