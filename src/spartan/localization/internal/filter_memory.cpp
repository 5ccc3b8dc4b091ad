#include "spartan/localization/internal/filter_memory.h"

#include <limits>
#include <type_traits>

namespace spartan::internal {
namespace {

struct Put {
  ArchiveWriter& out;
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

// Lists every field once, for writing and reading.
template <class Each, class State>
void visit_state(Each& each, State& s) {
  each(s.world_from_body), each(s.velocity_m_s), each(s.gyro_bias_rad_s), each(s.accel_bias_m_s2);
  each(s.gravity_tilt_rad), each(s.wheel_scale), each(s.compass_offset_rad), each(s.inclinometer_bias_rad);
  each(s.vision_drift), each(s.vision_constant), each(s.world_from_vision_clone), each(s.world_from_step_clone);
}

template <class Each, class Wheels>
void visit_wheels(Each& each, Wheels& w) {
  each(w.stamp), each(w.left_m), each(w.right_m);
}

template <class Each, class Imu>
void visit_imu(Each& each, Imu& m) {
  each(m.known), each(m.last.stamp), each(m.last.gyro_rad_s), each(m.last.accel_m_s2), each(m.changed);
  each(m.aligned), each(m.align_from), each(m.align_count), each(m.align_force_sum);
  each(m.block.from), each(m.block.count), each(m.block.gyro), each(m.block.accel);
  each(m.block.gyro_squares), each(m.block.accel_squares);
  each(m.gyro_rotation), each(m.gyro_rotation_s), each(m.gyro_rotation_complete);
}

template <class Each, class Monitor>
void visit_monitor(Each& each, Monitor& j) {
  each(j.seen), each(j.last), each(j.state), each(j.reason), each(j.nis), each(j.limit);
  each(j.used), each(j.rejected), each(j.passed_in_row), each(j.failed_in_row);
}

template <class Each, class Memory>
void visit(Each& each, Memory& m) {
  each(m.started), each(m.stamp), each(m.estimate.covariance), each(m.world_from_odom), each(m.gravity_measured);
  visit_state(each, m.estimate.state);
  visit_imu(each, m.imu);
  each(m.vision.clone_stamp), each(m.vision.odom_from_clone), each(m.vision.odom_covariance), each(m.vision.stationary);
  each(m.vision.rate_rad_s), each(m.vision.constant_velocity_noise), each(m.vision.constant_velocity_s);
  each(m.vision.has_wheels), visit_wheels(each, m.vision.wheels);
  each(m.step.from), each(m.step.odom_from_clone), each(m.step.has_wheels), visit_wheels(each, m.step.wheels);
  each(m.step.stationary);
  each(m.wheels.known), visit_wheels(each, m.wheels.last), visit_wheels(each, m.wheels.previous),
      visit_wheels(each, m.wheels.moved);
  each(m.wheels.slip_known), each(m.wheels.slip_stamp), each(m.wheels.slip), each(m.wheels.slip_sigma);
  each(m.compass.heading_east), each(m.compass.offset_known), each(m.compass.pending);
  for (auto& offset : m.compass.offsets) each(offset);
  for (auto& sigma : m.compass.sigmas) each(sigma);
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
