#include "spartan/localization/internal/filter_memory.h"

#include <algorithm>
#include <limits>
#include <type_traits>

namespace spartan::internal {
namespace {

struct Put {
  ArchiveWriter& out;
  template <class T>
  void size(const std::vector<T>& values) {
    out.put(static_cast<std::uint32_t>(values.size()));
  }
  template <class T, class Visit>
  void optional(const std::optional<T>& value, const Visit& visit) {
    (*this)(value.has_value());
    if (value) visit(*value);
  }
  template <class T>
  void operator()(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_same_v<T, Pose>) {
      out.put(value);
    } else if constexpr (std::is_same_v<T, Stamp>) {
      out.put(value.ns);
    } else if constexpr (std::is_same_v<T, Eigen::Quaterniond>) {
      for (int i = 0; i < 4; ++i) out.put(value.coeffs()[i]);
    } else {
      for (Eigen::Index i = 0; i < value.size(); ++i) out.put(value.data()[i]);
    }
  }
};

// Reads into the fields. Counters are far from their largest value, so that they can go on counting.
struct Get {
  ArchiveReader& in;
  bool plausible = true;
  template <class T>
  void size(std::vector<T>& values) {
    constexpr std::uint32_t kMost = 1000;
    const auto count = in.get<std::uint32_t>();
    plausible = plausible && count <= kMost;
    values.resize(std::min(count, kMost));
  }
  template <class T, class Visit>
  void optional(std::optional<T>& value, const Visit& visit) {
    bool there = false;
    (*this)(there);
    if (there) visit(value.emplace());
  }
  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_same_v<T, double>) {
      value = in.get_finite();
    } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      value = in.get<T>();
      if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>)
        plausible = plausible && value >= 0 && value <= std::numeric_limits<T>::max() / 2;
    } else if constexpr (std::is_same_v<T, Stamp>) {
      value = in.get_stamp();
    } else if constexpr (std::is_same_v<T, Pose>) {
      value = in.get_pose();
    } else if constexpr (std::is_same_v<T, Eigen::Quaterniond>) {
      for (int i = 0; i < 4; ++i) value.coeffs()[i] = in.get_finite();
    } else {
      for (Eigen::Index i = 0; i < value.size(); ++i) value.data()[i] = in.get_finite();
    }
  }
};

void visit_queue(Put& put, const ImuQueue& queue) {
  put(queue.size());
  for (std::uint32_t i = 0; i < queue.size(); ++i)
    put(queue[i].stamp), put(queue[i].gyro_rad_s), put(queue[i].accel_m_s2);
}

void visit_queue(Get& get, ImuQueue& queue) {
  std::uint32_t count = 0;
  get(count);
  get.plausible = get.plausible && count <= ImuQueue::kCapacity;
  for (std::uint32_t i = 0; i < std::min(count, ImuQueue::kCapacity); ++i) {
    ImuSample sample;
    get(sample.stamp), get(sample.gyro_rad_s), get(sample.accel_m_s2);
    queue.push(sample);
  }
}

// Lists every field once, for writing and reading.
template <class Each, class State>
void visit_state(Each& each, State& s) {
  each(s.world_from_body), each(s.velocity_m_s), each(s.gyro_bias_rad_s), each(s.accel_bias_m_s2);
  each(s.gravity_tilt_rad), each(s.gravity_scale), each(s.imu_time_offset_s), each(s.wheel_scale);
  each(s.compass_offset_rad), each(s.inclinometer_bias_rad);
  each(s.vision_drift), each(s.vision_constant), each(s.calibration), each(s.world_from_vision_clone),
      each(s.world_from_step_clone);
}

template <class Each, class Wheels>
void visit_wheels(Each& each, Wheels& w) {
  each(w.stamp), each(w.left_m), each(w.right_m);
}

template <class Each, class Inertial>
void visit_preintegration(Each& each, Inertial& p) {
  each(p.seconds), each(p.gyro_bias_rad_s), each(p.accel_bias_m_s2), each(p.rotation), each(p.velocity);
  each(p.position), each(p.rotation_by_gyro), each(p.velocity_by_gyro), each(p.velocity_by_accel);
  each(p.position_by_gyro), each(p.position_by_accel), each(p.by_time), each(p.covariance);
}

template <class Each, class Segment>
void visit_segment(Each& each, Segment& s) {
  each(s.motion), each(s.covariance), visit_preintegration(each, s.inertial);
}

