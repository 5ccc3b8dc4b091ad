// Least-squares similarity or rigid transform between two sets of corresponding points.
// Source: Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 13 (1991).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "spartan/core/pose.h"

namespace spartan {

struct UmeyamaFit {
  Similarity target_from_source;
  /// False where the points lie on a line or at one place, so that the rotation about it is free: the transform is then
  /// one of several with the same minimal sum.
  bool unique = true;
};

enum class FitScale {
  fixed,      ///< s = 1
  estimated,  ///< s is fitted as well
};

/// The transform that minimizes Σ wᵢ |targetᵢ − (s R sourceᵢ + t)|². `weights`: one not negative weight for each pair
/// of points; empty: all equal. R is always a rotation, never a reflection. std::nullopt where there is no point of
/// positive weight. Throws std::invalid_argument where the numbers of points or weights differ.
std::optional<UmeyamaFit> fit_umeyama(std::span<const Eigen::Vector3d> target, std::span<const Eigen::Vector3d> source,
                                      FitScale scale, std::span<const double> weights = {});

}  // namespace spartan
