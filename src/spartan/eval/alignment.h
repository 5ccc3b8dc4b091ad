// Laying one trajectory over another.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/trajectory.h"

namespace spartan {

/// What may be fitted before two trajectories are compared.
enum class Alignment {
  none,   ///< nothing
  first,  ///< the first pose of the estimate is put onto the first of the truth
  yaw,    ///< translation and rotation about z (4 degrees of freedom, least squares)
  se3,    ///< translation and rotation (6, least squares)
  sim3,   ///< translation, rotation and scale (7, least squares)
};
std::string_view name_of(Alignment alignment);
std::optional<Alignment> alignment_named(std::string_view name);

/// x ↦ s R x + t. On a pose the scale acts on the position alone.
struct Similarity {
  double scale = 1;
  Pose pose;  ///< R, t (metres)

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (pose.rotation() * point) + pose.translation();
  }
  Pose operator*(const Pose& other) const { return {pose.rotation() * other.rotation(), *this * other.translation()}; }
};

/// The similarity that minimises Σ |target_i − (s R source_i + t)|²; s = 1 unless `with_scale`.
/// Source: Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991.
/// Points on one line (or at one place) leave the rotation about it open: then one of the best is given.
/// Throws where the counts differ or are 0.
Similarity fit_similarity(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target,
                          bool with_scale);

/// The rotation about z and the translation that minimise the same sum, in closed form.
/// Source: Zhang & Scaramuzza, "A tutorial on quantitative trajectory evaluation for visual(-inertial) odometry",
/// IROS 2018, section III-B.
Similarity fit_yaw(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target);

/// truth_from_estimate of two trajectories whose poses correspond one to one.
Similarity align(const Trajectory& estimate, const Trajectory& truth, Alignment alignment);

}  // namespace spartan
