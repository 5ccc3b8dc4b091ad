#include "spartan/calibration/internal/hypothesis_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "spartan/calibration/internal/model_modification.h"
#include "spartan/calibration/internal/row_errors.h"
#include "spartan/rig/describe.h"

namespace spartan::internal {
namespace {

// The constants of this search are empirical; the tests with injected calibration errors and the real pairs of
// docs/benchmarks/calibration.md check them.
//
// Cost ratios. A hypothesis with one more error is preferred if its cost is below kClearlyLower of the present cost. A
// size that the calibration's own numbers suggest is applied unless its cost is above kClearlyHigher of that without
// it. A hypothesis that makes negative disparities positive may cost up to kMuchHigher of the present one.
constexpr double kClearlyLower = 0.6, kClearlyHigher = 1.4, kMuchHigher = 3;
// Cost per match of applying a correction, in units of squared normalized row errors (σ = kRowSigma_px).
constexpr double kCorrectionPenalty = 0.5;
constexpr int kMaxErrors = 3;  // search depth: errors that one calibration may have at the same time
// RMS row error after a typical correction; largest RMS of a consistent hypothesis; its smallest share of inliers.
constexpr double kGoodRows_px = 0.5, kUsableRows_px = 1.25, kMinInlierShare = 0.5;
// Limits of a plausible correction: larger ones mean that the calibration has another error.
constexpr double kMaxRotation_rad = 12 * std::numbers::pi / 180, kMaxRadial = 1, kMaxLogFocalRatio = 0.1;
// Prior penalty of a typical correction: a quarter of these limits.
constexpr double kTypicalPenalty = 0.25;
// Largest fitted yaw that is applied before the signs of the disparities are tested.
constexpr double kMaxYawForSides_rad = 3 * std::numbers::pi / 180;
constexpr std::ptrdiff_t kSearchMatches = 250;  // matches with which hypotheses are ranked; the final fit uses all

// The largest of the correction's components relative to its limit: 1 at the limit of a plausible correction.
double prior_penalty(const PairCorrection& c) {
  const double rotation = std::max({std::abs(c.pitch_rad), std::abs(c.yaw_rad), std::abs(c.roll_rad),
                                    std::abs(c.baseline_down_rad), std::abs(c.baseline_ahead_rad)});
  const double radial = std::max(std::abs(c.left_radial), std::abs(c.right_radial));
  return std::max(
      {rotation / kMaxRotation_rad, radial / kMaxRadial, std::abs(std::log(c.focal_ratio)) / kMaxLogFocalRatio});
}

// An evenly spaced subset of at most kSearchMatches.
std::vector<PixelMatch> subset_of(const std::vector<PixelMatch>& matches) {
  const std::ptrdiff_t count = std::ssize(matches), wanted = std::min(count, kSearchMatches);
  std::vector<PixelMatch> subset;
  subset.reserve(static_cast<std::size_t>(wanted));
  for (std::ptrdiff_t i = 0; i < wanted; ++i) subset.push_back(matches[static_cast<std::size_t>(i * count / wanted)]);
  return subset;
}

// Share of the inliers with negative disparity. A yaw shifts all disparities, so only a small one may decide which
// camera is on the left: the part of the fitted yaw beyond kMaxYawForSides_rad is taken out again.
double negative_disparity_share(const PairFit& fit, const std::vector<double>& disparity_px, double yaw_rad) {
  const double excess_px =
      fit.rows.focal_px * (yaw_rad - std::clamp(yaw_rad, -kMaxYawForSides_rad, kMaxYawForSides_rad));
  int negative = 0;
  for (std::size_t i = 0; i < fit.inlier.size(); ++i)
    negative += fit.inlier[i] && disparity_px[i] + excess_px < kNegativeDisparity_px ? 1 : 0;
  return fit.inliers > 0 ? static_cast<double>(negative) / fit.inliers : 0;
}

bool has_plausible_focal_lengths(const PairHypothesis& hypothesis) {
  return has_plausible_focal_length(hypothesis.left) && has_plausible_focal_length(hypothesis.right);
}

bool has_positive_disparities(const FittedHypothesis& pair) {
  return pair.negative_share <= 0.5;
}

FittedHypothesis fit_hypothesis(PairHypothesis hypothesis, const std::vector<PixelMatch>& matches) {
  FittedHypothesis pair{std::move(hypothesis), {}, {}};
  const PairHypothesis& h = pair.hypothesis;
  pair.matches = matches_under_hypothesis(h, matches);
  pair.fit = fit_pair(h.left.model, h.right.model, h.left_from_right, pair.matches, fit_options(h));
  const RectifiedMatches& given = pair.fit.given;
  pair.rows_good = are_good(row_errors(inliers_of(given.row_error_px, pair.fit.inlier)));
  const double cost_given = truncated_row_cost(given.row_error_px),
               cost_corrected = pair.fit.cost + kCorrectionPenalty * static_cast<double>(matches.size());
  pair.uncorrected = cost_given <= cost_corrected;
  pair.cost = std::min(cost_given, cost_corrected);
  for (const double row : pair.uncorrected ? given.row_error_px : pair.fit.rows.row_error_px)
    pair.saturated += row * row < kMaxRowCost * kRowSigma_px * kRowSigma_px ? 0 : 1;
  pair.negative_share =
      pair.uncorrected ? negative_disparity_share(pair.fit, given.disparity_px, 0)
                       : negative_disparity_share(pair.fit, pair.fit.rows.disparity_px, pair.fit.correction.yaw_rad);
  const bool agree = pair.fit.inliers >= kMinInlierShare * static_cast<double>(matches.size()) &&
                     has_positive_disparities(pair) && has_plausible_focal_lengths(h);
  pair.consistent = agree && pair.fit.rms_px <= kUsableRows_px;
  pair.accepted = pair.consistent && ((pair.uncorrected && pair.rows_good) || prior_penalty(pair.fit.correction) <= 1);
  return pair;
}

// Good rows after a correction of the size that calibrations usually need.
bool has_typical_correction(const FittedHypothesis& pair) {
  return pair.accepted && pair.fit.rms_px <= kGoodRows_px && prior_penalty(pair.fit.correction) <= kTypicalPenalty;
}

bool needs_no_search(const FittedHypothesis& pair) {
  return has_typical_correction(pair) && pair.uncorrected;
}

// --- sizes ---

// A size factor closer to one than this is not another image size.
constexpr double kMinLogFactor = 0.08;

// The size factor of least uncorrected row cost, without a fit so that many factors can be tried. One where no factor
// is possible.
double best_uncorrected_factor(const PairHypothesis& before, SizeChange size, const std::vector<PixelMatch>& matches,
                               double low, double high, double step) {
  const std::vector<PixelMatch> oriented = matches_under_hypothesis(before, matches);
  double best = 1, least = std::numeric_limits<double>::infinity();
  for (double log_factor = std::log(low); log_factor <= std::log(high); log_factor += step) {
    if (std::abs(log_factor) < kMinLogFactor) continue;
    size.factor = std::exp(log_factor);
    const PairHypothesis hypothesis = with_size(before, size, matches);
    if (!has_plausible_focal_lengths(hypothesis)) continue;
    const double cost = truncated_row_cost(
        rectify_matches(hypothesis.left.model, hypothesis.right.model, hypothesis.left_from_right, oriented)
            .row_error_px);
    if (cost < least) {
      least = cost;
      best = size.factor;
    }
  }
  return best;
}

constexpr double kMaxFactor = 3;  // range of size factors: 1/3 to 3

// For each combination of cameras and centre: the factor of least uncorrected row cost, or (`coarse`) a series of
// factors from 1/3 to 3, for pairs with more errors than the size. A factor common to two pinholes does not change
// their rows and is not tried.
std::vector<PairHypothesis> size_hypotheses(const PairHypothesis& hypothesis, const std::vector<PixelMatch>& matches,
                                            bool coarse) {
  constexpr int kSteps = 11;                       // to either side of one
  constexpr double kStep = 0.1, kFineStep = 0.02;  // of the logarithm
  const bool both_linear = is_distortion_free(hypothesis.left) && is_distortion_free(hypothesis.right);
  std::vector<PairHypothesis> hypotheses;
  if (hypothesis.size.any()) return hypotheses;
  const auto take = [&](const SizeChange& size) {
    PairHypothesis sized = with_size(hypothesis, size, matches);
    if (size.factor != 1 && has_plausible_focal_lengths(sized)) hypotheses.push_back(std::move(sized));
  };
  for (const bool scale_centre : {true, false}) {
    for (const auto& [left, right] : {std::pair{true, true}, {true, false}, {false, true}}) {
      if (both_linear && left && right) continue;
      SizeChange size{left, right, scale_centre, 1};
      if (!coarse) {
        size.factor = best_uncorrected_factor(hypothesis, size, matches, 1 / kMaxFactor, kMaxFactor, kFineStep);
        take(size);
        continue;
      }
      for (int i = -kSteps; i <= kSteps; ++i) {
        size.factor = std::exp(kStep * i);
        take(size);
      }
    }
  }
  return hypotheses;
}

// The ratio of small integers p/q, q ≤ 4, within `tolerance` (of the logarithm) of the factor, if there is one.
std::optional<double> simple_factor(double factor, double tolerance) {
  for (int q = 1; q <= 4; ++q) {
    const double simple = std::round(factor * q) / q;
    if (std::abs(std::log(simple / factor)) < tolerance) return simple;
  }
  return std::nullopt;
}

// The factor of least cost within kReach of a rough one. Image sizes are usually in simple proportions: a simple factor
// is preferred where its cost is at most kAsGood times the least one.
FittedHypothesis refined_size(const PairHypothesis& before, const SizeChange& rough,
                              const std::vector<PixelMatch>& matches) {
  const auto with_factor = [&](double factor) {
    SizeChange size = rough;
    size.factor = factor;
    return fit_hypothesis(with_size(before, size, matches), matches);
  };
  constexpr double kReach = 0.1, kStep = 0.02, kFineStep = 0.002, kNearSimple = 0.02, kAsGood = 1.1;
  FittedHypothesis best = with_factor(best_uncorrected_factor(before, rough, matches, rough.factor * std::exp(-kReach),
                                                              rough.factor * std::exp(kReach), kFineStep));
  for (double away = -kReach; !best.uncorrected && away <= kReach; away += kStep) {
    FittedHypothesis tried = with_factor(rough.factor * std::exp(away));
    if (tried.cost < best.cost) best = std::move(tried);
  }
  // For one camera alone the fitted focal ratio refines the factor.
  const double ratio = best.fit.correction.focal_ratio;
  if (rough.left != rough.right && !best.uncorrected)
    best = with_factor(best.hypothesis.size.factor * (rough.right ? ratio : 1 / ratio));
  if (const auto simple = simple_factor(best.hypothesis.size.factor, kNearSimple)) {
    FittedHypothesis as_simple = with_factor(*simple);
    if (as_simple.cost < kAsGood * best.cost) return as_simple;
  }
  return best;
}

// --- the search ---

// The hypothesis with one further error, other than a size, removed. A row shift is estimated anew.
std::vector<PairHypothesis> alternative_hypotheses(const PairHypothesis& hypothesis,
                                                   const std::vector<PixelMatch>& matches, bool calibrated) {
  const PairHypothesis given = without_row_shift(hypothesis);
  std::vector<PairHypothesis> alternatives{with_images_swapped(given)};
  const bool left_linear = is_distortion_free(given.left), right_linear = is_distortion_free(given.right);
  if ((left_linear || right_linear) && !given.fit_left_radial && !given.fit_right_radial) {
    alternatives.push_back(given);
    alternatives.back().fit_left_radial = left_linear;
    alternatives.back().fit_right_radial = right_linear;
  }
  if (calibrated) {
    alternatives.push_back(with_cameras_swapped(given));
    alternatives.push_back(with_images_swapped(with_cameras_swapped(given)));
    for (PairHypothesis& square : square_pixel_hypotheses(given, AspectDeviation::notable))
      alternatives.push_back(std::move(square));
  }
  if (hypothesis.row_shift_px != 0) {
    for (PairHypothesis& alternative : alternatives) alternative = with_row_shift(std::move(alternative), matches);
  }
  return alternatives;
}

// Whether another hypothesis replaces the present one. Its cost must be below kClearlyLower of the present one; merely
// lower where it makes bad rows agree without a correction; below kMuchHigher where the present one has negative
// disparities. The cost of matches that saturate under both is subtracted first: outliers do not discriminate.
// `now_same_matches`: the present hypothesis, fitted to the matches of `other`.
bool is_preferred(const FittedHypothesis& other, const FittedHypothesis& now,
                  const FittedHypothesis& now_same_matches) {
  const double outlier_cost = kMaxRowCost * std::min(other.saturated, now_same_matches.saturated);
  const double cost = other.cost - outlier_cost, cost_now = now_same_matches.cost - outlier_cost;
  if (!has_positive_disparities(now)) return cost < kMuchHigher * cost_now;
  return cost < (other.uncorrected && !now.uncorrected && !now.rows_good ? 1 : kClearlyLower) * cost_now;
}

// Ranks several candidates, with the same preference for the simpler one.
double ranking_cost(const FittedHypothesis& pair) {
  return (pair.uncorrected || has_typical_correction(pair) ? kClearlyLower : 1) * pair.cost;
}

// The best hypothesis with one further error removed, where it is preferred to the present one. A subset of the matches
// selects the candidates; all matches decide among the best of them.
std::optional<FittedHypothesis> next_hypothesis(const FittedHypothesis& now, const std::vector<PixelMatch>& matches,
                                                bool calibrated) {
  constexpr std::size_t kMaxCandidates = 3;
  const std::vector<PixelMatch> subset = subset_of(matches);
  const FittedHypothesis now_subset = fit_hypothesis(now.hypothesis, subset);
  std::vector<FittedHypothesis> candidates;
  const auto try_all = [&](std::vector<PairHypothesis> alternatives) {
    for (PairHypothesis& alternative : alternatives) {
      FittedHypothesis tried = fit_hypothesis(std::move(alternative), subset);
      if (has_positive_disparities(tried) && is_preferred(tried, now, now_subset))
        candidates.push_back(std::move(tried));
    }
  };
  try_all(alternative_hypotheses(now.hypothesis, subset, calibrated));
  if (calibrated) try_all(size_hypotheses(now.hypothesis, subset, false));
  // A small rotation is likelier than a vertical shift, so a shift is tried only where no typical correction suffices.
  if (calibrated && now.hypothesis.row_shift_px == 0 && !has_typical_correction(now))
    try_all({with_row_shift(now.hypothesis, subset)});
  const bool simple =
      std::any_of(candidates.begin(), candidates.end(), [](const FittedHypothesis& p) { return p.uncorrected; });
  if (calibrated && !simple && !has_typical_correction(now)) try_all(size_hypotheses(now.hypothesis, subset, true));
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return ranking_cost(a) < ranking_cost(b); });
  std::optional<FittedHypothesis> best;
  for (std::size_t i = 0; i < std::min(candidates.size(), kMaxCandidates); ++i) {
    const PairHypothesis& hypothesis = candidates[i].hypothesis;
    const bool sized = hypothesis.size.any() && !now.hypothesis.size.any();
    FittedHypothesis candidate = sized ? refined_size(now.hypothesis, hypothesis.size, matches)
                                 : hypothesis.row_shift_px != 0
                                     ? fit_hypothesis(with_row_shift(hypothesis, matches), matches)
                                     : fit_hypothesis(hypothesis, matches);
    if (sized && std::abs(std::log(candidate.hypothesis.size.factor)) < kMinLogFactor) continue;
    if (!has_positive_disparities(candidate) || !is_preferred(candidate, now, now)) continue;
    if (!best || ranking_cost(candidate) < ranking_cost(*best)) best = std::move(candidate);
  }
  return best;
}

