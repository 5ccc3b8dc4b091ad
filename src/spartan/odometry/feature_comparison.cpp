#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>

#include "spartan/core/stage_clock.h"
#include "spartan/numerics/median.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/internal/matching/descriptor_matches.h"
#include "spartan/odometry/internal/matching/view_transfer.h"
#include "spartan/odometry/view_matching.h"

namespace spartan {

using namespace internal;

namespace {

constexpr double kBorder_px = 32;
/// Border of small images, fraction of the shorter side.
constexpr double kBorderFraction = 0.125;

double border_of(ImageSize size) {
  return std::min(kBorder_px, kBorderFraction * std::min(size.width, size.height));
}

bool is_inside(const Eigen::Vector2d& p, ImageSize size, double border) {
  return p.x() >= border && p.y() >= border && p.x() <= size.width - 1 - border && p.y() <= size.height - 1 - border;
}

/// 255 where both images show the scene.
Image<std::uint8_t> common_part(ImageSize size, ImageSize other, const Eigen::Matrix3d& other_from_image) {
  Image<std::uint8_t> mask(size);
  const double border = border_of(size), other_border = border_of(other);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const auto p = transferred(other_from_image, {x, y});
      const bool common = is_inside({x, y}, size, border) && p && is_inside(*p, other, other_border);
      mask(x, y) = common ? 255 : 0;
    }
  }
  return mask;
}

std::vector<Eigen::Vector2f> positions_of(const std::vector<Feature>& features) {
  std::vector<Eigen::Vector2f> positions;
  positions.reserve(features.size());
  for (const Feature& f : features) positions.emplace_back(f.x, f.y);
  return positions;
}

/// Number of pairs of features at corresponding places, the nearest first, each feature in one pair at most.
int count_repeated(const ViewTransfer& transfer, double tolerance_px, const FeatureComparison& c) {
  struct Pair {
    double error;
    std::size_t first, second;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < c.first.size(); ++i) {
    for (std::size_t k = 0; k < c.second.size(); ++k) {
      const double error = transfer.error(c.first[i].cast<double>(), c.second[k].cast<double>());
      if (error <= tolerance_px) pairs.push_back({error, i, k});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tie(a.error, a.first, a.second) < std::tie(b.error, b.first, b.second);
  });
  std::vector<bool> first_used(c.first.size()), second_used(c.second.size());
  int count = 0;
  for (const Pair& pair : pairs) {
    if (first_used[pair.first] || second_used[pair.second]) continue;
    first_used[pair.first] = second_used[pair.second] = true;
    ++count;
  }
  return count;
}

}  // namespace

FeatureComparison match_features(ImageView<const std::uint8_t> first, ImageView<const std::uint8_t> second,
                                 const std::optional<ImageRelation>& geometry, const FeatureComparisonOptions& options,
                                 const ThreadPool& workers) {
  Image<std::uint8_t> first_mask, second_mask;
  if (geometry && geometry->kind == ImageRelation::Kind::homography) {
    first_mask = common_part(first.size(), second.size(), geometry->matrix);
    second_mask = common_part(second.size(), first.size(), geometry->matrix.inverse());
  }
  const std::unique_ptr<LandmarkDetector> detector = make_landmark_detector(options.detection, workers);
  const std::vector<Feature> in_second = detector->detect(second, second_mask);
  std::vector<Feature> in_first;
  std::vector<double> times_ms;
  for (int i = 0; i < std::max(options.repetitions, 1); ++i) {
    Stopwatch watch;
    const std::vector<Feature>& found = detector->detect(first, first_mask);
    times_ms.push_back(watch.lap());
    if (i == 0) in_first = found;
  }
  FeatureComparison result;
  result.first = positions_of(in_first);
  result.second = positions_of(in_second);
  result.time_ms = median(times_ms);
  for (const DescriptorMatch& match : mutual_matches(in_first, in_second, options.descriptor_ratio, workers))
    result.matches.push_back({match.first, match.second, false});
  return result;
}

void score_features(const ImageRelation& geometry, double tolerance_px, FeatureComparison& comparison) {
  const ViewTransfer transfer(geometry);
  comparison.correct = 0;
  for (FeatureComparison::Match& match : comparison.matches) {
    const Eigen::Vector2f &first = comparison.first[static_cast<std::size_t>(match.first)],
                          &second = comparison.second[static_cast<std::size_t>(match.second)];
    match.correct = transfer.error(first.cast<double>(), second.cast<double>()) <= tolerance_px;
    comparison.correct += match.correct ? 1 : 0;
  }
  const auto features = static_cast<double>(std::min(comparison.first.size(), comparison.second.size()));
  comparison.repeatability.reset();
  comparison.precision.reset();
  comparison.matching_score.reset();
  if (!comparison.matches.empty())
    comparison.precision = comparison.correct / static_cast<double>(comparison.matches.size());
  if (features == 0) return;
  comparison.matching_score = comparison.correct / features;
  if (geometry.kind == ImageRelation::Kind::homography)
    comparison.repeatability = count_repeated(transfer, tolerance_px, comparison) / features;
}

}  // namespace spartan
