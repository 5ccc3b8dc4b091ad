#include "spartan/calibration/pair_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "spartan/calibration/internal/hypothesis_search.h"
#include "spartan/calibration/internal/pair_correction.h"
#include "spartan/calibration/internal/row_errors.h"
#include "spartan/core/pose.h"

namespace spartan {

using namespace internal;

namespace {

constexpr int kMinMatches = 40;  // inliers for a check
// Limits of the findings, and of the grade `usable` (PairGrade has those of `good`).
constexpr double kRowOffset_px = 0.5, kRollOffset_px = 0.5, kFocalRatio = 0.003, kUsableMean_px = 1, kUsableP95_px = 3;
// Brown's decentering p2 is usually wrong by up to 0.002 in each lens. Its row error 2 p2 x y equals that of a yaw of
// 2 p2; the errors of two lenses add up in quadrature (0.32°).
constexpr double kYawOfLens_rad = 2 * 0.002 * std::numbers::sqrt2;
// Standard deviations for a finding: 2.6 (99 %) for yaw, whose sigma includes the lens; 5 where sigma is the fit's
// alone.
constexpr double kYawSigmas = 2.6, kSigmas = 5;
constexpr double kNegativeShare = 0.02;  // share of matches with negative disparity that shows a yaw error

double share_below(const std::vector<double>& values, double limit) {
  const auto below = std::count_if(values.begin(), values.end(), [&](double v) { return v < limit; });
  return values.empty() ? 0 : static_cast<double>(below) / static_cast<double>(values.size());
}

constexpr RowErrors kNoRows{kNan, kNan, kNan};
constexpr PairCorrection kNoCorrection{kNan, kNan, kNan, kNan, kNan, kNan, kNan, kNan};

class Checker {
 public:
  Checker(const Rig& rig, const StereoPair& pair, const std::vector<PixelMatch>& matches, ImageSize image_size,
          bool guessed)
      : rig_(rig), pair_(pair), image_size_(image_size), guessed_(guessed) {
    check_.matches = static_cast<int>(matches.size());
    check_.findings = plausibility_findings(rig, pair, image_size);
    if (found("not_side_by_side") || too_few(check_.matches)) return;
    fitted_ = find_hypothesis(*rig.find_camera(pair.left), *rig.find_camera(pair.right),
                              rig.right_from_left(pair).inverse(), matches, image_size, !guessed);
  }

