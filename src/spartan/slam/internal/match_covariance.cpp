#include "spartan/slam/internal/match_covariance.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "spartan/numerics/median.h"

namespace spartan::internal {
namespace {

// Over the kept directions: at most six, which spares the large-matrix products of Eigen.
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kMinVariance = 1e-4;  // lower bound, in squares of the largest determined standard deviations

// The square block of the lattice that contains a cell.
std::pair<int, int> block_of(const MatchedCell& cell, double cell_m, double block_m) {
  const int side = std::max(1, static_cast<int>(std::lround(block_m / cell_m)));
  return {cell.row / side, cell.column / side};
}

struct Block {
  Matrix6d curvature = Matrix6d::Zero();
  Vector6d score = Vector6d::Zero();
};

// Tangents are in units of the largest standard deviations that count as determined, so that the limit is 1 everywhere.
std::vector<Block> blocks_of(std::span<const MatchedCell> cells, double cell_m, const Vector6d& unit,
                             const MatchOptions& options) {
  std::map<std::pair<int, int>, Block> blocks;
  for (const MatchedCell& cell : cells) {
    Block& block = blocks[block_of(cell, cell_m, options.block_m)];
    const Vector6d a = cell.jacobian_by_local.cwiseProduct(unit), b = cell.jacobian_by_global.cwiseProduct(unit);
    // The product of two independent measurements of a slope is unbiased. The square of one would contain the variance
    // of its noise, which looks like relief on a plane.
    const Matrix6d product = a * b.transpose();
    block.curvature += (0.5 * cell.curvature) * (product + product.transpose());
    block.score += (0.5 * cell.weight * cell.residual_m) * (a + b);
  }
  std::vector<Block> list;
  list.reserve(blocks.size());
  for (const auto& [place, block] : blocks) list.push_back(block);
  return list;
}

// Scores Σ wJr of the residuals that common errors of the disparities cause.
struct CommonScores {
  std::vector<Vector6d> areas;
  Vector6d relief = Vector6d::Zero();
};

CommonScores common_scores(std::span<const MatchedCell> cells, double cell_m, const Vector6d& unit,
                           double normalized_residual, const MatchOptions& options) {
  std::map<std::pair<int, int>, Vector6d> areas;
  CommonScores scores;
  for (const MatchedCell& cell : cells) {
    Vector6d& score =
        areas.try_emplace(block_of(cell, cell_m, options.common_error_area_m), Vector6d::Zero()).first->second;
    const Vector6d weighted = (cell.weight * normalized_residual) * cell.jacobian().cwiseProduct(unit);
    score += (options.common_error_ratio * cell.common_error_m) * weighted;
    scores.relief += (options.relief_error_ratio * cell.relief_error_m) * weighted;
  }
  scores.areas.reserve(areas.size());
  for (const auto& [place, score] : areas) scores.areas.push_back(score);
  return scores;
}

// Significance of the curvature along an axis: the sum of the blocks' parts over its standard error under the null
// hypothesis of no relief, in which the parts are random with mean zero. By Efron (JASA 1969) this self-normalized sum
// is about normal for any symmetric distribution of the parts. In the standard error a part is limited to three robust
// standard deviations, so that single rocks on a plane, which are no noise, do not inflate it.
double curvature_significance(const std::vector<Block>& blocks, const Vector6d& axis) {
  constexpr double kMaxSigmas = 3;
  std::vector<double> parts, sizes;
  parts.reserve(blocks.size());
  sizes.reserve(blocks.size());
  for (const Block& block : blocks) {
    parts.push_back(axis.dot(block.curvature * axis));
    sizes.push_back(std::abs(parts.back()));
  }
  if (parts.empty()) return 0;
  const double most = kMaxSigmas * median(sizes) / 0.6745;  // median absolute deviation → standard deviation
  double sum = 0, squares = 0;
  for (const double part : parts) {
    sum += part;
    squares += std::min(part * part, most * most);
  }
  return squares > 0 ? sum / std::sqrt(squares) : 0;
}

// Covariance in the directions of the basis: the change of the estimate, to first order, when each of the blocks is
// left out (jackknife), and by the common errors of each area. None where a direction depends on a single block.
std::optional<SmallMatrix> jackknife(const std::vector<Block>& blocks, const std::vector<Vector6d>& common,
                                     const Matrix6d& total, const SmallMatrix& basis) {
  SmallMatrix covariance = SmallMatrix::Zero(basis.cols(), basis.cols());
  for (const Block& block : blocks) {
    const Eigen::LLT<SmallMatrix> rest(basis.transpose() * (total - block.curvature) * basis);
    if (rest.info() != Eigen::Success) return std::nullopt;
    const SmallVector change = rest.solve(basis.transpose() * block.score);
    covariance += change * change.transpose();
  }
  const Eigen::LLT<SmallMatrix> all(basis.transpose() * total * basis);
  for (const Vector6d& score : common) {
    const SmallVector change = all.solve(basis.transpose() * score);
    covariance += change * change.transpose();
  }
  return covariance;
}

}  // namespace

MatchCovariance estimate_match_covariance(std::span<const MatchedCell> cells, double cell_m,
                                          const MatchOptions& options) {
  MatchCovariance result;
  result.cells = static_cast<int>(cells.size());
  result.normalized_residual = median_normalized_residual(cells);
  result.sigma_m = result.sigma_rad = kInfinite;
  const double largest_rad = options.max_sigma_deg * std::numbers::pi / 180;
  Vector6d unit;
  unit << Eigen::Vector3d::Constant(options.max_sigma_m), Eigen::Vector3d::Constant(largest_rad);
  const std::vector<Block> blocks = blocks_of(cells, cell_m, unit, options);
  result.blocks = static_cast<int>(blocks.size());
  const CommonScores common = common_scores(cells, cell_m, unit, result.normalized_residual, options);
  Matrix6d total = Matrix6d::Zero();
  for (const Block& block : blocks) total += block.curvature;
  const SymmetricEigen axes = eigen_of_symmetric(total);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (curvature_significance(blocks, axes.vectors.col(k)) >= options.min_relief_sigmas) kept.push_back(k);
  }
  // Directions of the smallest curvature are discarded until none of the others depends on a single block.
  for (; !kept.empty(); kept.erase(kept.begin())) {
    const SmallMatrix basis = axes.vectors(Eigen::all, kept);
    const auto covariance = jackknife(blocks, common.areas, total, basis);
    if (!covariance) continue;
    // Eigenvalues are in ascending order: the determined directions come first.
    const Eigen::SelfAdjointEigenSolver<SmallMatrix> spread(*covariance);
    result.determined = static_cast<int>((spread.eigenvalues().array() <= 1).count());
    const SmallMatrix determined = spread.eigenvectors().leftCols(result.determined);
    SmallMatrix variance = spread.eigenvalues().head(result.determined).cwiseMax(kMinVariance).asDiagonal();
    // The fronto-parallel bias of the relief moves the estimate by millimetres. It does not average out, so it is added
    // to the covariance, but it has no influence on which directions are determined.
    const SmallVector moved =
        determined.transpose() * (basis.transpose() * total * basis).llt().solve(basis.transpose() * common.relief);
    variance += moved * moved.transpose();
    result.information = basis * determined * variance.inverse() * determined.transpose() * basis.transpose();
    if (kept.size() == 6) {
      const Vector6d sigmas = (basis * *covariance * basis.transpose()).diagonal().cwiseSqrt();
      result.sigma_m = sigmas.head<3>().maxCoeff() * options.max_sigma_m;
      result.sigma_rad = sigmas.tail<3>().maxCoeff() * largest_rad;
    }
    break;
  }
  const Vector6d inverse = unit.cwiseInverse();
  result.information = inverse.asDiagonal() * result.information * inverse.asDiagonal();
  return result;
}

MatchCost cost_of(std::span<const MatchedCell> cells, double cell_m, double scale, const MatchOptions& options) {
  struct Sum {
    double cost = 0, count = 0;
  };
  std::map<std::pair<int, int>, Sum> blocks;
  Sum all;
  for (const MatchedCell& cell : cells) {
    const double u = cell.residual_m / (options.robust_sigmas * scale * cell.sigma_m), cost = u * u / (1 + u * u);
    Sum& block = blocks[block_of(cell, cell_m, options.block_m)];
    block.cost += cost;
    block.count += 1;
    all.cost += cost;
    all.count += 1;
  }
  MatchCost result;
  const auto n = static_cast<double>(blocks.size());
  if (n < 2) return result;
  result.mean = all.cost / all.count;
  for (const auto& [place, block] : blocks) {
    const double off = block.cost - result.mean * block.count;
    result.variance += off * off;
  }
  result.variance *= n / (n - 1) / (all.count * all.count);
  return result;
}

}  // namespace spartan::internal
