// The rover's body over rough ground: a smooth trajectory, with its velocity and acceleration.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/sim/drive.h"
#include "spartan/sim/terrain_shape.h"
#include "spartan/sim/wheel_lift.h"

namespace spartan::sim {

struct ChassisOptions {
  double wheelbase_m = 0.7;
  double track_m = 0.6;
  double wheel_radius_m = 0.1;
  double wheel_width_m = 0.08;
  double clearance_m = 0.05;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("wheelbase_m", wheelbase_m, "front to rear axle", between(0.05, 10));
    v.field("track_m", track_m, "left to right wheel", between(0.05, 10));
    v.field("wheel_radius_m", wheel_radius_m, "the ground's height counts as its mean over so wide a disc",
            between(0.01, 2));
    v.field("wheel_width_m", wheel_width_m, "of the rim that climbs rocks", between(0.005, 2));
    v.field("clearance_m", clearance_m, "rocks higher than this are kept off the rover's way; wheels climb lower ones",
            between(0, 5));
  }
};

/// The ground that wheels roll on.
struct WheelGround {
  const TerrainShape& shape;
  const WheelLift& rocks;
};

/// The body stands on the plane through its four wheels' feet (least squares). The six numbers (position; roll,
/// pitch, yaw about fixed axes in the order x, y, z) are sampled every kKnot_s and blended by uniform cubic B-splines,
/// so that position and attitude are twice continuously differentiable: this blend is the true motion.
class BodyMotion {
 public:
  static constexpr double kKnot_s = 0.1;
  BodyMotion(const Drive& drive, const WheelGround& ground, const ChassisOptions& chassis, const Workers& workers);

  Pose world_from_body(double time_s) const;
  Eigen::Vector3d velocity(double time_s) const;          ///< m/s, world
  Eigen::Vector3d acceleration(double time_s) const;      ///< m/s², world
  Eigen::Vector3d angular_velocity(double time_s) const;  ///< rad/s, body
  Eigen::Vector3d roll_pitch_yaw(double time_s) const;
  double seconds() const { return kKnot_s * static_cast<double>(knots_.size() - 1); }

 private:
  Vector6d blend(double time_s, int derivative) const;
  std::vector<Vector6d> knots_;
};

/// The body on the ground at a place, as BodyMotion samples it: x, y, z, roll, pitch, yaw.
Vector6d stand_on(const WheelGround& ground, const ChassisOptions& chassis, const PlanarPose& at);

}  // namespace spartan::sim
