// Motion of the rover's body over rough ground: a smooth trajectory with its velocity and acceleration.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/sim/internal/drive/wheel_lift.h"
#include "spartan/sim/internal/world/terrain_shape.h"
#include "spartan/sim/scenario.h"
#include "spartan/sim/scenario_options.h"
#include "spartan/sim/sensor_options.h"

namespace spartan::sim::internal {

/// The ground that the wheels roll on. Borrowed.
struct WheelGround {
  const TerrainShape& shape;
  const WheelLift& rocks;
};

/// Pose of the body: the least-squares plane through the contact points of its four wheels. The six coordinates
/// (position; roll, pitch, yaw about fixed axes in the order x, y, z) are sampled every kKnot_s and interpolated by
/// uniform cubic B-splines, so that position and attitude are twice continuously differentiable. The spline, not the
/// samples, is the true motion.
class BodyMotion {
 public:
  static constexpr double kKnot_s = 0.1;  ///< s; spacing of the knots
  /// Borrows nothing: `ground` is used during construction only. Of `wheels` the slip that moves the body: side slip
  /// and creep.
  BodyMotion(const Drive& drive, const WheelGround& ground, const ChassisOptions& chassis, const ThreadPool& workers,
             const WheelOptions& wheels = {});

  Pose world_from_body(double time_s) const;
  Eigen::Vector3d velocity(double time_s) const;          ///< m/s, world
  Eigen::Vector3d creep_velocity(double time_s) const;    ///< m/s, world; the part of it by which wheels do not turn
  Eigen::Vector3d acceleration(double time_s) const;      ///< m/s², world
  Eigen::Vector3d angular_velocity(double time_s) const;  ///< rad/s, body
  Eigen::Vector3d roll_pitch_yaw(double time_s) const;    ///< rad
  /// Duration of the motion.
  double seconds() const { return kKnot_s * static_cast<double>(knots_.size() - 1); }

 private:
  Vector6d evaluate_spline(double time_s, int derivative) const;
  std::vector<Vector6d> knots_;
  std::vector<Eigen::Vector2d> creep_;  // since the start, m, world x and y; empty: none
};

/// Pose of the body on the ground at a planar pose, as BodyMotion samples it: x, y, z (m), roll, pitch, yaw (rad).
Vector6d fit_to_ground(const WheelGround& ground, const ChassisOptions& chassis, const PlanarPose& at);

}  // namespace spartan::sim::internal