// Applies what the calibration's own numbers suggest (principal points in the image centre, square pixels) unless that
// costs clearly more.
FittedHypothesis with_plausible_size(const FittedHypothesis& given, const std::vector<PixelMatch>& matches) {
  constexpr double kNearSimple = 0.1;  // wide: a principal point is rarely the exact image centre
  std::vector<FittedHypothesis> possible;
  const auto left = size_factor_from_centre(given.hypothesis.left),
             right = size_factor_from_centre(given.hypothesis.right);
  const double from_centre = left.value_or(right.value_or(1)),
               factor = simple_factor(from_centre, kNearSimple).value_or(from_centre);
  for (const auto& [of_left, of_right] : {std::pair{true, true}, {left.has_value(), right.has_value()}}) {
    if (!left && !right) break;
    const SizeChange size{of_left, of_right, true, factor};
    const PairHypothesis hypothesis = with_size(given.hypothesis, size, matches);
    possible.push_back(fit_hypothesis(hypothesis, matches));
    const bool observable =
        !(of_left && of_right && is_distortion_free(hypothesis.left) && is_distortion_free(hypothesis.right));
    if (observable && !possible.back().uncorrected) possible.push_back(refined_size(given.hypothesis, size, matches));
    for (FittedHypothesis& pair : possible) pair.hypothesis.size_from_plausibility = true;
  }
  for (PairHypothesis& square : square_pixel_hypotheses(given.hypothesis, AspectDeviation::implausible))
    possible.push_back(fit_hypothesis(std::move(square), matches));
  const FittedHypothesis* best = nullptr;
  for (const FittedHypothesis& tried : possible) {
    if (tried.cost < (best ? best->cost : kClearlyHigher * given.cost)) best = &tried;
  }
  return best ? *best : given;
}

