#include "spartan/rig/pair_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "spartan/rig/model_changes.h"

namespace spartan {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr int kLeastMatches = 40;
// Beside the verdict's limits (PairVerdict).
constexpr double kRowOffset_px = 0.5, kFocalRatio = 0.003, kGoodMean_px = 0.5, kGoodP95_px = 1.5, kUsableMean_px = 1,
                 kUsableP95_px = 3;
// Brown's decentering p2 of a lens may be wrong by 0.002 in each eye; its rows 2 p2 x y are those of a yaw twice as
// large.
constexpr double kYawOfLens_rad = 2 * 0.002 * std::numbers::sqrt2;
constexpr double kYawSigmas = 2.6;
constexpr double kBeyondInfinity_px = -1.5, kBeyondShare = 0.02;

template <class T>
std::vector<T> chosen(const std::vector<T>& values, const std::vector<bool>& which) {
  std::vector<T> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (which[i]) result.push_back(values[i]);
  }
  return result;
}

double share_below(const std::vector<double>& values, double limit) {
  const auto below = std::count_if(values.begin(), values.end(), [&](double v) { return v < limit; });
  return values.empty() ? 0 : static_cast<double>(below) / static_cast<double>(values.size());
}

// The pair as it is now believed, with all that was found so far taken in.
class Checker {
 public:
  Checker(const Rig& rig, const StereoPair& pair, std::vector<PixelMatch> matches, ImageSize picture_size, bool guessed)
      : rig_(rig), pair_(pair), matches_(std::move(matches)), picture_(picture_size), guessed_(guessed) {
    check_.matches = static_cast<int>(matches_.size());
    check_.findings = find_doubts(rig, pair, picture_size);
    believe(*rig.find_camera(pair.left), *rig.find_camera(pair.right), rig.right_from_left(pair).inverse());
  }

  PairCheck run() && {
    if (found("not_beside")) return finish();
    settle_stated_size();
    settle_eyes();
    search_size();
    settle_distortion();
    judge_fit();
    return finish();
  }

 private:
  void believe(const Camera& left, const Camera& right, const Pose& left_from_right) {
    left_ = left;
    right_ = right;
    left_from_right_ = left_from_right;
  }
  bool found(std::string_view id) const {
    return std::any_of(check_.findings.begin(), check_.findings.end(), [&](const RigFinding& f) { return f.id == id; });
  }
  void drop(std::string_view id) {
    std::erase_if(check_.findings, [&](const RigFinding& f) { return f.id == id; });
  }
  void add(const char* id, std::string text, double value) { check_.findings.push_back({id, std::move(text), value}); }

  PairFit fit_of(const CameraModel& left, const CameraModel& right, bool radial, bool yaw = true) const {
    PairFitOptions options;
    options.radial = radial;
    options.yaw = yaw;
    return fit_pair(left, right, left_from_right_, matches_, options);
  }

  void settle_stated_size();
  void search_size();
  void settle_eyes();
  void settle_distortion();
  void judge_fit();
  void judge_yaw();
  PairVerdict verdict() const;
  Rig corrected_rig() const;
  PairCheck finish();

  const Rig& rig_;
  StereoPair pair_;
  std::vector<PixelMatch> matches_;
  ImageSize picture_;
  bool guessed_ = false;
  Camera left_, right_;
  Pose left_from_right_;
  PairFit fit_, applied_;   // the second one is what the corrected rig has
  bool exchanged_ = false;  // the rig's eyes have changed their names
  bool moved_ = false;      // left_from_right_ is not the rig's
  PairCheck check_;
};

// The calibration of another picture size, told by the pictures themselves, of each camera by itself, or by a principal
// point, of both alike. Other size_mismatch (a view, fx beside fy) tell no factor.
void Checker::settle_stated_size() {
  bool by_pictures = false;
  for (Camera* camera : {&left_, &right_}) {
    if (picture_.empty() || picture_ == camera->size) continue;
    camera->model = resized(camera->model, static_cast<double>(picture_.width) / camera->size.width);
    camera->size = picture_;
    by_pictures = true;
  }
  if (by_pictures) return;
  auto factor = size_factor_by_centre(left_);
  if (!factor) factor = size_factor_by_centre(right_);
  if (!factor) return;
  left_.model = resized(left_.model, *factor);
  right_.model = resized(right_.model, *factor);
}