template <class Each, class Window>
void visit_window(Each& each, Window& w) {
  each(w.open), each(w.begin), each(w.newest), visit_preintegration(each, w.current);
  each.size(w.segments), each.size(w.frames);
  for (auto& segment : w.segments) visit_segment(each, segment);
  for (auto& frame : w.frames) each(frame.stamp), visit_segment(each, frame.segment);
}

template <class Each, class Imu>
void visit_imu(Each& each, Imu& m) {
  each(m.known), each(m.last.stamp), each(m.last.gyro_rad_s), each(m.last.accel_m_s2), each(m.changed);
  visit_queue(each, m.waiting);
  each(m.noise.gyro_variance), each(m.noise.accel_variance), each(m.noise.seconds), each(m.noise.interval_s);
  each(m.level_from), each(m.level_count), each(m.level_force_sum);
  each(m.aligned), each(m.waiting_since), visit_window(each, m.window.state());
  each(m.block.from), each(m.block.count), each(m.block.gyro), each(m.block.accel);
  each(m.block.gyro_squares), each(m.block.accel_squares);
}

template <class Each, class Sample>
void visit_tilt(Each& each, Sample& s) {
  each(s.stamp), each(s.roll_rad), each(s.pitch_rad), each(s.sigma_rad);
}

template <class Each, class Monitor>
void visit_monitor(Each& each, Monitor& j) {
  each(j.seen), each(j.last), each(j.state), each(j.reason), each(j.nis), each(j.limit);
  each(j.used), each(j.rejected), each(j.passed_in_row), each(j.failed_in_row);
  each.optional(j.test, [&](auto& test) { each(test.stamp), each(test.nis), each(test.gate); });
}

template <class Each, class Memory>
void visit(Each& each, Memory& m) {
  each(m.started), each(m.stamp), each(m.estimate.covariance), each(m.world_from_odom), each(m.gravity_known),
      each(m.gravity_measured);
  visit_state(each, m.estimate.state);
  visit_imu(each, m.imu);
  each(m.vision.clone_stamp), each(m.vision.odom_from_clone), each(m.vision.odom_covariance), each(m.vision.stationary);
  each(m.vision.rate_rad_s), each(m.vision.constant_velocity_noise), each(m.vision.constant_velocity_s);
  each(m.vision.recent.count), each(m.vision.recent.length_m), each(m.vision.recent.velocity_m_s),
      each(m.vision.recent.end);
  each(m.vision.reset), each(m.vision.doubted), each(m.vision.doubted_at), each(m.vision.doubted_pose);
  each(m.vision.has_wheels), visit_wheels(each, m.vision.wheels), each(m.vision.wheels_in_prediction);
  each(m.vision.has_tilt), visit_tilt(each, m.vision.tilt);
  each(m.step.from), each(m.step.odom_from_clone), each(m.step.has_wheels), visit_wheels(each, m.step.wheels);
  each(m.step.stationary);
  each(m.wheels.known), visit_wheels(each, m.wheels.last), visit_wheels(each, m.wheels.previous),
      visit_wheels(each, m.wheels.moved);
  each(m.wheels.slip_known), each(m.wheels.slip_stamp), each(m.wheels.slip), each(m.wheels.slip_sigma);
  each(m.compass.heading_east), each(m.compass.offset_known), each(m.compass.pending);
  for (auto& offset : m.compass.offsets) each(offset);
  for (auto& sigma : m.compass.sigmas) each(sigma);
  each(m.compass.noise.ratio), each(m.compass.noise.weight);
  each(m.inclinometer.noise.ratio), each(m.inclinometer.noise.weight);
  each(m.inclinometer.of_motions.ratio), each(m.inclinometer.of_motions.weight);
  each(m.inclinometer.known), visit_tilt(each, m.inclinometer.last);
  for (auto& monitor : m.monitors) visit_monitor(each, monitor);
}

}  // namespace

void put(ArchiveWriter& out, const FilterMemory& memory) {
  Put each{out};
  visit(each, memory);
}

std::optional<FilterMemory> get_filter_memory(ArchiveReader& in) {
  FilterMemory memory;
  Get each{in};
  visit(each, memory);
  if (!each.plausible || memory.compass.pending >= CompassMemory::kPending) return std::nullopt;
  return memory;
}

}  // namespace spartan::internal
