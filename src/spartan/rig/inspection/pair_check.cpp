#include "spartan/rig/inspection/pair_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "spartan/rig/inspection/belief_search.h"
#include "spartan/rig/inspection/pair_mending.h"

namespace spartan {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr int kLeastMatches = 40;
// Beside the verdict's limits (PairVerdict).
constexpr double kRowOffset_px = 0.5, kRollOffset_px = 0.5, kFocalRatio = 0.003, kUsableMean_px = 1, kUsableP95_px = 3;
// Brown's decentering p2 of a lens may be wrong by 0.002 in each eye; its rows 2 p2 x y are those of a yaw twice as
// large.
constexpr double kYawOfLens_rad = 2 * 0.002 * std::numbers::sqrt2;
constexpr double kYawSigmas = 2.6, kSigmas = 5;
constexpr double kBeyondShare = 0.02;  // of the matches

double share_below(const std::vector<double>& values, double limit) {
  const auto below = std::count_if(values.begin(), values.end(), [&](double v) { return v < limit; });
  return values.empty() ? 0 : static_cast<double>(below) / static_cast<double>(values.size());
}

constexpr RowErrors kNoRows{kNan, kNan, kNan};
constexpr PairCorrection kNoCorrection{kNan, kNan, kNan, kNan, kNan, kNan, kNan, kNan};

class Checker {
 public:
  Checker(const Rig& rig, const StereoPair& pair, const std::vector<PixelMatch>& matches, ImageSize picture_size,
          bool guessed)
      : rig_(rig), pair_(pair), picture_(picture_size), guessed_(guessed) {
    check_.matches = static_cast<int>(matches.size());
    check_.findings = find_doubts(rig, pair, picture_size);
    if (found("not_beside") || too_few(check_.matches)) return;
    believed_ = believe_pair(*rig.find_camera(pair.left), *rig.find_camera(pair.right),
                             rig.right_from_left(pair).inverse(), matches, picture_size, !guessed);
  }

  PairCheck run() && {
    if (found("not_beside") || too_few(check_.matches)) return without_figures();
    take_figures();
    if (looks_twice_at_one_picture()) {
      add("same_picture", "both pictures are the same, nothing is nearer or farther: is one of them the other eye's?",
          check_.inliers);
      return without_figures();
    }
    if (!believed_.explains) {
      if (too_few(check_.inliers)) return without_figures();
      return unexplained(fit().rms_px);
    }
    name_beliefs();
    if (too_few(check_.inliers)) return without_figures();
    judge_yaw();
    judge_rows();
    judge_focal_ratio();
    correct();
    if (is_worthless(check_.as_corrected) && check_.as_corrected.mean_px > 0.9 * check_.as_given.mean_px)
      return unexplained(check_.as_corrected.mean_px);
    return finish();
  }

 private:
  bool found(std::string_view id) const {
    return std::any_of(check_.findings.begin(), check_.findings.end(), [&](const RigFinding& f) { return f.id == id; });
  }
  void drop(std::string_view id) {
    std::erase_if(check_.findings, [&](const RigFinding& f) { return f.id == id; });
  }
  void add(const char* id, std::string text, double value) { check_.findings.push_back({id, std::move(text), value}); }
  const PairFit& fit() const { return believed_.fit; }

  bool too_few(int matches) {
    const bool spread = check_.map.empty() || 4 * std::ssize(check_.map) >= kRowErrorCells;
    if (matches >= kLeastMatches && spread) return false;
    if (found("not_enough_texture")) return true;
    add("not_enough_texture",
        matches == check_.matches
            ? fmt::format("only {} matches: too little to judge by; more shots tell more", matches)
            : fmt::format(
                  "only {} of {} matches agree, in {} of {} parts of the picture: too little to judge by; more shots "
                  "tell more",
                  matches, check_.matches, check_.map.size(), kRowErrorCells),
        matches);
    return true;
  }

  PairCheck without_figures();
  PairCheck unexplained(double rows_at_best_px);
  void take_figures();
  bool looks_twice_at_one_picture() const;
  void name_beliefs();
  std::string what_the_rows_say() const;
  void name_eyes();
  void name_size();
  void name_distortion();
  void judge_yaw();
  void judge_rows();
  void judge_focal_ratio();
  bool needs_correction() const;
  void correct();
  void name_rows_apart();
  static bool is_worthless(const RowErrors& rows);
  PairVerdict verdict() const;
  PairCheck finish();