// The calibration of another size, told by rows that agree with that one only.
void Checker::search_size() {
  if (found("size_mismatch")) return;
  constexpr std::array<double, 8> kFactors{1 / 3.0, 0.5, 2 / 3.0, 0.75, 4 / 3.0, 1.5, 2, 3};
  constexpr double kWorthALook_px = 0.3, kClearlyBetter = 0.5;
  if (fit_.inliers < kLeastMatches || fit_.rms_px < kWorthALook_px) return;
  struct Other {
    CameraModel left, right;
    double factor = 1;
    PairFit fit;
  };
  std::optional<Other> best;
  double limit_px = kClearlyBetter * fit_.rms_px;
  for (const double factor : kFactors) {
    for (const auto& changed : {resized, with_focal_times}) {
      Other other{changed(left_.model, factor), changed(right_.model, factor), factor, {}};
      other.fit = fit_of(other.left, other.right, false);
      if (other.fit.inliers < fit_.inliers || other.fit.rms_px >= limit_px) continue;
      limit_px = other.fit.rms_px;
      best = other;
    }
  }
  if (!best) return;
  add("size_mismatch",
      fmt::format(
          "with a focal length {:.3g} times as large the rows agree to {:.2f} px in the place of {:.2f} px: is the "
          "calibration that of another picture size?",
          best->factor, limit_px, fit_.rms_px),
      best->factor);
  left_.model = best->left;
  right_.model = best->right;
  fit_ = best->fit;
}

// Which eye took which picture, and on which side the right one stands. Disparities are positive: a belief that makes
// most of them negative is wrong. Where both beliefs pass (eyes that are turned in, other principal points), the one
// whose rows agree counts; the rig as given has the benefit of the doubt.
void Checker::settle_eyes() {
  constexpr double kClearlyBetter = 0.7;
  struct Belief {
    Camera left, right;
    Pose left_from_right;
    std::vector<PixelMatch> matches;
    PairFit fit;
    double wrong_share = 1;  // of the disparities
  };
  const auto judged = [&](Belief belief) {
    std::swap(matches_, belief.matches);
    std::swap(left_from_right_, belief.left_from_right);
    belief.fit = fit_of(belief.left.model, belief.right.model, false);
    std::swap(left_from_right_, belief.left_from_right);
    std::swap(matches_, belief.matches);
    belief.wrong_share = share_below(chosen(belief.fit.disparity_px, belief.fit.inlier), 0);
    return belief;
  };
  std::vector<PixelMatch> exchanged = matches_;
  for (PixelMatch& match : exchanged) std::swap(match.left, match.right);
  const bool on_the_left = left_from_right_.translation().x() < 0;
  const Pose inverse = left_from_right_.inverse();
  // As given, or with the transform turned round; the other belief exchanges the pictures, and the eyes if they need
  // it.
  Belief same = judged({left_, right_, on_the_left ? inverse : left_from_right_, matches_, {}, 1});
  Belief other = judged(on_the_left ? Belief{right_, left_, inverse, exchanged, {}, 1}
                                    : Belief{left_, right_, left_from_right_, exchanged, {}, 1});
  fit_ = same.fit;
  if (std::max(same.fit.inliers, other.fit.inliers) < kLeastMatches) return;
  const bool same_fails = same.wrong_share > 0.5, other_fails = other.wrong_share > 0.5;
  const bool exchange = !other_fails && (same_fails || other.fit.cost < kClearlyBetter * same.fit.cost);
  if (!exchange && !on_the_left) return;
  drop("inverse_transform");
  drop("swapped_eyes");
  const Belief& chosen_one = exchange ? other : same;
  const double share = 100 * (1 - chosen_one.wrong_share);
  if (exchange) {
    add("swapped_eyes",
        fmt::format("what is called left was taken by the right eye{}: {:.0f} % of the disparities are then positive",
                    on_the_left ? ", and the rig says so too" : " (the rig itself is not exchanged)", share),
        share);
  } else {
    add("inverse_transform",
        fmt::format(
            "the rig has the right camera on the left, but with the inverse transform {:.0f} % of the disparities "
            "are positive",
            share),
        share);
  }
  exchanged_ = exchange && on_the_left;
  moved_ = on_the_left;
  left_ = chosen_one.left;
  right_ = chosen_one.right;
  left_from_right_ = chosen_one.left_from_right;
  matches_ = chosen_one.matches;
  fit_ = chosen_one.fit;
}

