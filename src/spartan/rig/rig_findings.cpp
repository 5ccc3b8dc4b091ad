#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/rig/describe.h"

namespace spartan {
namespace {

// The limits in this file are empirical.
// Beyond these a calibration error is more likely than such a rig.
constexpr double kLongBaseline_m = 3, kShortBaseline_m = 0.005, kMaxRotation_deg = 15;
// Baselines, read as metres, from which on another unit is likely.
constexpr double kCentimetresFrom = 10, kMillimetresFrom = 30;
// Plausible ratios: principal point over image centre; fx over fy, beyond which the aspect is implausible and notable.
constexpr double kMaxCentreRatio = 1.4, kImplausibleAspect = 1.3, kNotableAspect = 1.05;
// Plausible horizontal fields of view of a pinhole.
constexpr double kMinView_deg = 3, kMaxPinholeView_deg = 150;

// A camera model on its optical axis: principal point and focal lengths, whatever the model.
struct OnAxis {
  Eigen::Vector2d centre;
  Eigen::Matrix2d by_direction;  // ∂(u, v)/∂(x/z, y/z)
};
std::optional<OnAxis> project_axis(const CameraModel& model) {
  const auto ahead = project_with_jacobian(model, Eigen::Vector3d::UnitZ());
  if (!ahead) return std::nullopt;
  return OnAxis{ahead->pixel, ahead->by_point.leftCols<2>()};
}

// The factor on the image size with which the principal point would be the image centre; none where it is plausible, or
// where x and y disagree by more than 30 %.
std::optional<double> centre_factor(const Camera& camera, const OnAxis& axis) {
  const double x_ratio = axis.centre.x() / (0.5 * (camera.size.width - 1)),
               y_ratio = axis.centre.y() / (0.5 * (camera.size.height - 1));
  const bool alike = x_ratio > 0 && y_ratio > 0 && std::abs(std::log(x_ratio / y_ratio)) < std::log(1.3);
  if (!alike || (std::min(x_ratio, y_ratio) <= kMaxCentreRatio && std::max(x_ratio, y_ratio) >= 1 / kMaxCentreRatio))
    return std::nullopt;
  return std::sqrt(x_ratio * y_ratio);
}

double aspect_of(const OnAxis& axis) {
  return std::abs(axis.by_direction(0, 0) / axis.by_direction(1, 1));
}

// A cropped image has its principal point off the centre. In the very corner or outside of the image it is more likely
// missing or wrong. The corner is (−0.5, −0.5) to (1, 1), for formats count pixels from different origins.
constexpr double kCorner_px = 1;
bool is_at_corner(const Eigen::Vector2d& centre) {
  return centre.cwiseAbs().maxCoeff() <= kCorner_px;
}
bool is_outside(const Eigen::Vector2d& centre, ImageSize size) {
  return centre.minCoeff() < -0.5 || centre.x() > size.width - 0.5 || centre.y() > size.height - 0.5;
}

// Rounded, and never "-0".
double rounded(double value) {
  return std::round(value) + 0.0;
}

constexpr const char* kMillimetres = ": if it is in millimetres, divide it by the pixel size";

// `who`: "camera left", or both cameras where they are equal.
void check_camera(const std::string& who, const Camera& camera, ImageSize image_size,
                  std::vector<RigFinding>& findings) {
  const auto mismatch = [&](const std::string& text, double value) {
    findings.push_back({"size_mismatch", fmt::format("{}: {}", who, text), value});
  };
  const auto [width, height] = camera.size;
  if (!image_size.empty() && image_size != camera.size) {
    const auto factor = size_factor(camera.size, image_size);
    return mismatch(fmt::format("the calibration is for images of {} x {} px, the given images have {} x {} px{}",
                                width, height, image_size.width, image_size.height,
                                factor ? "" : ": the aspect ratio differs, so they are cropped or from another camera"),
                    factor.value_or(static_cast<double>(image_size.width) / width));
  }
  const auto axis = project_axis(camera.model);
  if (!axis) return;
  if (const auto factor = centre_factor(camera, *axis)) {
    return mismatch(
        fmt::format(
            "the principal point ({:.0f}, {:.0f}) would be the centre of an image of {:.0f} x {:.0f} px, not of "
            "{} x {} px: check whether the calibration is for another image size",
            axis->centre.x(), axis->centre.y(), *factor * width, *factor * height, width, height),
        1 / *factor);
  }
  const Eigen::Vector2d image_centre(0.5 * (width - 1), 0.5 * (height - 1));
  const bool at_corner = is_at_corner(axis->centre);
  if (at_corner || is_outside(axis->centre, camera.size)) {
    const double away_px = (axis->centre - image_centre).norm();
    return mismatch(
        fmt::format(
            "the principal point ({:.0f}, {:.0f}) is {}, {:.0f} px from the centre of {} x {} px: check whether "
            "it is missing, or that of the larger image from which this one was cropped. If it is unknown, start "
            "with ({:.1f}, {:.1f})",
            rounded(axis->centre.x()), rounded(axis->centre.y()),
            at_corner ? "at the corner of the image" : "outside of the image", away_px, width, height, image_centre.x(),
            image_centre.y()),
        away_px);
  }
  const double fx = std::abs(axis->by_direction(0, 0)), fy = std::abs(axis->by_direction(1, 1));
  if (std::abs(std::log(aspect_of(*axis))) > std::log(kNotableAspect)) {
    return mismatch(
        fmt::format("fx is {:.1f} and fy {:.1f} px: check whether one of them is for another image size", fx, fy),
        aspect_of(*axis));
  }
  const double view_deg = 2 * std::atan(0.5 * width / fx) * kDegreesPerRadian;
  if (is_distortion_free(camera) && !(view_deg > kMinView_deg && view_deg < kMaxPinholeView_deg)) {
    return mismatch(fmt::format("a focal length of {:.1f} px gives a field of view of {:.1f}° over {} px{}", fx,
                                view_deg, width, fx < width ? kMillimetres : ""),
                    view_deg);
  }
  if (!has_plausible_focal_length(camera)) {
    mismatch(fmt::format("a focal length of {:.1f} px is implausible for images {} px wide{}", fx, width,
                         fx < width ? kMillimetres : ""),
             fx);
  }
}

// Text for an implausible baseline, with its length in other units: first the likely unit, which a corrected rig uses.
std::string describe_baseline(double baseline_m) {
  const auto unit = likely_unit(baseline_m);
  const std::string cm = describe_length(0.01 * baseline_m), mm = describe_length(0.001 * baseline_m);
  if (!unit) {
    return fmt::format(
        "a baseline of {:.4g} m is unusually long. Read as centimetres it would be {}, as millimetres {}: no other "
        "unit is likely, and it is not changed",
        baseline_m, cm, mm);
  }
  const std::string likely = describe_length(unit->metres * baseline_m);
  if (baseline_m < 1) {
    return fmt::format("a baseline of {:.4g} m was probably divided by 1000 twice: it would then be {}", baseline_m,
                       likely);
  }
  const bool in_mm = unit->metres < 0.01;
  return fmt::format("a baseline of {:.4g} m is probably given in {}: it would then be {} (in {} {})", baseline_m,
                     unit->name, likely, in_mm ? "centimetres" : "millimetres", in_mm ? cm : mm);
}

}  // namespace

std::optional<double> size_factor(ImageSize calibration, ImageSize image_size) {
  const double x_factor = static_cast<double>(image_size.width) / calibration.width,
               y_factor = static_cast<double>(image_size.height) / calibration.height;
  if (!(std::abs(std::log(x_factor / y_factor)) < 0.01)) return std::nullopt;
  return x_factor;
}

std::optional<double> size_factor_from_centre(const Camera& camera) {
  const auto axis = project_axis(camera.model);
  const auto factor = axis ? centre_factor(camera, *axis) : std::nullopt;
  return factor ? std::optional(1 / *factor) : std::nullopt;
}

AspectDeviation aspect_deviation(const Camera& camera) {
  const auto axis = project_axis(camera.model);
  const double difference = axis ? std::abs(std::log(aspect_of(*axis))) : 0;
  if (difference > std::log(kImplausibleAspect)) return AspectDeviation::implausible;
  return difference > std::log(kNotableAspect) ? AspectDeviation::notable : AspectDeviation::none;
}

bool has_plausible_focal_length(const Camera& camera) {
  constexpr double kMin = 0.1, kMax = 20;  // of the image width
  const auto axis = project_axis(camera.model);
  const double focal_px = axis ? std::sqrt(std::abs(axis->by_direction.determinant())) : 0;
  return focal_px > kMin * camera.size.width && focal_px < kMax * camera.size.width;
}

bool is_distortion_free(const Camera& camera) {
  const auto axis = project_axis(camera.model);
  if (!axis) return false;
  const double last_x = camera.size.width - 1, last_y = camera.size.height - 1;
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(0, 0), {last_x, 0}, {0, last_y}, {last_x, last_y}, {0.5 * last_x, 0}, {0, 0.5 * last_y}}) {
    const auto ray = unproject(camera.model, pixel);
    if (!ray || !(ray->direction.z() > 0)) return false;
    const Eigen::Vector2d pinhole = axis->centre + axis->by_direction * ray->direction.head<2>() / ray->direction.z();
    if (!((pinhole - pixel).norm() < 0.5)) return false;
  }
  return true;
}