// A fitted focal ratio near its limit means that the calibration of one of the two cameras is of another image size.
// The centre is scaled only where that lowers the cost by a tenth.
FittedHypothesis with_one_camera_resized(const FittedHypothesis& now, const std::vector<PixelMatch>& matches) {
  const double ratio = now.fit.correction.focal_ratio;
  if (now.hypothesis.size.any() || std::abs(std::log(ratio)) < 0.8 * kMaxLogFocalRatio) return now;
  std::optional<FittedHypothesis> best;
  for (const bool right : {true, false}) {
    for (const bool scale_centre : {false, true}) {
      FittedHypothesis tried =
          refined_size(now.hypothesis, {!right, right, scale_centre, right ? ratio : 1 / ratio}, matches);
      if (!best || tried.cost < 0.9 * best->cost) best = std::move(tried);
    }
  }
  return best->cost < now.cost ? *best : now;
}

// For two pinholes a focal length factor on one camera and its inverse on the other have the same effect on rows.
bool is_size_unambiguous(const FittedHypothesis& best, const std::vector<PixelMatch>& matches) {
  const SizeChange& size = best.hypothesis.size;
  if (size.left == size.right) return true;
  const SizeChange back{size.left, size.right, size.scale_centre, 1 / size.factor},
      other{!size.left, !size.right, size.scale_centre, 1 / size.factor};
  return fit_hypothesis(with_size(with_size(best.hypothesis, back, matches), other, matches), matches).cost >
         kClearlyHigher * best.cost;
}