void Checker::settle_distortion() {
  constexpr double kLeastRadial = 0.02, kClearlyBetter = 0.8, kSigmas = 6;
  if (fit_.inliers < kLeastMatches || !is_linear(left_) || !is_linear(right_)) return;
  const PairFit bent = fit_of(left_.model, right_.model, true);
  const double radial = 0.5 * (bent.correction.left_radial + bent.correction.right_radial);
  const bool sure = std::abs(bent.correction.left_radial) > kSigmas * bent.sigma.left_radial ||
                    std::abs(bent.correction.right_radial) > kSigmas * bent.sigma.right_radial;
  if (!sure || std::abs(radial) < kLeastRadial || bent.rms_px > kClearlyBetter * fit_.rms_px ||
      bent.inliers < 0.9 * fit_.inliers) {
    return;
  }
  add("distortion_ignored",
      fmt::format("taken for pinholes, but the rows bend, as with a k1 of about {:.3f}; rows then agree to {:.2f} px "
                  "in the place "
                  "of {:.2f} px",
                  radial, bent.rms_px, fit_.rms_px),
      radial);
  fit_ = bent;
}

void Checker::judge_yaw() {
  const double sigma = std::hypot(fit_.sigma.yaw_rad, kYawOfLens_rad), yaw = fit_.correction.yaw_rad;
  check_.sigma.yaw_rad = sigma;
  // Disparities as given are those as corrected without the yaw: on the axis it shifts them by f times itself.
  std::vector<double> given = chosen(fit_.disparity_px, fit_.inlier);
  for (double& d : given) d += fit_.focal_px * yaw;
  const double beyond = share_below(given, kBeyondInfinity_px);
  const bool told_by_infinity = yaw < 0 && beyond > kBeyondShare && -yaw > 5 * fit_.sigma.yaw_rad &&
                                share_below(chosen(fit_.disparity_px, fit_.inlier), kBeyondInfinity_px) < 0.3 * beyond;
  if (!told_by_infinity && std::abs(yaw) < kYawSigmas * sigma) return;
  add("yaw_offset",
      fmt::format(
          "the right eye looks {:.2f}° further to the {} than the rig says{}", std::abs(yaw) * kDegreesPerRadian,
          yaw > 0 ? "right" : "left",
          told_by_infinity ? fmt::format(": {:.0f} % of the matches would be beyond infinity", 100 * beyond) : ""),
      yaw * kDegreesPerRadian);
}