  const Rig& rig_;
  StereoPair pair_;
  ImageSize picture_;
  bool guessed_ = false;
  BelievedPair believed_;
  PairCheck check_;
};

// Where there is nothing to tell by: no figure is made up.
PairCheck Checker::without_figures() {
  check_.correction = check_.sigma = kNoCorrection;
  check_.yaw_doubt_px = kNan;
  check_.as_given = check_.as_corrected = kNoRows;
  if (check_.inliers == 0) check_.as_taken = kNoRows;
  check_.verdict = PairVerdict::bad;
  check_.corrected = rig_;
  return std::move(check_);
}

PairCheck Checker::unexplained(double rows_at_best_px) {
  std::string text = fmt::format(
      "no mistake that is known here explains the pictures: {} of {} matches agree, to {:.2f} px at best. Are they of "
      "one moment, and of this rig?",
      check_.inliers, check_.matches, rows_at_best_px);
  add("not_explained", std::move(text), rows_at_best_px);
  check_.correction = check_.sigma = kNoCorrection;
  check_.yaw_doubt_px = kNan;
  check_.as_corrected = kNoRows;
  check_.verdict = PairVerdict::bad;
  check_.corrected.reset();
  return std::move(check_);
}

void Checker::take_figures() {
  const PairBelief& belief = believed_.belief;
  check_.inliers = fit().inliers;
  check_.correction = fit().correction;
  check_.sigma = fit().sigma;
  check_.matched = inliers_of(believed_.matches, fit().inlier);
  check_.inlier_limit_px = fit().inlier_limit_px;
  check_.pictures_exchanged = belief.pictures_exchanged;
  const PairBelief given = with_rows_as_given(belief);
  check_.row_error_px =
      rectify_matches(given.left.model, given.right.model, given.left_from_right, check_.matched).row_error_px;
  std::vector<double> taken;
  taken.reserve(check_.matched.size());
  for (const PixelMatch& match : check_.matched) taken.push_back(match.left.y() - match.right.y());
  check_.as_taken = row_errors(taken);
  check_.as_given = row_errors(check_.row_error_px);
  check_.map = map_row_errors(check_.matched, check_.row_error_px, picture_);
}

bool Checker::looks_twice_at_one_picture() const {
  constexpr double kSame_px = 0.2, kNearlyAll = 0.95;
  const auto same = std::count_if(believed_.matches.begin(), believed_.matches.end(),
                                  [](const PixelMatch& m) { return (m.left - m.right).norm() < kSame_px; });
  return static_cast<double>(same) > kNearlyAll * static_cast<double>(believed_.matches.size());
}

void Checker::name_beliefs() {
  name_eyes();
  name_size();
  if (!guessed_) name_distortion();
  check_.structure_found = found("inverse_transform") || found("swapped_eyes") || found("size_mismatch");
}

std::string Checker::what_the_rows_say() const {
  std::string text = fmt::format("the rows then agree to {:.2f} px", believed_.rows_px);
  if (std::isfinite(believed_.rows_given_px))
    text += fmt::format(" in the place of {:.2f} px", believed_.rows_given_px);
  return text;
}

void Checker::name_eyes() {
  const PairBelief& b = believed_.belief;
  drop("inverse_transform");
  drop("swapped_eyes");
  const double share = 100 * (1 - believed_.wrong_side);
  const std::string proof = fmt::format("{:.0f} % of the disparities are then positive", share);
  if (b.inverted) {
    add("inverse_transform",
        fmt::format("the rig has the right camera on the left; with the inverse transform the rows agree, and {}{}",
                    proof,
                    believed_.eyes_told ? "" : ". With two so equal eyes left and right may as well be exchanged"),
        share);
  }
  if (b.eyes_exchanged || !believed_.eyes_told) {
    add("swapped_eyes",
        fmt::format("what the rig calls left stands on the right{}: {}{}",
                    b.pictures_exchanged ? ", and what is called the left picture was taken there" : "", proof,
                    believed_.eyes_told ? "" : ". Or the transform is inverted: two so equal eyes do not tell"),
        share);
  } else if (b.lenses_exchanged) {
    add("swapped_eyes",
        fmt::format("the two eyes have each other's lenses{}: {}",
                    b.pictures_exchanged ? ", and each other's pictures" : "", what_the_rows_say()),
        share);
  } else if (b.pictures_exchanged) {
    add("swapped_eyes", fmt::format("what is called the left picture was taken by the right eye: {}", proof), share);
  }
}

void Checker::name_size() {
  const SizeChange& size = believed_.belief.size;
  // Off-centre, and the pictures are content with it.
  const bool of_the_pictures = picture_.empty() || picture_ == rig_.find_camera(pair_.left)->size;
  const bool off_centre = size_told_by_centre(believed_.belief.left) || size_told_by_centre(believed_.belief.right);
  if (size.any() || (off_centre && of_the_pictures && !believed_.belief.stated_size)) drop("size_mismatch");
  if (!size.any()) return;
  const auto other_size = [](bool left, bool right, double factor) {
    return fmt::format("a focal length{} {:.3g} times as large",
                       left && right ? ""
                       : left        ? " of the left eye"
                                     : " of the right eye",
                       factor);
  };
  std::string text = fmt::format("with {} {}: is the calibration that of another picture size?",
                                 other_size(size.left, size.right, size.factor), what_the_rows_say());
  if (!believed_.size_told)
    text += fmt::format(" Or with {}: rows do not tell which", other_size(!size.left, !size.right, 1 / size.factor));
  add("size_mismatch", std::move(text), size.factor);
}

void Checker::name_distortion() {
  constexpr double kLeastRadial = 0.02, kSure = 6;
  PairBelief& b = believed_.belief;
  const PairCorrection &c = fit().correction, &s = fit().sigma;
  const bool left = b.left_bends && std::abs(c.left_radial) > std::max(kLeastRadial, kSure * s.left_radial);
  const bool right = b.right_bends && std::abs(c.right_radial) > std::max(kLeastRadial, kSure * s.right_radial);
  if (!left && !right) return;
  const double radial = left && right ? 0.5 * (c.left_radial + c.right_radial) : left ? c.left_radial : c.right_radial;
  const char* who = left && right ? "the eyes are" : left ? "the left eye is" : "the right eye is";
  add("distortion_ignored",
      fmt::format("{} taken for {}, but the rows bend, as with a k1 of about {:.3f}: {}", who,
                  left && right ? "pinholes" : "a pinhole", radial, what_the_rows_say()),
      radial);
}

void Checker::judge_yaw() {
  const double sigma = std::hypot(fit().sigma.yaw_rad, kYawOfLens_rad), yaw = fit().correction.yaw_rad;
  check_.sigma.yaw_rad = sigma;
  check_.yaw_doubt_px = sigma * fit().rows.focal_px;
  if (guessed_) return;
  // Disparities as given are those as corrected without the yaw: on the axis it shifts them by f times itself.
  const std::vector<double> corrected = inliers_of(fit().rows.disparity_px, fit().inlier);
  std::vector<double> given = corrected;
  for (double& d : given) d += fit().rows.focal_px * yaw;
  const double beyond = share_below(given, kBeyondInfinity_px);
  const bool told_by_infinity = yaw < 0 && beyond > kBeyondShare && -yaw > kSigmas * fit().sigma.yaw_rad &&
                                share_below(corrected, kBeyondInfinity_px) < 0.3 * beyond;
  if (!told_by_infinity && std::abs(yaw) < kYawSigmas * sigma) return;
  add("yaw_offset",
      fmt::format(
          "the right eye looks {:.2f}° further to the {} than the rig says{}", std::abs(yaw) * kDegreesPerRadian,
          yaw > 0 ? "right" : "left",
          told_by_infinity ? fmt::format(": {:.0f} % of the matches would be beyond infinity", 100 * beyond) : ""),
      yaw * kDegreesPerRadian);
}

void Checker::judge_rows() {
  const RowErrors& rows = check_.as_given;
  if (std::abs(rows.median_px) > kRowOffset_px) {
    add("row_offset",
        fmt::format("rows of the left picture lie {:.2f} px {} those of the right one{}", std::abs(rows.median_px),
                    rows.median_px > 0 ? "below" : "above",
                    believed_.belief.rows_lower_px != 0
                        ? ": a turn does not do that to such lenses, a picture that was moved or cropped does"
                        : ""),
        rows.median_px);
  }
  const double roll = check_.correction.roll_rad, across_px = 0.5 * picture_.width * std::abs(roll);
  if (across_px > kRollOffset_px && std::abs(roll) > kSigmas * check_.sigma.roll_rad && !believed_.good_rows) {
    add("roll_offset",
        fmt::format("the right eye is turned {:.3f}° {} about its axis: {:.1f} px at the sides of the picture",
                    std::abs(roll) * kDegreesPerRadian, roll > 0 ? "clockwise" : "counter-clockwise", across_px),
        roll * kDegreesPerRadian);
  }
}

void Checker::judge_focal_ratio() {
  const SizeChange& size = believed_.belief.size;
  const bool of_one_eye = size.left != size.right;
  const double found_ratio = check_.correction.focal_ratio;
  if (of_one_eye) {
    // Both say so: the one eye's calibration is of another size, and the eyes do not go together.
    const double whole = found_ratio * (size.right ? size.factor : 1 / size.factor);
    check_.correction.focal_ratio = whole;
  }
  if (guessed_) return;
  const double ratio = check_.correction.focal_ratio - 1;
  if (std::abs(ratio) <= std::max(kFocalRatio, kSigmas * check_.sigma.focal_ratio)) return;
  add("focal_ratio",
      fmt::format("the right eye's focal length is {:.2f} % {} than the rig says, beside the left one's",
                  100 * std::abs(ratio), ratio > 0 ? "larger" : "smaller"),
      check_.correction.focal_ratio);
}

// Where eyes, unit, size or moved rows were all that was wrong, the rest of the calibration is right.
bool Checker::needs_correction() const {
  const bool turned = found("row_offset") && believed_.belief.rows_lower_px == 0;
  return !believed_.good_rows || turned || found("yaw_offset") || found("focal_ratio") || found("distortion_ignored");
}

void Checker::correct() {
  if (check_.findings.empty() && !needs_correction()) {
    check_.corrected = rig_;
    check_.as_corrected = check_.as_given;
    return;
  }
  PairCorrection correction;
  if (needs_correction()) {
    correction = needed_correction(believed_, {.yaw = guessed_ || found("yaw_offset"),
                                               .focal_ratio = guessed_ || found("focal_ratio"),
                                               .distortion = found("distortion_ignored")});
  }
  check_.corrected = mended_rig(rig_, pair_, believed_.belief, correction, found("baseline_unit"));
  const StereoPair& pair = *check_.corrected->find_pair(pair_.name);
  const RectifiedMatches seen =
      rectify_matches(check_.corrected->find_camera(pair.left)->model, check_.corrected->find_camera(pair.right)->model,
                      check_.corrected->right_from_left(pair).inverse(), check_.matched);
  check_.as_corrected = row_errors(seen.row_error_px);
  if (check_.findings.empty()) name_rows_apart();
}

// Rows that nothing above has named.
void Checker::name_rows_apart() {
  constexpr double kMended = 0.7;
  const RowErrors fitted = row_errors(inliers_of(fit().rows.row_error_px, fit().inlier));
  std::string why;
  if (check_.as_corrected.mean_px < kMended * check_.as_given.mean_px) {
    why = "; turns and the baseline's direction mend that";
  } else if (fitted.mean_px < kMended * check_.as_given.mean_px) {
    why = fmt::format(
        "; the right eye turned {:.2f}° to the {} would mend that, and so would decentering of a lens: rows do not "
        "tell "
        "which, and it is left alone",
        std::abs(fit().correction.yaw_rad) * kDegreesPerRadian, fit().correction.yaw_rad > 0 ? "right" : "left");
  } else {
    why = ", and no small correction mends that: another lens model, or pictures that move within themselves?";
  }
  add("rows_apart",
      fmt::format("rows differ by {:.2f} px, 95 % below {:.2f} px{}", check_.as_given.mean_px, check_.as_given.p95_px,
                  why),
      check_.as_given.mean_px);
}

// Rows with which stereo does not work.
bool Checker::is_worthless(const RowErrors& rows) {
  return !(rows.mean_px <= kUsableMean_px && rows.p95_px <= kUsableP95_px);
}

PairVerdict Checker::verdict() const {
  for (const char* id :
       {"not_beside", "inverse_transform", "swapped_eyes", "size_mismatch", "distortion_ignored", "yaw_offset"}) {
    if (found(id)) return PairVerdict::bad;
  }
  // Large rigs have baselines of metres.
  const double baseline_m = rig_.right_from_left(pair_).translation().norm();
  if (found("baseline_unit") && likelier_unit(baseline_m)) return PairVerdict::bad;
  if (is_worthless(check_.as_given)) return PairVerdict::bad;
  return check_.findings.empty() ? PairVerdict::good : PairVerdict::usable;
}

PairCheck Checker::finish() {
  check_.verdict = verdict();
  return std::move(check_);
}

}  // namespace

std::string_view name_of(PairVerdict verdict) {
  switch (verdict) {
    case PairVerdict::good:
      return "good";
    case PairVerdict::usable:
      return "usable";
    case PairVerdict::bad:
      break;
  }
  return "bad";
}

PairCheck check_pair(const Rig& rig, const StereoPair& pair, const std::vector<PixelMatch>& matches,
                     ImageSize picture_size) {
  return Checker(rig, pair, matches, picture_size, false).run();
}

PairCheck check_pictures(const std::vector<PixelMatch>& matches, ImageSize picture_size) {
  const Rig rig = guessed_rig(picture_size);
  return Checker(rig, rig.pairs.front(), matches, picture_size, true).run();
}

Rig guessed_rig(ImageSize picture_size) {
  const auto camera = [&](const char* name) {
    Camera made;
    made.name = name;
    made.size = picture_size;
    const double focal_px = 1.2 * std::max(picture_size.width, picture_size.height);
    made.model = PinholeModel{focal_px, focal_px, 0.5 * (picture_size.width - 1), 0.5 * (picture_size.height - 1)};
    return made;
  };
  return rig_of_one_pair("guessed", camera("left"), camera("right"), Pose::from_translation({-1, 0, 0}));
}

}  // namespace spartan
