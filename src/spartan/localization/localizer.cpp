#include "spartan/localization/localizer.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "spartan/localization/internal/localization_inputs.h"
#include "spartan/localization/internal/processing_order.h"
#include "spartan/localization/internal/replay_filter.h"

namespace spartan {

using namespace internal;

namespace {

constexpr std::uint32_t kStateVersion = 9;

}  // namespace

struct Localizer::State {
  explicit State(const LocalizationOptions& o) : options(o), filter(o) {}

  bool add(const Measurement& measurement) {
    const Measurement m = by_stated_clock(measurement, options.imu);
    std::optional<Refusal> refusal;
    const auto* motion = std::get_if<RelativeMotion>(&m);
    if (!is_valid(m)) {
      refusal = Refusal::not_finite;
    } else if (motion != nullptr && motion->to <= motion->from) {
      refusal = Refusal::reversed;
    } else {
      refusal = filter.add(m);
    }
    if (refusal) refusals[static_cast<std::size_t>(sensor_of(m))].count(*refusal);
    if (!refusal && inputs) inputs->add(m);
    return !refusal;
  }

  double timeout_s(LocalizationSensor sensor) const {
    switch (sensor) {
      case LocalizationSensor::vision:
        return options.health.vision_timeout_s;
      case LocalizationSensor::imu:
        return options.imu.timeout_s;
      case LocalizationSensor::wheels:
        return options.health.wheels_timeout_s;
      case LocalizationSensor::compass:
        return options.health.compass_timeout_s;
      case LocalizationSensor::inclinometer:
        return options.health.inclinometer_timeout_s;
      case LocalizationSensor::map:
        break;
    }
    return std::numeric_limits<double>::infinity();  // map constraints come irregularly
  }

  LocalizationEstimate estimate_of(const ErrorStateFilter& state) const;

