// Test fixture: the memory of a filter that has just been started by a rover at rest.
#pragma once

#include "spartan/localization/internal/drive_test.h"
#include "spartan/localization/internal/error_state_filter.h"

namespace spartan::internal {

inline Stamp start_stamp() {
  return test_stamp(2.5);
}
inline Stamp after_start(double seconds) {
  return test_stamp(2.5 + seconds);
}

/// With the samples of ideal sensors before.
inline FilterMemory started_memory(const LocalizationOptions& options, const TestSensors& with) {
  TestSensors ideal = with;
  ideal.noise = 0;
  ErrorStateFilter filter(options);
  filter.start(start_stamp(), Eigen::Vector3d::UnitX(), test_samples(TestDrive(), 2.5, ideal, 1));
  return filter.memory();
}

inline double variance_at(const FilterMemory& memory, int index) {
  return memory.estimate.covariance(index, index);
}

inline Pose odom_pose(const FilterMemory& memory) {
  return memory.world_from_odom.inverse() * memory.estimate.state.world_from_body;
}

inline double distance(const Pose& a, const Pose& b) {
  return log_se3(a.inverse() * b).norm();
}

}  // namespace spartan::internal