  PairCheck run() && {
    if (found("not_side_by_side") || too_few(check_.matches)) return without_estimates();
    fill_statistics();
    if (has_identical_images()) {
      add("identical_images",
          "both images are the same, without any disparity: check that they are from the left and the right camera",
          check_.inliers);
      return without_estimates();
    }
    if (!fitted_.accepted) {
      if (too_few(check_.inliers)) return without_estimates();
      return unexplained(fit().rms_px);
    }
    report_gross_errors();
    if (too_few(check_.inliers)) return without_estimates();
    check_yaw();
    check_rows();
    check_focal_ratio();
    apply_correction();
    // A correction that leaves the rows unusable must at least improve them by a tenth.
    if (is_unusable(check_.corrected_rows) && check_.corrected_rows.mean_px > 0.9 * check_.nominal_rows.mean_px)
      return unexplained(check_.corrected_rows.mean_px);
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
  const PairFit& fit() const { return fitted_.fit; }

  bool too_few(int matches) {
    const bool spread = check_.map.empty() || 4 * std::ssize(check_.map) >= kRowErrorCells;
    if (matches >= kMinMatches && spread) return false;
    if (found("not_enough_texture")) return true;
    add("not_enough_texture",
        matches == check_.matches
            ? fmt::format("only {} matches: too few for a check; use more stereo frames", matches)
            : fmt::format(
                  "only {} of {} matches agree, in {} of {} cells of the image: too few for a check; use more stereo "
                  "frames",
                  matches, check_.matches, check_.map.size(), kRowErrorCells),
        matches);
    return true;
  }

  PairCheck without_estimates();
  PairCheck unexplained(double best_rows_px);
  void fill_statistics();
  bool has_identical_images() const;
  void report_gross_errors();
  std::string row_improvement() const;
  void report_cameras();
  void report_size();
  void report_distortion();
  void check_yaw();
  void check_rows();
  void check_focal_ratio();
  bool needs_correction() const;
  void apply_correction();
  void report_row_residuals();
  static bool is_unusable(const RowErrors& rows);
  PairGrade grade() const;
  PairCheck finish();

  const Rig& rig_;
  StereoPair pair_;
  ImageSize image_size_;
  bool guessed_ = false;
  FittedHypothesis fitted_;
  PairCheck check_;
};

// Without enough matches the estimates are NaN.
PairCheck Checker::without_estimates() {
  check_.correction = check_.sigma = kNoCorrection;
  check_.yaw_sigma_px = kNan;
  check_.nominal_rows = check_.corrected_rows = kNoRows;
  if (check_.inliers == 0) check_.unrectified_rows = kNoRows;
  check_.grade = PairGrade::bad;
  check_.corrected = rig_;
  return std::move(check_);
}

PairCheck Checker::unexplained(double best_rows_px) {
  std::string text = fmt::format(
      "no known calibration error explains the images: {} of {} matches agree, to {:.2f} px at best. Check that both "
      "images were taken at the same time, and with this rig",
      check_.inliers, check_.matches, best_rows_px);
  add("not_explained", std::move(text), best_rows_px);
  check_.correction = check_.sigma = kNoCorrection;
  check_.yaw_sigma_px = kNan;
  check_.corrected_rows = kNoRows;
  check_.grade = PairGrade::bad;
  check_.corrected.reset();
  return std::move(check_);
}

void Checker::fill_statistics() {
  const PairHypothesis& hypothesis = fitted_.hypothesis;
  check_.inliers = fit().inliers;
  check_.correction = fit().correction;
  check_.sigma = fit().sigma;
  check_.inlier_matches = inliers_of(fitted_.matches, fit().inlier);
  check_.inlier_limit_px = fit().inlier_limit_px;
  check_.images_swapped = hypothesis.images_swapped;
  const PairHypothesis given = without_row_shift(hypothesis);
  check_.row_error_px =
      rectify_matches(given.left.model, given.right.model, given.left_from_right, check_.inlier_matches).row_error_px;
  std::vector<double> unrectified;
  unrectified.reserve(check_.inlier_matches.size());
  for (const PixelMatch& match : check_.inlier_matches) unrectified.push_back(match.left.y() - match.right.y());
  check_.unrectified_rows = row_errors(unrectified);
  check_.nominal_rows = row_errors(check_.row_error_px);
  check_.map = map_row_errors(check_.inlier_matches, check_.row_error_px, image_size_);
}

bool Checker::has_identical_images() const {
  constexpr double kSame_px = 0.2, kNearlyAll = 0.95;
  const auto same = std::count_if(fitted_.matches.begin(), fitted_.matches.end(),
                                  [](const PixelMatch& m) { return (m.left - m.right).norm() < kSame_px; });
  return static_cast<double>(same) > kNearlyAll * static_cast<double>(fitted_.matches.size());
}

void Checker::report_gross_errors() {
  report_cameras();
  report_size();
  if (!guessed_) report_distortion();
  check_.has_gross_error = found("inverse_transform") || found("swapped_eyes") || found("size_mismatch");
}

std::string Checker::row_improvement() const {
  std::string text = fmt::format("the rows then agree to {:.2f} px", fitted_.rows_px);
  if (std::isfinite(fitted_.nominal_rows_px)) text += fmt::format(" instead of {:.2f} px", fitted_.nominal_rows_px);
  return text;
}

void Checker::report_cameras() {
  const PairHypothesis& h = fitted_.hypothesis;
  drop("inverse_transform");
  drop("swapped_eyes");
  const double share = 100 * (1 - fitted_.negative_share);
  const std::string proof = fmt::format("{:.0f} % of the disparities are then positive", share);
  if (h.inverted) {
    add("inverse_transform",
        fmt::format("the rig has the right camera on the left; with the inverse transform the rows agree, and {}{}",
                    proof,
                    fitted_.sides_unambiguous
                        ? ""
                        : ". The cameras are so similar that swapped left and right cameras explain it equally well"),
        share);
  }
  if (h.cameras_swapped || !fitted_.sides_unambiguous) {
    add("swapped_eyes",
        fmt::format("the camera that the rig calls left is the right one{}: {}{}",
                    h.images_swapped ? ", and the left image was taken by it" : "", proof,
                    fitted_.sides_unambiguous
                        ? ""
                        : ". The cameras are so similar that an inverse transform explains it equally well"),
        share);
  } else if (h.lenses_swapped) {
    add("swapped_eyes",
        fmt::format("the intrinsics of the two cameras are swapped{}: {}",
                    h.images_swapped ? ", and so are the images" : "", row_improvement()),
        share);
  } else if (h.images_swapped) {
    add("swapped_eyes", fmt::format("the left image was taken by the right camera: {}", proof), share);
  }
}

void Checker::report_size() {
  const SizeChange& size = fitted_.hypothesis.size;
  // The images refute the suspicion that an off-centre principal point is that of another image size.
  const bool same_image_size = image_size_.empty() || image_size_ == rig_.find_camera(pair_.left)->size;
  const bool off_centre =
      size_factor_from_centre(fitted_.hypothesis.left) || size_factor_from_centre(fitted_.hypothesis.right);
  if (size.any() || (off_centre && same_image_size && !fitted_.hypothesis.size_from_plausibility))
    drop("size_mismatch");
  if (!size.any()) return;
  const auto other_size = [](bool left, bool right, double factor) {
    return fmt::format("a focal length{} {:.3g} times as large",
                       left && right ? ""
                       : left        ? " of the left camera"
                                     : " of the right camera",
                       factor);
  };
  std::string text = fmt::format("with {} {}: check whether the calibration is for another image size",
                                 other_size(size.left, size.right, size.factor), row_improvement());
  if (!fitted_.size_unambiguous) {
    text += fmt::format(". Or with {}: rows do not distinguish the two",
                        other_size(!size.left, !size.right, 1 / size.factor));
  }
  add("size_mismatch", std::move(text), size.factor);
}

void Checker::report_distortion() {
  // Smaller radial distortion is within the accuracy of a pinhole calibration (empirical).
  constexpr double kMinRadial = 0.02, kRadialSigmas = 6;
  const PairHypothesis& h = fitted_.hypothesis;
  const PairCorrection &c = fit().correction, &s = fit().sigma;
  const bool left = h.fit_left_radial && std::abs(c.left_radial) > std::max(kMinRadial, kRadialSigmas * s.left_radial);
  const bool right =
      h.fit_right_radial && std::abs(c.right_radial) > std::max(kMinRadial, kRadialSigmas * s.right_radial);
  if (!left && !right) return;
  const double radial = left && right ? 0.5 * (c.left_radial + c.right_radial) : left ? c.left_radial : c.right_radial;
  const char* who = left && right ? "both cameras are" : left ? "the left camera is" : "the right camera is";
  add("distortion_ignored",
      fmt::format("{} calibrated without distortion, but the rows are curved as with k1 = {:.3f}: {}", who, radial,
                  row_improvement()),
      radial);
}

void Checker::check_yaw() {
  const double sigma = std::hypot(fit().sigma.yaw_rad, kYawOfLens_rad), yaw = fit().correction.yaw_rad;
  check_.sigma.yaw_rad = sigma;
  check_.yaw_sigma_px = sigma * fit().rows.focal_px;
  if (guessed_) return;
  // Disparities without the yaw correction: on the optical axis a yaw shifts them by f · yaw.
  const std::vector<double> corrected = inliers_of(fit().rows.disparity_px, fit().inlier);
  std::vector<double> given = corrected;
  for (double& d : given) d += fit().rows.focal_px * yaw;
  const double negative = share_below(given, kNegativeDisparity_px);
  const bool shown_by_disparities = yaw < 0 && negative > kNegativeShare && -yaw > kSigmas * fit().sigma.yaw_rad &&
                                    share_below(corrected, kNegativeDisparity_px) < 0.3 * negative;
  if (!shown_by_disparities && std::abs(yaw) < kYawSigmas * sigma) return;
  add("yaw_offset",
      fmt::format(
          "the right camera points {:.2f}° further to the {} than the rig says{}", std::abs(yaw) * kDegreesPerRadian,
          yaw > 0 ? "right" : "left",
          shown_by_disparities ? fmt::format(": {:.0f} % of the matches have negative disparity", 100 * negative) : ""),
      yaw * kDegreesPerRadian);
}

void Checker::check_rows() {
  const RowErrors& rows = check_.nominal_rows;
  if (std::abs(rows.median_px) > kRowOffset_px) {
    add("row_offset",
        fmt::format("rows of the left image are {:.2f} px {} those of the right image{}", std::abs(rows.median_px),
                    rows.median_px > 0 ? "below" : "above",
                    fitted_.hypothesis.row_shift_px != 0
                        ? ": with this distortion the cause is a shifted or cropped image, not a rotation"
                        : ""),
        rows.median_px);
  }
  const double roll = check_.correction.roll_rad, across_px = 0.5 * image_size_.width * std::abs(roll);
  if (across_px > kRollOffset_px && std::abs(roll) > kSigmas * check_.sigma.roll_rad && !fitted_.rows_good) {
    add("roll_offset",
        fmt::format("the right camera is rotated {:.3f}° {} about its optical axis: {:.1f} px at the image sides",
                    std::abs(roll) * kDegreesPerRadian, roll > 0 ? "clockwise" : "counter-clockwise", across_px),
        roll * kDegreesPerRadian);
  }
}

void Checker::check_focal_ratio() {
  const SizeChange& size = fitted_.hypothesis.size;
  const bool of_one_camera = size.left != size.right;
  const double found_ratio = check_.correction.focal_ratio;
  if (of_one_camera) {
    // A wrong size of one camera is also a wrong ratio of the focal lengths.
    const double total_ratio = found_ratio * (size.right ? size.factor : 1 / size.factor);
    check_.correction.focal_ratio = total_ratio;
  }
  if (guessed_) return;
  const double ratio = check_.correction.focal_ratio - 1;
  if (std::abs(ratio) <= std::max(kFocalRatio, kSigmas * check_.sigma.focal_ratio)) return;
  add("focal_ratio",
      fmt::format("the focal length of the right camera, relative to the left one, is {:.2f} % {} than the rig says",
                  100 * std::abs(ratio), ratio > 0 ? "larger" : "smaller"),
      check_.correction.focal_ratio);
}

// Whether a rotation or distortion is wrong, and not only sides, unit, size or a vertical shift.
bool Checker::needs_correction() const {
  const bool pitched = found("row_offset") && fitted_.hypothesis.row_shift_px == 0;
  return !fitted_.rows_good || pitched || found("yaw_offset") || found("focal_ratio") || found("distortion_ignored");
}

void Checker::apply_correction() {
  if (check_.findings.empty() && !needs_correction()) {
    check_.corrected = rig_;
    check_.corrected_rows = check_.nominal_rows;
    return;
  }
  PairCorrection correction;
  if (needs_correction()) {
    correction = minimal_correction(fitted_, {.yaw = guessed_ || found("yaw_offset"),
                                              .focal_ratio = guessed_ || found("focal_ratio"),
                                              .distortion = found("distortion_ignored")});
  }
  check_.corrected = corrected_rig(rig_, pair_, fitted_.hypothesis, correction, found("baseline_unit"));
  const StereoPair& pair = *check_.corrected->find_pair(pair_.name);
  const RectifiedMatches seen =
      rectify_matches(check_.corrected->find_camera(pair.left)->model, check_.corrected->find_camera(pair.right)->model,
                      check_.corrected->right_from_left(pair).inverse(), check_.inlier_matches);
  check_.corrected_rows = row_errors(seen.row_error_px);
  if (check_.findings.empty()) report_row_residuals();
}

// Row errors for which there is no other finding.
void Checker::report_row_residuals() {
  constexpr double kImproved = 0.7;  // a correction explains them if it reduces the mean to this share
  const RowErrors fitted = row_errors(inliers_of(fit().rows.row_error_px, fit().inlier));
  std::string why;
  if (check_.corrected_rows.mean_px < kImproved * check_.nominal_rows.mean_px) {
    why = "; a rotation and the baseline direction correct that";
  } else if (fitted.mean_px < kImproved * check_.nominal_rows.mean_px) {
    why = fmt::format(
        "; the right camera rotated {:.2f}° to the {} would correct that, and so would a lens decentering: rows do not "
        "distinguish the two, and neither is applied",
        std::abs(fit().correction.yaw_rad) * kDegreesPerRadian, fit().correction.yaw_rad > 0 ? "right" : "left");
  } else {
    why = ", and no small correction reduces that: check the camera model, and for rolling shutter";
  }
  add("row_residuals",
      fmt::format("rows differ by {:.2f} px, 95 % below {:.2f} px{}", check_.nominal_rows.mean_px,
                  check_.nominal_rows.p95_px, why),
      check_.nominal_rows.mean_px);
}

// Rows with which stereo matching does not work.
bool Checker::is_unusable(const RowErrors& rows) {
  return !(rows.mean_px <= kUsableMean_px && rows.p95_px <= kUsableP95_px);
}

PairGrade Checker::grade() const {
  for (const char* id :
       {"not_side_by_side", "inverse_transform", "swapped_eyes", "size_mismatch", "distortion_ignored", "yaw_offset"}) {
    if (found(id)) return PairGrade::bad;
  }
  // A baseline of some metres is unusual, but large rigs have it: bad only where another unit is likely.
  const double baseline_m = rig_.right_from_left(pair_).translation().norm();
  if (found("baseline_unit") && likely_unit(baseline_m)) return PairGrade::bad;
  if (is_unusable(check_.nominal_rows)) return PairGrade::bad;
  return check_.findings.empty() ? PairGrade::good : PairGrade::usable;
}

PairCheck Checker::finish() {
  check_.grade = grade();
  return std::move(check_);
}

}  // namespace

std::string_view name_of(PairGrade grade) {
  switch (grade) {
    case PairGrade::good:
      return "good";
    case PairGrade::usable:
      return "usable";
    case PairGrade::bad:
      break;
  }
  return "bad";
}

PairCheck check_pair(const Rig& rig, const StereoPair& pair, const std::vector<PixelMatch>& matches,
                     ImageSize image_size) {
  return Checker(rig, pair, matches, image_size, false).run();
}

PairCheck check_images(const std::vector<PixelMatch>& matches, ImageSize image_size) {
  const Rig rig = guessed_rig(image_size);
  return Checker(rig, rig.pairs.front(), matches, image_size, true).run();
}

Rig guessed_rig(ImageSize image_size) {
  const auto camera = [&](const char* name) {
    Camera made;
    made.name = name;
    made.size = image_size;
    const double focal_px = 1.2 * std::max(image_size.width, image_size.height);
    made.model = PinholeModel{focal_px, focal_px, 0.5 * (image_size.width - 1), 0.5 * (image_size.height - 1)};
    return made;
  };
  return rig_of_one_pair("guessed", camera("left"), camera("right"), Pose::from_translation({-1, 0, 0}));
}

}  // namespace spartan
