// Alignment of an estimated trajectory with the true one.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/trajectory.h"
#include "spartan/core/umeyama.h"

namespace spartan {

/// What is fitted before two trajectories are compared.
enum class Alignment {
  none,   ///< nothing
  first,  ///< the first pose of the estimate is moved onto the first pose of the truth
  yaw,    ///< translation and rotation about z (4 degrees of freedom, least squares)
  se3,    ///< translation and rotation (6, least squares)
  sim3,   ///< translation, rotation and scale (7, least squares)
};
std::string_view name_of(Alignment alignment);
std::optional<Alignment> alignment_named(std::string_view name);

/// The similarity that minimizes Σ |target_i − (s R source_i + t)|² (Umeyama 1991, core/umeyama.h); s = 1 unless
/// `with_scale`. Where all points lie on a line or at one place, one of several optimal rotations is returned.
/// Throws std::invalid_argument where the counts differ or are 0.
Similarity fit_similarity(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target,
                          bool with_scale);

/// The rotation about z and the translation that minimize the same sum, in closed form.
/// Source: Zhang & Scaramuzza, "A tutorial on quantitative trajectory evaluation for visual(-inertial) odometry",
/// IROS 2018, section III-B.
Similarity fit_yaw(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target);

/// truth_from_estimate of two trajectories whose poses correspond one to one.
Similarity align(const Trajectory& estimate, const Trajectory& truth, Alignment alignment);

}  // namespace spartan
