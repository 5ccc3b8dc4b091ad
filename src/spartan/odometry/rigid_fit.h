// The rigid motion between two clouds of corresponding points.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/core/pose.h"

namespace spartan {

/// a_from_b that minimises Σ wᵢ |aᵢ − a_from_b bᵢ|². Nothing with fewer than three points or when they lie on a line.
/// Source: Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 13 (1991),
/// without scale.
std::optional<Pose> fit_rigid(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b,
                              const std::vector<double>& weights);

}  // namespace spartan
