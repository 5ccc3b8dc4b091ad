// Jacobian of an alignment without what an image may contain beside the template, compiled for each instruction set.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "spartan/odometry/internal/matching/window_kernels.h"

namespace spartan::internal {

/// What an alignment estimates. With the derivatives Tx, Ty of the template T at the offset (i, j), the columns of its
/// Jacobian are:
enum class AlignmentUnknowns : std::uint8_t {
  position,             ///< Tx, Ty
  disparity_and_slant,  ///< −Tx, −i Tx, −j Tx
  position_and_slant,   ///< Tx, Ty, −i Tx, −j Tx
};

constexpr int count_of(AlignmentUnknowns unknowns) {
  switch (unknowns) {
    case AlignmentUnknowns::position:
      return 2;
    case AlignmentUnknowns::disparity_and_slant:
      return 3;
    case AlignmentUnknowns::position_and_slant:
      return 4;
  }
  return 0;
}

/// The columns J of the Jacobian less their projection J − J' on the nuisance N, so that Σ w J' N = 0 with the weights
/// w of the window. The nuisance is what an image may contain beside its template: planes of brightness (1, i, j),
/// multiples of the template and, where the position alone is estimated, its derivative by the scale, i Tx + j Ty.
struct ProjectedJacobian {
  std::array<Window, kMaxFactors> factors;  ///< w T and w J', as window_sums() takes them
  Eigen::Matrix4d information;              ///< Σ w J'ᵀJ'; only the block of the unknowns is set

  /// `reference`: the template without its weighted mean, and its derivatives.
  ProjectedJacobian(const WindowGradients& reference, AlignmentUnknowns unknowns);
};

}  // namespace spartan::internal
