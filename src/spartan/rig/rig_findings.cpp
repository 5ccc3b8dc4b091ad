#include "spartan/rig/rig_findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/rig/describe.h"

namespace spartan {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
// Beyond these a pair is more likely misread than built that way.
constexpr double kLongBaseline_m = 3, kShortBaseline_m = 0.005, kLargestTurn_deg = 15;
// So long are baselines that were given in other units.
constexpr double kCentimetresFrom = 10, kMillimetresFrom = 30;
// How far the principal point may lie from the middle, and fx from fy, as factors.
constexpr double kMiddle = 1.4, kAspect = 1.3, kAspectToAsk = 1.05;
constexpr double kNarrowest_deg = 3, kWidestLinear_deg = 150;

struct OnAxis {
  Eigen::Vector2d centre;
  Eigen::Matrix2d by_direction;  // ∂(u, v)/∂(x/z, y/z)
};
std::optional<OnAxis> look_ahead(const CameraModel& model) {
  const auto ahead = project_with_jacobian(model, Eigen::Vector3d::UnitZ());
  if (!ahead) return std::nullopt;
  return OnAxis{ahead->pixel, ahead->by_point.leftCols<2>()};
}

// The factor of a picture whose middle the principal point would be.
std::optional<double> middle_factor(const Camera& camera, const OnAxis& axis) {
  const double along = axis.centre.x() / (0.5 * (camera.size.width - 1)),
               down = axis.centre.y() / (0.5 * (camera.size.height - 1));
  const bool alike = along > 0 && down > 0 && std::abs(std::log(along / down)) < std::log(1.3);
  if (!alike || (std::min(along, down) <= kMiddle && std::max(along, down) >= 1 / kMiddle)) return std::nullopt;
  return std::sqrt(along * down);
}

double aspect_of(const OnAxis& axis) {
  return std::abs(axis.by_direction(0, 0) / axis.by_direction(1, 1));
}

// Its axis may lie aside where a picture was cut out; in the very corner or beyond the border it is more likely missing
// or misread. The corner is (−0.5, −0.5) to (1, 1), as formats count.
constexpr double kCorner_px = 1;
bool is_in_the_corner(const Eigen::Vector2d& centre) {
  return centre.cwiseAbs().maxCoeff() <= kCorner_px;
}
bool lies_outside(const Eigen::Vector2d& centre, ImageSize size) {
  return centre.minCoeff() < -0.5 || centre.x() > size.width - 0.5 || centre.y() > size.height - 0.5;
}

// No "-0" for what is next to nothing.
double whole(double value) {
  return std::round(value) + 0.0;
}

constexpr const char* kMillimetres = ": is it in millimetres? In pixels it is that over the size of a pixel";

// `who`: "camera left", or both where they are equal.
void check_camera(const std::string& who, const Camera& camera, ImageSize picture, std::vector<RigFinding>& findings) {
  const auto mismatch = [&](const std::string& text, double value) {
    findings.push_back({"size_mismatch", fmt::format("{}: {}", who, text), value});
  };
  const auto [width, height] = camera.size;
  if (!picture.empty() && picture != camera.size) {
    const auto factor = size_factor(camera.size, picture);
    return mismatch(
        fmt::format("the calibration is of pictures of {} x {} px, these have {} x {}{}", width, height, picture.width,
                    picture.height, factor ? "" : ": no enlargement, but a part of them or other pictures"),
        factor.value_or(static_cast<double>(picture.width) / width));
  }
  const auto axis = look_ahead(camera.model);
  if (!axis) return;
  if (const auto factor = middle_factor(camera, *axis)) {
    return mismatch(
        fmt::format("the optical axis meets the picture at ({:.0f}, {:.0f}), which would be the middle of {:.0f} "
                    "x {:.0f} px, not of {} x {}: is the calibration that of another picture size?",
                    axis->centre.x(), axis->centre.y(), *factor * width, *factor * height, width, height),
        1 / *factor);
  }
  const Eigen::Vector2d middle(0.5 * (width - 1), 0.5 * (height - 1));
  const bool corner = is_in_the_corner(axis->centre);
  if (corner || lies_outside(axis->centre, camera.size)) {
    const double away_px = (axis->centre - middle).norm();
    return mismatch(
        fmt::format("the optical axis meets the picture at ({:.0f}, {:.0f}), {}, {:.0f} px from the middle of {} x {} "
                    "px: is the principal point missing, or that of a larger picture which this one was cut from? "
                    "Where it is not known, ({:.1f}, {:.1f}) is a beginning",
                    whole(axis->centre.x()), whole(axis->centre.y()), corner ? "its corner" : "outside of it", away_px,
                    width, height, middle.x(), middle.y()),
        away_px);
  }
  const double fx = std::abs(axis->by_direction(0, 0)), fy = std::abs(axis->by_direction(1, 1));
  if (std::abs(std::log(aspect_of(*axis))) > std::log(kAspectToAsk)) {
    return mismatch(fmt::format("fx is {:.1f} and fy {:.1f} px: is one of them that of another picture size?", fx, fy),
                    aspect_of(*axis));
  }
  const double view_deg = 2 * std::atan(0.5 * width / fx) * kDegreesPerRadian;
  if (is_linear(camera) && !(view_deg > kNarrowest_deg && view_deg < kWidestLinear_deg)) {
    return mismatch(fmt::format("a focal length of {:.1f} px gives a view of {:.1f}° for {} px{}", fx, view_deg, width,
                                fx < width ? kMillimetres : ""),
                    view_deg);
  }
  if (!has_possible_focal(camera)) {
    mismatch(fmt::format("a focal length of {:.1f} px is that of no lens for pictures of {} px{}", fx, width,
                         fx < width ? kMillimetres : ""),
             fx);
  }
}

// A baseline that is too long or too short, with what it would be in other units: the likelier one first, which is what
// a corrected rig has.
std::string doubt_of_baseline(double baseline_m) {
  const auto unit = likelier_unit(baseline_m);
  const std::string cm = describe_length(0.01 * baseline_m), mm = describe_length(0.001 * baseline_m);
  if (!unit) {
    return fmt::format(
        "a baseline of {:.4g} m, as large rigs have. In centimetres it would be {}, in millimetres {}: no unit is "
        "likelier, and it is left as it is",
        baseline_m, cm, mm);
  }
  const std::string likely = describe_length(unit->metres * baseline_m);
  if (baseline_m < 1)
    return fmt::format("a baseline of {:.4g} m: was it divided by 1000 twice? It would be {}", baseline_m, likely);
  const bool in_mm = unit->metres < 0.01;
  return fmt::format("a baseline of {:.4g} m: was it given in {}? It would be {} (in {} {})", baseline_m, unit->name,
                     likely, in_mm ? "centimetres" : "millimetres", in_mm ? cm : mm);
}

}  // namespace

