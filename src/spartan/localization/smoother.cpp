#include <Eigen/Cholesky>
#include <cmath>
#include <span>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/localization_inputs.h"
#include "spartan/localization/internal/measurement_log.h"
#include "spartan/localization/localizer.h"

namespace spartan {

using namespace internal;

namespace {

/// Frames whose states are in memory at the same time (72 kB each). Only every such frame is kept from the pass
/// forward; the pass backward makes those between again.
constexpr std::size_t kFrames = 128;
/// Added to the correlations of the state, which are singular where a clone is the pose itself.
constexpr double kRidge = 1e-9;

/// A frame with all measurements up to it, and the joint distribution with the next one.
struct Frame {
  Stamp stamp;
  StateEstimate at;   ///< by the measurements up to the frame
  PastState by_next;  ///< the same by those up to the next frame
};

/// X P⁻¹. P is scaled to correlations.
ErrorCovariance smoother_gain(const ErrorCovariance& with_next, const ErrorCovariance& next) {
  const ErrorVector scale = next.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  ErrorCovariance correlations = scale.asDiagonal() * next * scale.asDiagonal();
  correlations.diagonal().array() += kRidge;
  const ErrorCovariance scaled = with_next * scale.asDiagonal();
  const ErrorCovariance solved = correlations.ldlt().solve(scaled.transpose()).transpose();
  return solved * scale.asDiagonal();
}

/// A frame by all measurements. `next` is the frame after it by the measurements up to that one, `smoothed_next` the
/// same frame by all.
StateEstimate smoothed(const Frame& frame, const StateEstimate& next, const StateEstimate& smoothed_next) {
  const ErrorCovariance gain = smoother_gain(frame.by_next.with_present, next.covariance);
  const ErrorVector later = error_between(next.state, smoothed_next.state);
  StateEstimate result;
  result.state = add_error(frame.at.state, frame.by_next.mean + gain * later);
  result.covariance = frame.by_next.covariance + gain * (smoothed_next.covariance - next.covariance) * gain.transpose();
  symmetrize(result.covariance);
  return result;
}

}  // namespace

struct Smoother::State {
  explicit State(const LocalizationOptions& o) : options(o), order(o) {}

  LocalizationOptions options;
  ProcessingOrder order;
  std::optional<LocalizationStart> start;
  MeasurementLog log;
};

namespace {

/// The filter on its way through the measurements, from frame to frame.
class Pass {
 public:
  struct Place {
    std::size_t next = 0;
    FilterMemory memory;
  };

  Pass(const LocalizationOptions& options, const MeasurementLog& log) : filter_(options), log_(&log) {}

  void start(const LocalizationStart& start) {
    // Samples of the IMU from after the start may have their turn before it.
    std::vector<Measurement> before, after;
    for (; next_ < log_->size() && log_->turn(next_) <= start.stamp; ++next_) {
      const Measurement m = (*log_)[next_];
      const double age_s = seconds_between(stamp_of_measurement(m), start.stamp);
      if (age_s < 0) {
        after.push_back(m);
      } else if (age_s <= kBeforeStart_s) {
        before.push_back(m);
      }
    }
    filter_.start(start.stamp, start.ahead_in_body, before, start.up_in_body, start.assumed_up_in_body);
    for (const Measurement& m : after) filter_.process(m);
  }

  Place place() const { return {next_, filter_.memory()}; }
  void go_to(const Place& place) {
    next_ = place.next;
    filter_.set_memory(place.memory);
  }

  /// Up to the next visual motion; false at the end.
  bool to_next_frame() {
    while (next_ < log_->size()) {
      const Measurement m = (*log_)[next_++];
      filter_.process(m);
      if (std::holds_alternative<RelativeMotion>(m)) return true;
    }
    return false;
  }

  ErrorStateFilter& filter() { return filter_; }

 private:
  ErrorStateFilter filter_;
  const MeasurementLog* log_;
  std::size_t next_ = 0;
};

}  // namespace

Result<Smoother> Smoother::create(const LocalizationOptions& options) {
  if (auto valid = Localizer::create(options); !valid) return failure(valid);
  return Smoother(std::make_unique<State>(options));
}

Smoother::Smoother(std::unique_ptr<State> state) : state_(std::move(state)) {}
Smoother::Smoother(Smoother&&) noexcept = default;
Smoother& Smoother::operator=(Smoother&&) noexcept = default;
Smoother::~Smoother() = default;

void Smoother::add(const Measurement& measurement) {
  state_->log.add(by_stated_clock(measurement, state_->options.imu), state_->order);
}

void Smoother::start(const LocalizationStart& start) {
  state_->start = start;
}

Status Smoother::add(const Bytes& inputs) {
  const auto parsed = parse_localization_inputs(inputs);
  if (!parsed) return failure(parsed);
  if (parsed->start) state_->start = parsed->start;
  for (const Measurement& m : parsed->measurements) state_->log.add(m, state_->order);
  return {};
}

std::vector<SmoothedPose> Smoother::smooth() {
  if (!state_->start) return {};
  state_->log.sort();
  Pass pass(state_->options, state_->log);
  pass.start(*state_->start);
  std::vector<Pass::Place> places{pass.place()};
  std::size_t frames = 1;
  for (; pass.to_next_frame(); ++frames) {
    if (frames % kFrames == 0) places.push_back(pass.place());
  }

  std::vector<SmoothedPose> poses(frames);
  // The last frame is followed by the end of the measurements.
  StateEstimate next = pass.filter().memory().estimate, smoothed_next = next;
  for (std::size_t segment = places.size(); segment-- > 0;) {
    const std::size_t first = segment * kFrames, end = std::min(frames, first + kFrames);
    // The states of the segment, each with the joint distribution with the one after it.
    std::vector<Frame> states;
    states.reserve(end - first);
    pass.go_to(places[segment]);
    const auto add_frame = [&] {
      const FilterMemory& m = pass.filter().memory();
      states.push_back({m.stamp, {m.estimate.state, m.estimate.covariance, std::nullopt}, {}});
      pass.filter().begin_past();
    };
    add_frame();
    while (true) {
      pass.to_next_frame();
      states.back().by_next = *pass.filter().memory().estimate.past;
      if (first + states.size() == end) break;
      add_frame();
    }
    for (std::size_t i = end; i-- > first;) {
      const Frame& frame = states[i - first];
      smoothed_next = smoothed(frame, next, smoothed_next);
      next = frame.at;
      poses[i] = {frame.stamp, pass.filter().body_pose(smoothed_next)};
    }
  }
  return poses;
}

}  // namespace spartan
