#include "spartan/slam/match_evidence.h"

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

#include "spartan/core/median.h"

namespace spartan {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kLeastVariance = 1e-4;  // of what is believed at all

// Square of the lattice that a cell lies in.
std::pair<int, int> block_of(const MatchedCell& cell, double cell_m, double block_m) {
  const int side = std::max(1, static_cast<int>(std::lround(block_m / cell_m)));
  return {cell.row / side, cell.column / side};
}

struct Block {
  Matrix6d curvature = Matrix6d::Zero();
  Vector6d score = Vector6d::Zero();
};

// In units of the largest standard deviations that are believed, so that 1 is the border everywhere.
std::vector<Block> blocks_of(std::span<const MatchedCell> cells, double cell_m, const Vector6d& unit,
                             const MatchOptions& options) {
  std::map<std::pair<int, int>, Block> blocks;
  for (const MatchedCell& cell : cells) {
    Block& block = blocks[block_of(cell, cell_m, options.block_m)];
    const Vector6d a = cell.by_local.cwiseProduct(unit), b = cell.by_global.cwiseProduct(unit);
    // Of two independent slopes the product has no bias by their noise; a square would find relief on a plain.
    const Matrix6d product = a * b.transpose();
    block.curvature += (0.5 * cell.curvature) * (product + product.transpose());
    block.score += (0.5 * cell.weight * cell.residual_m) * (a + b);
  }
  std::vector<Block> list;
  list.reserve(blocks.size());
  for (const auto& [place, block] : blocks) list.push_back(block);
  return list;
}

// Scores of the residuals that common errors of the disparities make.
struct CommonScores {
  std::vector<Vector6d> areas;
  Vector6d relief = Vector6d::Zero();
};

CommonScores common_scores(std::span<const MatchedCell> cells, double cell_m, const Vector6d& unit, double misfit,
                           const MatchOptions& options) {
  std::map<std::pair<int, int>, Vector6d> areas;
  CommonScores scores;
  for (const MatchedCell& cell : cells) {
    Vector6d& score = areas.try_emplace(block_of(cell, cell_m, options.common_reach_m), Vector6d::Zero()).first->second;
    const Vector6d weighted = (cell.weight * misfit) * cell.jacobian().cwiseProduct(unit);
    score += (options.common_share * cell.common_m) * weighted;
    scores.relief += (options.relief_share * cell.relief_common_m) * weighted;
  }
  scores.areas.reserve(areas.size());
  for (const auto& [place, score] : areas) scores.areas.push_back(score);
  return scores;
}

// The curvature along an axis over its standard error, were there no relief and the blocks' parts chance (Efron 1969:
// the self-normalized sum is about normal, whatever the parts' distribution, if it is symmetric). A rock is no chance:
// parts count in the error with at most three of the others' standard deviations.
double relief_of(const std::vector<Block>& blocks, const Vector6d& axis) {
  constexpr double kMostSigmas = 3;
  std::vector<double> parts, sizes;
  parts.reserve(blocks.size());
  sizes.reserve(blocks.size());
  for (const Block& block : blocks) {
    parts.push_back(axis.dot(block.curvature * axis));
    sizes.push_back(std::abs(parts.back()));
  }
  if (parts.empty()) return 0;
  const double most = kMostSigmas * median(sizes) / 0.6745;
  double sum = 0, squares = 0;
  for (const double part : parts) {
    sum += part;
    squares += std::min(part * part, most * most);
  }
  return squares > 0 ? sum / std::sqrt(squares) : 0;
}

// Covariance in the directions of the basis: what the answer would have been without each of the blocks, to first
// order, and what the areas' common errors do to it. None where one block alone holds a direction.
std::optional<Eigen::MatrixXd> jackknife(const std::vector<Block>& blocks, const std::vector<Vector6d>& common,
                                         const Matrix6d& total, const Eigen::MatrixXd& basis) {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(basis.cols(), basis.cols());
  for (const Block& block : blocks) {
    const Eigen::LLT<Eigen::MatrixXd> rest(basis.transpose() * (total - block.curvature) * basis);
    if (rest.info() != Eigen::Success) return std::nullopt;
    const Eigen::VectorXd change = rest.solve(basis.transpose() * block.score);
    covariance += change * change.transpose();
  }
  const Eigen::LLT<Eigen::MatrixXd> all(basis.transpose() * total * basis);
  for (const Vector6d& score : common) {
    const Eigen::VectorXd change = all.solve(basis.transpose() * score);
    covariance += change * change.transpose();
  }
  return covariance;
}

}  // namespace

MatchEvidence weigh(std::span<const MatchedCell> cells, double cell_m, const MatchOptions& options) {
  MatchEvidence evidence;
  evidence.cells = static_cast<int>(cells.size());
  evidence.misfit = misfit_of(cells);
  evidence.sigma_m = evidence.sigma_rad = kInfinite;
  const double largest_rad = options.largest_sigma_deg * std::numbers::pi / 180;
  Vector6d unit;
  unit << Eigen::Vector3d::Constant(options.largest_sigma_m), Eigen::Vector3d::Constant(largest_rad);
  const std::vector<Block> blocks = blocks_of(cells, cell_m, unit, options);
  evidence.blocks = static_cast<int>(blocks.size());
  const CommonScores common = common_scores(cells, cell_m, unit, evidence.misfit, options);
  Matrix6d total = Matrix6d::Zero();
  for (const Block& block : blocks) total += block.curvature;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> axes(total);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (relief_of(blocks, axes.eigenvectors().col(k)) >= options.relief_certainty) kept.push_back(k);
  }
  // Directions with the least curvature are given up until none of the others hangs on a single block.
  for (; !kept.empty(); kept.erase(kept.begin())) {
    const Eigen::MatrixXd basis = axes.eigenvectors()(Eigen::all, kept);
    const auto covariance = jackknife(blocks, common.areas, total, basis);
    if (!covariance) continue;
    // Eigenvalues rise: the determined directions are the first.
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> spread(*covariance);
    evidence.determined = static_cast<int>((spread.eigenvalues().array() <= 1).count());
    const Eigen::MatrixXd determined = spread.eigenvectors().leftCols(evidence.determined);
    Eigen::MatrixXd variance = spread.eigenvalues().head(evidence.determined).cwiseMax(kLeastVariance).asDiagonal();
    // Relief that stands off moves the answer by millimetres, which decides nothing, but for good.
    const Eigen::VectorXd moved =
        determined.transpose() * (basis.transpose() * total * basis).llt().solve(basis.transpose() * common.relief);
    variance += moved * moved.transpose();
    evidence.information = basis * determined * variance.inverse() * determined.transpose() * basis.transpose();
    if (kept.size() == 6) {
      const Vector6d sigmas = (basis * *covariance * basis.transpose()).diagonal().cwiseSqrt();
      evidence.sigma_m = sigmas.head<3>().maxCoeff() * options.largest_sigma_m;
      evidence.sigma_rad = sigmas.tail<3>().maxCoeff() * largest_rad;
    }
    break;
  }
  const Vector6d inverse = unit.cwiseInverse();
  evidence.information = inverse.asDiagonal() * evidence.information * inverse.asDiagonal();
  return evidence;
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

}  // namespace spartan