std::optional<double> size_factor(ImageSize calibration, ImageSize picture) {
  const double across = static_cast<double>(picture.width) / calibration.width,
               down = static_cast<double>(picture.height) / calibration.height;
  if (!(std::abs(std::log(across / down)) < 0.01)) return std::nullopt;
  return across;
}

std::optional<double> size_told_by_centre(const Camera& camera) {
  const auto axis = look_ahead(camera.model);
  const auto factor = axis ? middle_factor(camera, *axis) : std::nullopt;
  return factor ? std::optional(1 / *factor) : std::nullopt;
}

AspectDoubt doubt_of_aspect(const Camera& camera) {
  const auto axis = look_ahead(camera.model);
  const double difference = axis ? std::abs(std::log(aspect_of(*axis))) : 0;
  if (difference > std::log(kAspect)) return AspectDoubt::strong;
  return difference > std::log(kAspectToAsk) ? AspectDoubt::some : AspectDoubt::none;
}

bool has_possible_focal(const Camera& camera) {
  constexpr double kLeast = 0.1, kMost = 20;
  const auto axis = look_ahead(camera.model);
  const double focal_px = axis ? std::sqrt(std::abs(axis->by_direction.determinant())) : 0;
  return focal_px > kLeast * camera.size.width && focal_px < kMost * camera.size.width;
}

bool is_linear(const Camera& camera) {
  const auto axis = look_ahead(camera.model);
  if (!axis) return false;
  const double last_x = camera.size.width - 1, last_y = camera.size.height - 1;
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(0, 0), {last_x, 0}, {0, last_y}, {last_x, last_y}, {0.5 * last_x, 0}, {0, 0.5 * last_y}}) {
    const auto ray = unproject(camera.model, pixel);
    if (!ray || !(ray->direction.z() > 0)) return false;
    const Eigen::Vector2d straight = axis->centre + axis->by_direction * ray->direction.head<2>() / ray->direction.z();
    if (!((straight - pixel).norm() < 0.5)) return false;
  }
  return true;
}

std::optional<BaselineUnit> likelier_unit(double baseline_m) {
  if (baseline_m >= kMillimetresFrom) return BaselineUnit{"millimetres", 0.001};
  if (baseline_m >= kCentimetresFrom) return BaselineUnit{"centimetres", 0.01};
  if (baseline_m < kShortBaseline_m) return BaselineUnit{"kilometres", 1000};
  return std::nullopt;
}

std::vector<RigFinding> find_doubts(const Rig& rig, const StereoPair& pair, ImageSize picture_size) {
  std::vector<RigFinding> findings;
  const Pose left_from_right = rig.right_from_left(pair).inverse();
  const Eigen::Vector3d& t = left_from_right.translation();
  const double aside_m = std::max(std::abs(t.y()), std::abs(t.z()));
  if (std::abs(t.x()) < aside_m) {
    findings.push_back(
        {"not_beside", "the right camera does not stand beside the left one: a transform in other axes?", aside_m});
  } else if (t.x() < 0) {
    const std::string place =
        fmt::format("the right camera stands to the LEFT of the left one, by {:.1f} mm", -1000 * t.x());
    findings.push_back({"inverse_transform", place + ": is the transform the inverse of what it should be?", t.x()});
    findings.push_back({"swapped_eyes", place + ": or are left and right exchanged?", t.x()});
  }
  if (t.norm() > kLongBaseline_m || t.norm() < kShortBaseline_m)
    findings.push_back({"baseline_unit", doubt_of_baseline(t.norm()), t.norm()});
  const double turned_deg = rotation_angle(left_from_right) * kDegreesPerRadian;
  if (turned_deg > kLargestTurn_deg) {
    findings.push_back(
        {"eyes_apart", fmt::format("the eyes are turned by {:.2f}° to each other", turned_deg), turned_deg});
  }
  const Camera &left = *rig.find_camera(pair.left), &right = *rig.find_camera(pair.right);
  if (left.size == right.size && left.model == right.model) {
    check_camera(fmt::format("cameras {} and {}", left.name, right.name), left, picture_size, findings);
    return findings;
  }
  for (const Camera* camera : {&left, &right}) check_camera("camera " + camera->name, *camera, picture_size, findings);
  return findings;
}

}  // namespace spartan