void Checker::judge_fit() {
  applied_ = fit_;
  check_.inliers = fit_.inliers;
  check_.correction = fit_.correction;
  check_.sigma = fit_.sigma;
  check_.matched = chosen(matches_, fit_.inlier);
  check_.row_error_px = chosen(fit_.row_error_before_px, fit_.inlier);
  std::vector<double> taken;
  taken.reserve(check_.matched.size());
  for (const PixelMatch& match : check_.matched) taken.push_back(match.left.y() - match.right.y());
  check_.as_taken = row_errors(taken);
  check_.as_given = row_errors(check_.row_error_px);
  check_.map = map_row_errors(check_.matched, check_.row_error_px, picture_);
  const bool spread = 4 * std::ssize(check_.map) >= kRowErrorCells;
  if (check_.inliers < kLeastMatches || !spread) {
    add("not_enough_texture",
        fmt::format("only {} of {} matches agree, in {} of {} parts of the picture: too little to judge by",
                    check_.inliers, check_.matches, check_.map.size(), kRowErrorCells),
        check_.inliers);
    return;
  }
  judge_yaw();
  // What is put right leaves a yaw alone that may be the lens's.
  if (!guessed_ && !found("yaw_offset"))
    applied_ = fit_of(left_.model, right_.model, found("distortion_ignored"), false);
  check_.as_corrected = row_errors(chosen(applied_.row_error_after_px, fit_.inlier));
  if (std::abs(check_.as_given.median_px) > kRowOffset_px) {
    add("row_offset",
        fmt::format("rows of the left picture lie {:.2f} px {} those of the right one",
                    std::abs(check_.as_given.median_px), check_.as_given.median_px > 0 ? "below" : "above"),
        check_.as_given.median_px);
  }
  const double ratio = check_.correction.focal_ratio - 1;
  if (std::abs(ratio) > std::max(kFocalRatio, 5 * check_.sigma.focal_ratio)) {
    add("focal_ratio",
        fmt::format("the right eye's focal length is {:.2f} % {} than the rig says, beside the left one's",
                    100 * std::abs(ratio), ratio > 0 ? "larger" : "smaller"),
        check_.correction.focal_ratio);
  }
}

PairVerdict Checker::verdict() const {
  for (const char* id : {"not_beside", "inverse_transform", "swapped_eyes", "baseline_unit", "size_mismatch",
                         "distortion_ignored", "yaw_offset", "eyes_apart"}) {
    if (found(id)) return PairVerdict::bad;
  }
  if (found("not_enough_texture")) return PairVerdict::usable;
  const RowErrors& rows = check_.as_given;
  if (rows.mean_px > kUsableMean_px || rows.p95_px > kUsableP95_px) return PairVerdict::bad;
  const bool good = rows.mean_px <= kGoodMean_px && rows.p95_px <= kGoodP95_px && check_.findings.empty();
  return good ? PairVerdict::good : PairVerdict::usable;
}

Rig Checker::corrected_rig() const {
  Rig rig = rig_;
  const auto camera_of = [&](const std::string& name) -> Camera& {
    return *std::find_if(rig.cameras.begin(), rig.cameras.end(), [&](const Camera& c) { return c.name == name; });
  };
  StereoPair& pair =
      *std::find_if(rig.pairs.begin(), rig.pairs.end(), [&](const auto& p) { return p.name == pair_.name; });
  if (exchanged_) std::swap(pair.left, pair.right);
  Camera &left = camera_of(pair.left), &right = camera_of(pair.right);
  left.model = left_.model;
  left.size = left_.size;
  right.model = right_.model;
  right.size = right_.size;
  Pose left_from_right = left_from_right_;
  bool moved = moved_;
  if (!found("not_enough_texture") && check_.inliers >= kLeastMatches) {
    const PairCorrection& correction = applied_.correction;
    left_from_right = corrected_left_from_right(left_from_right, correction);
    moved = true;
    right.model = with_focal_times(right.model, correction.focal_ratio);
    if (found("distortion_ignored")) {
      left.model = with_radial(left.model, correction.left_radial);
      right.model = with_radial(right.model, correction.right_radial);
    }
  }
  if (found("baseline_unit")) {
    const double length = left_from_right.translation().norm();
    const double factor = length < 1 ? 1000 : length > 30 ? 0.001 : 0.01;
    left_from_right = Pose(left_from_right.rotation(), factor * left_from_right.translation());
    moved = true;
  }
  if (moved) right.mount_from_camera = left.mount_from_camera * left_from_right;
  return rig;
}

PairCheck Checker::finish() {
  check_.verdict = verdict();
  check_.corrected = corrected_rig();
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

PairCheck check_pair(const Rig& rig, const StereoPair& pair, std::vector<PixelMatch> matches, ImageSize picture_size) {
  return Checker(rig, pair, std::move(matches), picture_size, false).run();
}

PairCheck check_pictures(std::vector<PixelMatch> matches, ImageSize picture_size) {
  const Rig rig = guessed_rig(picture_size);
  return Checker(rig, rig.pairs.front(), std::move(matches), picture_size, true).run();
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