  LocalizationOptions options;
  ReplayFilter filter;
  std::array<RefusalCounts, kLocalizationSensors> refusals;
  std::optional<LocalizationInputs> inputs;
};

Result<Localizer> Localizer::create(const LocalizationOptions& options) {
  if (Status valid = validate(options, "localization options"); !valid) return failure(valid);
  if (!(options.gravity_m_s2 > 0) || !std::isfinite(options.gravity_m_s2)) {
    return failure(ErrorCode::configuration, fmt::format("{} is not a positive number", options.gravity_m_s2),
                   "localization options: gravity_m_s2");
  }
  return Localizer(std::make_unique<State>(options));
}

Localizer::Localizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;
Localizer::~Localizer() = default;

void Localizer::start(Stamp stamp, const Eigen::Vector3d& ahead_in_body,
                      const std::optional<Eigen::Vector3d>& up_in_body, const Eigen::Vector3d& assumed_up_in_body) {
  state_->filter.start(stamp, ahead_in_body, up_in_body, assumed_up_in_body);
  if (state_->inputs) state_->inputs->start = {stamp, ahead_in_body, up_in_body, assumed_up_in_body};
}
bool Localizer::started() const {
  return state_->filter.started();
}

bool Localizer::add(const Measurement& measurement) {
  return state_->add(measurement);
}

bool Localizer::reaches(Stamp stamp) const {
  return state_->filter.reaches(stamp);
}

LocalizationEstimate Localizer::estimate() const {
  return state_->estimate_of(state_->filter.newest());
}

std::optional<LocalizationEstimate> Localizer::estimate_at(Stamp stamp) const {
  const auto filter = state_->filter.at(stamp);
  if (!filter) return std::nullopt;
  return state_->estimate_of(*filter);
}

LocalizationEstimate Localizer::State::estimate_of(const ErrorStateFilter& state) const {
  const FilterMemory& m = state.memory();
  const NavigationState& s = m.estimate.state;
  const ErrorCovariance& p = m.estimate.covariance;
  LocalizationEstimate e;
  e.stamp = m.stamp;
  e.world_from_body = state.world_from_body();
  e.odom_from_body = state.odom_from_body();
  e.world_from_odom = m.world_from_odom;
  // v = R w, δv = R (ν − [w]× φ).
  const Eigen::Matrix3d rotation = s.world_from_body.rotation_matrix();
  Eigen::Matrix<double, 3, 6> by_attitude_and_velocity;
  by_attitude_and_velocity << -rotation * skew(s.velocity_m_s), rotation;
  static_assert(error_at::kVelocity == error_at::kAttitude + 3);
  e.velocity_m_s = state.velocity();
  e.velocity_covariance = by_attitude_and_velocity * p.block<6, 6>(error_at::kAttitude, error_at::kAttitude) *
                          by_attitude_and_velocity.transpose();
  e.biases = {s.gyro_bias_rad_s, p.diagonal().segment<3>(error_at::kGyroBias).cwiseSqrt(), s.accel_bias_m_s2,
              p.diagonal().segment<3>(error_at::kAccelBias).cwiseSqrt()};
  e.imu_aligned = m.imu.aligned;
  e.imu_time_offset_s = options.imu.time_offset_s + s.imu_time_offset_s;
  e.imu_time_offset_sigma_s = std::sqrt(p(error_at::kImuTime, error_at::kImuTime));
  if (m.wheels.slip_known) e.slip = WheelSlip{m.wheels.slip_stamp, m.wheels.slip, m.wheels.slip_sigma};
  e.heading.east = m.compass.heading_east;
  if (m.compass.offset_known) {
    e.heading.compass_offset_rad = s.compass_offset_rad;
    e.heading.compass_offset_sigma_rad = std::sqrt(p(error_at::kCompassOffset, error_at::kCompassOffset));
  }
  e.gravity_measured = m.gravity_measured;
  e.up_in_world = true_up(s.gravity_tilt_rad);
  for (std::size_t i = 0; i < e.health.size(); ++i) {
    const auto sensor = static_cast<LocalizationSensor>(i);
    RefusalCounts refused = refusals[i];
    if (sensor == LocalizationSensor::vision) refused.too_early += filter.undone_leaps();
    e.health[i] = m.monitors[i].report(m.stamp, timeout_s(sensor), refused);
  }
  return e;
}

Bytes Localizer::save() const {
  ArchiveWriter out;
  out.put(kStateVersion);
  for (const RefusalCounts& r : state_->refusals) {
    out.put(r.not_finite);
    out.put(r.too_late);
    out.put(r.too_early);
    out.put(r.duplicates);
    out.put(r.reversed);
  }
  state_->filter.put(out);
  const Bytes inputs = state_->inputs.value_or(LocalizationInputs()).bytes();
  out.put_array(inputs.data(), inputs.size());
  return out.take();
}

void Localizer::keep_inputs() {
  state_->inputs.emplace();
}

Bytes Localizer::take_inputs() {
  if (!state_->inputs || state_->inputs->empty()) return {};
  return std::exchange(*state_->inputs, {}).bytes();
}

Status Localizer::restore(const Bytes& bytes) {
  ArchiveReader in(bytes);
  const std::string what = "saved state of the localization";
  if (Status s = in.expect_version(kStateVersion, what); !s) return s;
  auto state = std::make_unique<State>(state_->options);
  bool possible = true;
  const auto count = [&] {
    const auto value = in.get<std::int64_t>();
    possible = possible && value >= 0 && value <= std::numeric_limits<std::int64_t>::max() / 2;
    return value;
  };
  for (RefusalCounts& r : state->refusals) {
    r.not_finite = count();
    r.too_late = count();
    r.too_early = count();
    r.duplicates = count();
    r.reversed = count();
  }
  possible = possible && state->filter.get(in);
  const Bytes inputs = in.get_array<std::uint8_t>();
  if (Status status = in.finish(what); !status) return status;
  if (!possible) return failure(ErrorCode::store_damaged, "is damaged", what, "run again into a new folder");
  auto parsed = parse_localization_inputs(inputs);
  if (!parsed) return failure(parsed);
  if (state_->inputs) state->inputs = std::move(*parsed);
  state_ = std::move(state);
  return {};
}

}  // namespace spartan