// Decides between an inverse transform and swapped cameras by cost. Where neither costs clearly less, the simpler
// explanation is taken: with swapped images the swapped cameras (one error), otherwise the inverse transform.
FittedHypothesis resolve_sides(FittedHypothesis inverted, const std::vector<PixelMatch>& matches) {
  PairHypothesis swapped = with_cameras_swapped(without_row_shift(inverted.hypothesis));
  if (inverted.hypothesis.row_shift_px != 0) swapped = with_row_shift(std::move(swapped), matches);
  FittedHypothesis other = fit_hypothesis(std::move(swapped), matches);
  const auto [less, more] = std::minmax(inverted.cost, other.cost);
  const bool unambiguous = less < kClearlyLower * more;
  const bool take_other = unambiguous ? other.cost == less : inverted.hypothesis.images_swapped;
  inverted.sides_unambiguous = unambiguous;
  if (!take_other) return inverted;
  other.sides_unambiguous = true;
  return other;
}

}  // namespace

PairFitOptions fit_options(const PairHypothesis& hypothesis) {
  PairFitOptions options;
  options.left_radial = hypothesis.fit_left_radial;
  options.right_radial = hypothesis.fit_right_radial;
  return options;
}

FittedHypothesis find_hypothesis(const Camera& left, const Camera& right, const Pose& left_from_right,
                                 const std::vector<PixelMatch>& matches, ImageSize image_size, bool calibrated) {
  const PairHypothesis given = nominal_hypothesis(left, right, left_from_right, image_size);
  FittedHypothesis best = fit_hypothesis(with_right_camera_on_right(given), matches);
  if (best.hypothesis.inverted) best = resolve_sides(std::move(best), matches);
  const bool sides_unambiguous = best.sides_unambiguous;
  const std::vector<double> nominal_rows_px = best.fit.given.row_error_px;
  best = with_plausible_size(best, matches);
  for (int errors = 0; errors < kMaxErrors && !needs_no_search(best); ++errors) {
    std::optional<FittedHypothesis> next = next_hypothesis(best, matches, calibrated);
    if (!next) break;
    best = std::move(*next);
  }
  if (calibrated) best = with_one_camera_resized(best, matches);
  if (!calibrated) best.accepted = best.consistent;  // a guess may need any correction
  // Other errors, now removed, may have hidden which side the cameras are on.
  if (!sides_unambiguous && best.hypothesis.inverted) best = resolve_sides(std::move(best), matches);
  best.size_unambiguous = is_size_unambiguous(best, matches);
  best.nominal_rows_px = row_errors(inliers_of(nominal_rows_px, best.fit.inlier)).mean_px;
  const RectifiedMatches& rows = best.uncorrected ? best.fit.given : best.fit.rows;
  best.rows_px = row_errors(inliers_of(rows.row_error_px, best.fit.inlier)).mean_px;
  return best;
}

}  // namespace spartan::internal
