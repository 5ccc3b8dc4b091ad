#include "spartan/rig/inspection/belief_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "spartan/rig/inspection/row_errors.h"
#include "spartan/rig/models/model_changes.h"
#include "spartan/rig/rig_findings.h"

namespace spartan {
namespace {

// A mistake is believed where the pictures cost less than this part of what they cost without it. What a calibration's
// own numbers make likely has the benefit of the doubt, and is put aside only where it costs clearly more. So has what
// brings the eyes to their sides.
constexpr double kClearlyCheaper = 0.6, kClearlyDearer = 1.4, kMuchDearer = 3;
constexpr double kCorrected = 0.5;
constexpr int kMostMistakes = 3;
constexpr double kGoodRows_px = 0.5, kUsableRows_px = 1.25, kLeastShare = 0.5;
// Farther than this nobody's calibration is off without another mistake; a fraction of it needs no explanation.
constexpr double kLargestTurn_rad = 12 * std::numbers::pi / 180, kLargestRadial = 1, kLargestFocal = 0.1;
constexpr double kUsual = 0.25;
constexpr double kLargestYaw_rad = 3 * std::numbers::pi / 180;
constexpr std::ptrdiff_t kSearchMatches = 250;

// 1: as large as a correction may be.
double strangeness(const PairCorrection& c) {
  const double turn = std::max({std::abs(c.pitch_rad), std::abs(c.yaw_rad), std::abs(c.roll_rad),
                                std::abs(c.baseline_down_rad), std::abs(c.baseline_ahead_rad)});
  const double radial = std::max(std::abs(c.left_radial), std::abs(c.right_radial));
  return std::max(
      {turn / kLargestTurn_rad, radial / kLargestRadial, std::abs(std::log(c.focal_ratio)) / kLargestFocal});
}

// Evenly chosen.
std::vector<PixelMatch> some_of(const std::vector<PixelMatch>& matches) {
  const std::ptrdiff_t count = std::ssize(matches), wanted = std::min(count, kSearchMatches);
  std::vector<PixelMatch> some;
  some.reserve(static_cast<std::size_t>(wanted));
  for (std::ptrdiff_t i = 0; i < wanted; ++i) some.push_back(matches[static_cast<std::size_t>(i * count / wanted)]);
  return some;
}

// A fitted yaw shifts all disparities: more than a small one must not decide on which side an eye stands.
double share_on_the_wrong_side(const PairFit& fit, const std::vector<double>& disparity_px, double yaw_rad) {
  const double excess_px = fit.rows.focal_px * (yaw_rad - std::clamp(yaw_rad, -kLargestYaw_rad, kLargestYaw_rad));
  int wrong = 0;
  for (std::size_t i = 0; i < fit.inlier.size(); ++i)
    wrong += fit.inlier[i] && disparity_px[i] + excess_px < kBeyondInfinity_px ? 1 : 0;
  return fit.inliers > 0 ? static_cast<double>(wrong) / fit.inliers : 0;
}

bool has_possible_views(const PairBelief& belief) {
  return has_possible_focal(belief.left) && has_possible_focal(belief.right);
}

bool passes(const BelievedPair& pair) {
  return pair.wrong_side <= 0.5;
}

BelievedPair fitted(PairBelief belief, const std::vector<PixelMatch>& matches) {
  BelievedPair pair{std::move(belief), {}, {}};
  const PairBelief& b = pair.belief;
  pair.matches = as_believed(b, matches);
  pair.fit = fit_pair(b.left.model, b.right.model, b.left_from_right, pair.matches, fit_options(b));
  const RectifiedMatches& given = pair.fit.given;
  pair.good_rows = are_good(row_errors(inliers_of(given.row_error_px, pair.fit.inlier)));
  const double cost_given = cost_of_rows(given.row_error_px),
               cost_corrected = pair.fit.cost + kCorrected * static_cast<double>(matches.size());
  pair.as_it_is = cost_given <= cost_corrected;
  pair.cost = std::min(cost_given, cost_corrected);
  for (const double row : pair.as_it_is ? given.row_error_px : pair.fit.rows.row_error_px)
    pair.lost += row * row < kMostOfARow * kRowUnit_px * kRowUnit_px ? 0 : 1;
  pair.wrong_side = pair.as_it_is
                        ? share_on_the_wrong_side(pair.fit, given.disparity_px, 0)
                        : share_on_the_wrong_side(pair.fit, pair.fit.rows.disparity_px, pair.fit.correction.yaw_rad);
  const bool agree =
      pair.fit.inliers >= kLeastShare * static_cast<double>(matches.size()) && passes(pair) && has_possible_views(b);
  pair.agrees = agree && pair.fit.rms_px <= kUsableRows_px;
  pair.explains = pair.agrees && ((pair.as_it_is && pair.good_rows) || strangeness(pair.fit.correction) <= 1);
  return pair;
}

// Good rows by a correction as calibrations need it.
bool has_ordinary_fit(const BelievedPair& pair) {
  return pair.explains && pair.fit.rms_px <= kGoodRows_px && strangeness(pair.fit.correction) <= kUsual;
}

bool is_beyond_doubt(const BelievedPair& pair) {
  return has_ordinary_fit(pair) && pair.as_it_is;
}

// --- sizes ---

// Nearer to one a factor is no other picture size.
constexpr double kLeastLogFactor = 0.08;

// The size that makes the rows agree best as they are: no fit, so that many can be tried. One where none is possible.
double best_factor_as_it_is(const PairBelief& before, SizeChange size, const std::vector<PixelMatch>& matches,
                            double low, double high, double step) {
  const std::vector<PixelMatch> seen = as_believed(before, matches);
  double best = 1, least = std::numeric_limits<double>::infinity();
  for (double log_factor = std::log(low); log_factor <= std::log(high); log_factor += step) {
    if (std::abs(log_factor) < kLeastLogFactor) continue;
    size.factor = std::exp(log_factor);
    const PairBelief belief = with_size(before, size, matches);
    if (!has_possible_views(belief)) continue;
    const double cost =
        cost_of_rows(rectify_matches(belief.left.model, belief.right.model, belief.left_from_right, seen).row_error_px);
    if (cost < least) {
      least = cost;
      best = size.factor;
    }
  }
  return best;
}

constexpr double kLargestFactor = 3;

// For each kind the one that makes the rows agree best as they are, or (`coarse`) a row of them, for pairs with more
// mistakes than one. A factor common to two pinholes does not move their rows.
std::vector<PairBelief> beliefs_of_sizes(const PairBelief& belief, const std::vector<PixelMatch>& matches,
                                         bool coarse) {
  constexpr int kSteps = 11;
  constexpr double kStep = 0.1, kFineStep = 0.02;  // of the logarithm
  const bool both_linear = is_linear(belief.left) && is_linear(belief.right);
  std::vector<PairBelief> beliefs;
  if (belief.size.any()) return beliefs;
  const auto take = [&](const SizeChange& size) {
    PairBelief sized = with_size(belief, size, matches);
    if (size.factor != 1 && has_possible_views(sized)) beliefs.push_back(std::move(sized));
  };
  for (const bool centre_too : {true, false}) {
    for (const auto& [left, right] : {std::pair{true, true}, {true, false}, {false, true}}) {
      if (both_linear && left && right) continue;
      SizeChange size{left, right, centre_too, 1};
      if (!coarse) {
        size.factor = best_factor_as_it_is(belief, size, matches, 1 / kLargestFactor, kLargestFactor, kFineStep);
        take(size);
        continue;
      }
      for (int i = -kSteps; i <= kSteps; ++i) {
        size.factor = std::exp(kStep * i);
        take(size);
      }
    }
  }
  return beliefs;
}

// The simple proportion that is nearest, where one is near.
std::optional<double> simple_factor(double factor, double nearby) {
  for (int q = 1; q <= 4; ++q) {
    const double simple = std::round(factor * q) / q;
    if (std::abs(std::log(simple / factor)) < nearby) return simple;
  }
  return std::nullopt;
}

// The factor nearby that costs least. Sizes are in simple proportions: one that is as good counts.
BelievedPair refined_size(const PairBelief& before, const SizeChange& rough, const std::vector<PixelMatch>& matches) {
  const auto with_factor = [&](double factor) {
    SizeChange size = rough;
    size.factor = factor;
    return fitted(with_size(before, size, matches), matches);
  };
  constexpr double kReach = 0.1, kStep = 0.02, kFineStep = 0.002, kNearby = 0.02, kAsGood = 1.1;
  BelievedPair best = with_factor(best_factor_as_it_is(before, rough, matches, rough.factor * std::exp(-kReach),
                                                       rough.factor * std::exp(kReach), kFineStep));
  for (double away = -kReach; !best.as_it_is && away <= kReach; away += kStep) {
    BelievedPair tried = with_factor(rough.factor * std::exp(away));
    if (tried.cost < best.cost) best = std::move(tried);
  }
  // Of one eye alone the fit of its focal length goes further.
  const double further = best.fit.correction.focal_ratio;
  if (rough.left != rough.right && !best.as_it_is)
    best = with_factor(best.belief.size.factor * (rough.right ? further : 1 / further));
  if (const auto simple = simple_factor(best.belief.size.factor, kNearby)) {
    BelievedPair as_simple = with_factor(*simple);
    if (as_simple.cost < kAsGood * best.cost) return as_simple;
  }
  return best;
}

// --- the search ---

// What could be wrong with a belief beside sizes, one thing at a time. Rows that were moved are moved anew.
std::vector<PairBelief> further_mistakes(const PairBelief& belief, const std::vector<PixelMatch>& matches,
                                         bool calibrated) {
  const PairBelief given = with_rows_as_given(belief);
  std::vector<PairBelief> mistakes{with_other_pictures(given)};
  const bool left_linear = is_linear(given.left), right_linear = is_linear(given.right);
  if ((left_linear || right_linear) && !given.left_bends && !given.right_bends) {
    mistakes.push_back(given);
    mistakes.back().left_bends = left_linear;
    mistakes.back().right_bends = right_linear;
  }
  if (calibrated) {
    mistakes.push_back(with_other_eyes(given));
    mistakes.push_back(with_other_pictures(with_other_eyes(given)));
    for (PairBelief& square : with_square_eyes(given, AspectDoubt::some)) mistakes.push_back(std::move(square));
  }
  if (belief.rows_lower_px != 0) {
    for (PairBelief& mistake : mistakes) mistake = with_rows_moved(std::move(mistake), matches);
  }
  return mistakes;
}

// Whether another belief is believed instead: a mistake without which bad rows agree as they are needs to be no more
// than cheaper, and one that puts the eyes on their sides not even that. What both do not explain (matches that are
// none) says nothing about either.
bool is_believed_instead(const BelievedPair& other, const BelievedPair& now, const BelievedPair& now_by_same_matches) {
  const double both_lose = kMostOfARow * std::min(other.lost, now_by_same_matches.lost);
  const double cost = other.cost - both_lose, cost_now = now_by_same_matches.cost - both_lose;
  if (!passes(now)) return cost < kMuchDearer * cost_now;
  return cost < (other.as_it_is && !now.as_it_is && !now.good_rows ? 1 : kClearlyCheaper) * cost_now;
}

// The simpler one has the same advantage among several.
double weighed_cost(const BelievedPair& pair) {
  return (pair.as_it_is || has_ordinary_fit(pair) ? kClearlyCheaper : 1) * pair.cost;
}

// The belief with one more mistake taken out, where that makes the pictures clearly cheaper or the disparities
// positive; none where nothing does. A few matches choose what all of them are asked about.
std::optional<BelievedPair> with_next_mistake(const BelievedPair& now, const std::vector<PixelMatch>& matches,
                                              bool calibrated) {
  constexpr std::size_t kMostAsked = 3;
  const std::vector<PixelMatch> few = some_of(matches);
  const BelievedPair now_by_few = fitted(now.belief, few);
  std::vector<BelievedPair> likely;
  const auto try_all = [&](std::vector<PairBelief> mistakes) {
    for (PairBelief& mistake : mistakes) {
      BelievedPair tried = fitted(std::move(mistake), few);
      if (passes(tried) && is_believed_instead(tried, now, now_by_few)) likely.push_back(std::move(tried));
    }
  };
  try_all(further_mistakes(now.belief, few, calibrated));
  if (calibrated) try_all(beliefs_of_sizes(now.belief, few, false));
  // A turn is likelier than moved rows, as long as it is small.
  if (calibrated && now.belief.rows_lower_px == 0 && !has_ordinary_fit(now))
    try_all({with_rows_moved(now.belief, few)});
  const bool simple = std::any_of(likely.begin(), likely.end(), [](const BelievedPair& p) { return p.as_it_is; });
  if (calibrated && !simple && !has_ordinary_fit(now)) try_all(beliefs_of_sizes(now.belief, few, true));
  std::stable_sort(likely.begin(), likely.end(),
                   [](const auto& a, const auto& b) { return weighed_cost(a) < weighed_cost(b); });
  std::optional<BelievedPair> best;
  for (std::size_t i = 0; i < std::min(likely.size(), kMostAsked); ++i) {
    const PairBelief& belief = likely[i].belief;
    const bool sized = belief.size.any() && !now.belief.size.any();
    BelievedPair asked = sized                       ? refined_size(now.belief, belief.size, matches)
                         : belief.rows_lower_px != 0 ? fitted(with_rows_moved(belief, matches), matches)
                                                     : fitted(belief, matches);
    if (sized && std::abs(std::log(asked.belief.size.factor)) < kLeastLogFactor) continue;
    if (!passes(asked) || !is_believed_instead(asked, now, now)) continue;
    if (!best || weighed_cost(asked) < weighed_cost(*best)) best = std::move(asked);
  }
  return best;
}

// With what the calibration's own numbers suggest, where the pictures do not object: centres in the middle, square
// pixels.
BelievedPair with_stated_size(const BelievedPair& given, const std::vector<PixelMatch>& matches) {
  constexpr double kNearby = 0.1;
  std::vector<BelievedPair> possible;
  const auto left = size_told_by_centre(given.belief.left), right = size_told_by_centre(given.belief.right);
  const double told = left.value_or(right.value_or(1)), factor = simple_factor(told, kNearby).value_or(told);
  for (const auto& [of_left, of_right] : {std::pair{true, true}, {left.has_value(), right.has_value()}}) {
    if (!left && !right) break;
    const SizeChange size{of_left, of_right, true, factor};
    const PairBelief belief = with_size(given.belief, size, matches);
    possible.push_back(fitted(belief, matches));
    const bool rows_tell = !(of_left && of_right && is_linear(belief.left) && is_linear(belief.right));
    if (rows_tell && !possible.back().as_it_is) possible.push_back(refined_size(given.belief, size, matches));
    for (BelievedPair& pair : possible) pair.belief.stated_size = true;
  }
  for (PairBelief& square : with_square_eyes(given.belief, AspectDoubt::strong))
    possible.push_back(fitted(std::move(square), matches));
  const BelievedPair* best = nullptr;
  for (const BelievedPair& tried : possible) {
    if (tried.cost < (best ? best->cost : kClearlyDearer * given.cost)) best = &tried;
  }
  return best ? *best : given;
}

// A fit that wants another focal length for one eye by far: it is that eye's, or the other one's, of another size.
BelievedPair with_size_of_one_eye(const BelievedPair& now, const std::vector<PixelMatch>& matches) {
  const double ratio = now.fit.correction.focal_ratio;
  if (now.belief.size.any() || std::abs(std::log(ratio)) < 0.8 * kLargestFocal) return now;
  std::optional<BelievedPair> best;
  for (const bool right : {true, false}) {
    for (const bool centre_too : {false, true}) {
      BelievedPair tried = refined_size(now.belief, {!right, right, centre_too, right ? ratio : 1 / ratio}, matches);
      if (!best || tried.cost < 0.9 * best->cost) best = std::move(tried);
    }
  }
  return best->cost < now.cost ? *best : now;
}

// Rows of two pinholes do not tell a focal length of one from the inverse of it of the other.
bool is_size_told(const BelievedPair& best, const std::vector<PixelMatch>& matches) {
  const SizeChange& size = best.belief.size;
  if (size.left == size.right) return true;
  const SizeChange back{size.left, size.right, size.centre_too, 1 / size.factor},
      other{!size.left, !size.right, size.centre_too, 1 / size.factor};
  return fitted(with_size(with_size(best.belief, back, matches), other, matches), matches).cost >
         kClearlyDearer * best.cost;
}

// Whichever costs clearly less: an inverse transform, or eyes that are exchanged. Where neither does: names and
// pictures exchanged are one mistake, an inverse transform and exchanged pictures two.
BelievedPair with_eyes_told(BelievedPair inverted, const std::vector<PixelMatch>& matches) {
  PairBelief exchanged = with_other_eyes(with_rows_as_given(inverted.belief));
  if (inverted.belief.rows_lower_px != 0) exchanged = with_rows_moved(std::move(exchanged), matches);
  BelievedPair other = fitted(std::move(exchanged), matches);
  const auto [less, more] = std::minmax(inverted.cost, other.cost);
  const bool told = less < kClearlyCheaper * more;
  const bool take_other = told ? other.cost == less : inverted.belief.pictures_exchanged;
  inverted.eyes_told = told;
  if (!take_other) return inverted;
  other.eyes_told = true;
  return other;
}

}  // namespace

PairFitOptions fit_options(const PairBelief& belief) {
  PairFitOptions options;
  options.left_radial = belief.left_bends;
  options.right_radial = belief.right_bends;
  return options;
}

BelievedPair believe_pair(const Camera& left, const Camera& right, const Pose& left_from_right,
                          const std::vector<PixelMatch>& matches, ImageSize picture, bool calibrated) {
  const PairBelief given = belief_as_given(left, right, left_from_right, picture);
  BelievedPair best = fitted(with_eyes_in_place(given), matches);
  if (best.belief.inverted) best = with_eyes_told(std::move(best), matches);
  const bool told = best.eyes_told;
  const std::vector<double> rows_given_px = best.fit.given.row_error_px;
  best = with_stated_size(best, matches);
  for (int mistakes = 0; mistakes < kMostMistakes && !is_beyond_doubt(best); ++mistakes) {
    std::optional<BelievedPair> next = with_next_mistake(best, matches, calibrated);
    if (!next) break;
    best = std::move(*next);
  }
  if (calibrated) best = with_size_of_one_eye(best, matches);
  if (!calibrated) best.explains = best.agrees;  // of a guess anything may be far off
  // What was wrong besides may have hidden it.
  if (!told && best.belief.inverted) best = with_eyes_told(std::move(best), matches);
  best.size_told = is_size_told(best, matches);
  best.rows_given_px = row_errors(inliers_of(rows_given_px, best.fit.inlier)).mean_px;
  const RectifiedMatches& believed = best.as_it_is ? best.fit.given : best.fit.rows;
  best.rows_px = row_errors(inliers_of(believed.row_error_px, best.fit.inlier)).mean_px;
  return best;
}

}  // namespace spartan