std::optional<BaselineUnit> likely_unit(double baseline_m) {
  if (baseline_m >= kMillimetresFrom) return BaselineUnit{"millimetres", 0.001};
  if (baseline_m >= kCentimetresFrom) return BaselineUnit{"centimetres", 0.01};
  if (baseline_m < kShortBaseline_m) return BaselineUnit{"kilometres", 1000};
  return std::nullopt;
}

std::vector<RigFinding> plausibility_findings(const Rig& rig, const StereoPair& pair, ImageSize image_size) {
  std::vector<RigFinding> findings;
  const Pose left_from_right = rig.right_from_left(pair).inverse();
  const Eigen::Vector3d& t = left_from_right.translation();
  const double off_axis_m = std::max(std::abs(t.y()), std::abs(t.z()));
  if (std::abs(t.x()) < off_axis_m) {
    findings.push_back({"not_side_by_side",
                        "the right camera is not beside the left one: check the axis convention of the transform",
                        off_axis_m});
  } else if (t.x() < 0) {
    const std::string position =
        fmt::format("the right camera is {:.1f} mm to the LEFT of the left one", -1000 * t.x());
    findings.push_back({"inverse_transform", position + ": check whether the transform is inverted", t.x()});
    findings.push_back({"swapped_eyes", position + ": check whether left and right are swapped", t.x()});
  }
  if (t.norm() > kLongBaseline_m || t.norm() < kShortBaseline_m)
    findings.push_back({"baseline_unit", describe_baseline(t.norm()), t.norm()});
  const double rotation_deg = rotation_angle(left_from_right) * kDegreesPerRadian;
  if (rotation_deg > kMaxRotation_deg) {
    findings.push_back({"large_rotation",
                        fmt::format("the cameras are rotated by {:.2f}° relative to each other", rotation_deg),
                        rotation_deg});
  }
  const Camera &left = *rig.find_camera(pair.left), &right = *rig.find_camera(pair.right);
  if (left.size == right.size && left.model == right.model) {
    check_camera(fmt::format("cameras {} and {}", left.name, right.name), left, image_size, findings);
    return findings;
  }
  for (const Camera* camera : {&left, &right}) check_camera("camera " + camera->name, *camera, image_size, findings);
  return findings;
}

}  // namespace spartan
