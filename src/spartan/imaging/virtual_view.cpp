#include "spartan/imaging/virtual_view.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace spartan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A power of two: central cameras give the same bits as at depth 1.
constexpr double kFar_m = 1 << 20;
// cos 85°: beyond, a plane would have to be eleven times as wide as far.
constexpr double kLeastCosine = 0.0871557, kLargestTangent = 11.430052;
// tan 70°: beyond, a plane stretches what is seen to more than eight times its size.
constexpr double kFarthestTangent = 2.747477;

constexpr const char* kNoCommonView = "the two eyes have no common view";

/// Points of the view's plane at depth 1 ↔ pixels of one eye.
class EyeOnPlane {
 public:
  EyeOnPlane(const TurnedEye& eye, double depth_m)
      : camera_(eye.camera), camera_from_rectified_(eye.camera_from_rectified), depth_(depth_m) {}

  bool sees(const Vector2d& point) const {
    const auto pixel = project(camera_.model, camera_from_rectified_ * (depth_ * point.homogeneous()));
    return pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= camera_.size.width - 1 &&
           pixel->y() <= camera_.size.height - 1;
  }

  /// Along the edge of the sensor, or of what the model has an answer for inside it. Directions, z not always positive.
  std::vector<Vector3d> outline() const {
    constexpr int kPerSide = 32;
    const double right = camera_.size.width - 1, bottom = camera_.size.height - 1;
    std::vector<Vector3d> points;
    points.reserve(4 * (kPerSide + 1));
    for (int i = 0; i <= kPerSide; ++i) {
      const double part = static_cast<double>(i) / kPerSide;
      for (const Vector2d& pixel : {Vector2d(part * right, 0), Vector2d(part * right, bottom),
                                    Vector2d(0, part * bottom), Vector2d(right, part * bottom)}) {
        if (const auto point = outermost(pixel)) points.push_back(*point);
      }
    }
    return points;
  }

 private:
  std::optional<Vector3d> direction_of(const Vector2d& pixel) const {
    const auto ray = unproject(camera_.model, pixel);
    if (!ray) return std::nullopt;
    const Vector3d origin = camera_from_rectified_.transpose() * ray->origin;
    const Vector3d direction = camera_from_rectified_.transpose() * ray->direction;
    if (direction.z() <= 0) return direction.normalized();
    return (origin + (depth_ - origin.z()) / direction.z() * direction).normalized();
  }

  // The edge of the model's domain on the way from the image's middle to a pixel of its border.
  std::optional<Vector3d> outermost(const Vector2d& pixel) const {
    if (auto whole = direction_of(pixel)) return whole;
    const Vector2d middle((camera_.size.width - 1) / 2.0, (camera_.size.height - 1) / 2.0);
    auto found = direction_of(middle);
    double known = 0, unknown = 1;
    for (int i = 0; found && i < 20; ++i) {
      const double part = (known + unknown) / 2;
      const auto point = direction_of(middle + part * (pixel - middle));
      (point ? known : unknown) = part;
      if (point) found = point;
    }
    return found;
  }

  const Camera& camera_;
  Eigen::Matrix3d camera_from_rectified_;
  double depth_;
};

struct Eyes {
  EyeOnPlane left, right;
  bool both_see(const Vector2d& point) const { return left.sees(point) && right.sees(point); }
};

Vector2d middle_of(ImageSize size) {
  return {(size.width - 1) / 2.0, (size.height - 1) / 2.0};
}

/// Where a direction meets the plane at depth 1; at most 70° from the plane's axis.
Vector2d on_plane(const Vector3d& direction) {
  const double length = direction.head<2>().norm();
  if (length < kFarthestTangent * direction.z()) return direction.hnormalized();
  return direction.head<2>() * (kFarthestTangent / length);
}

/// The mean of an eye's outline on the plane at depth 1. What lies far from the axis has no more say than what lies at
/// 70°: a fisheye's picture ends at 84° on one side and 86° on the other, and they are as far apart as 0° and 67°.
std::optional<Vector2d> mean_outline(const EyeOnPlane& eye) {
  Vector2d sum = Vector2d::Zero();
  int count = 0;
  for (const Vector3d& direction : eye.outline()) {
    sum += on_plane(direction);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

// --- all_valid ---

/// Whether both eyes see every border pixel of a view around `centre` (at depth 1) with this focal length.
bool border_is_seen(const Eyes& eyes, const Vector2d& centre, double focal_px, ImageSize size, int step) {
  const Vector2d half = middle_of(size);
  const auto seen = [&](double x, double y) { return eyes.both_see(centre + (Vector2d(x, y) - half) / focal_px); };
  const double right = size.width - 1, bottom = size.height - 1;
  for (int x = 0; x < size.width + step; x += step) {
    const double at = std::min<double>(x, right);
    if (!seen(at, 0) || !seen(at, bottom)) return false;
  }
  for (int y = 0; y < size.height + step; y += step) {
    const double at = std::min<double>(y, bottom);
    if (!seen(0, at) || !seen(right, at)) return false;
  }
  return true;
}

/// The widest view around a centre, as 1 / focal length; 0 where not even the centre is seen.
double widest_around(const Eyes& eyes, const Vector2d& centre, ImageSize size, double most) {
  const int step = std::max(1, std::min(size.width, size.height) / 16);
  if (!eyes.both_see(centre)) return 0;
  double fits = 0, too_wide = most;
  for (int i = 0; i < 24; ++i) {
    const double width = (fits + too_wide) / 2;
    (border_is_seen(eyes, centre, 1 / width, size, step) ? fits : too_wide) = width;
  }
  return fits;
}

struct Fit {
  Vector2d centre;
  double width;  ///< 1 / focal length
};

/// Climbs from `start` to the centre of the largest view by steps along the axes and diagonals that are halved.
Fit largest_view(const Eyes& eyes, const Vector2d& start, ImageSize size) {
  const double most = 2 * kLargestTangent / std::max(size.width, size.height);
  Fit best{start, widest_around(eyes, start, size, most)};
  for (double step = 0.3; step > 1e-5; step /= 2) {
    bool climbs = true;
    for (int i = 0; climbs && i < 20; ++i) {
      climbs = false;
      for (const Vector2d& way : {Vector2d(1, 0), Vector2d(-1, 0), Vector2d(0, 1), Vector2d(0, -1), Vector2d(1, 1),
                                  Vector2d(1, -1), Vector2d(-1, 1), Vector2d(-1, -1)}) {
        const Vector2d centre = best.centre + step * way;
        const double width = widest_around(eyes, centre, size, most);
        if (width <= best.width * (1 + 1e-9)) continue;
        best = {centre, width};
        climbs = true;
      }
    }
  }
  return best;
}

Result<RectifiedStereo> show_what_both_see(const Eyes& eyes, const Vector2d& start, ImageSize size, double focal_px,
                                           const std::string& where) {
  const Fit fit = largest_view(eyes, start, size);
  if (!(fit.width > 0)) return failure(ErrorCode::configuration, kNoCommonView, where);
  double least = 1 / fit.width;
  // The search looked at some pixels of the border; all of them decide.
  while (!border_is_seen(eyes, fit.centre, least, size, 1)) least *= 1.0002;
  if (focal_px > 0 && focal_px < least) {
    return failure(ErrorCode::configuration,
                   fmt::format("a view of {} × {} px with a focal length of {:.6g} px has pixels that an eye does not "
                               "see; the least focal length is {:.6g} px",
                               size.width, size.height, focal_px, least),
                   where, "take a longer focal length, a smaller size, or another policy");
  }
  const double focal = focal_px > 0 ? focal_px : least;
  return RectifiedStereo{size, focal, middle_of(size) - focal * fit.centre, 0};
}

// --- whole_view ---

Result<RectifiedStereo> show_what_either_sees(const Eyes& eyes, ImageSize size, double focal_px,
                                              const std::string& where) {
  Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const EyeOnPlane* eye : {&eyes.left, &eyes.right}) {
    for (const Vector3d& direction : eye->outline()) {
      if (direction.z() < kLeastCosine) {
        return failure(ErrorCode::configuration,
                       "an eye sees more than 85° from the view's axis: no plane shows all of it", where,
                       "take another policy, such as keep_resolution with a shorter focal length");
      }
      low = low.cwiseMin(direction.hnormalized());
      high = high.cwiseMax(direction.hnormalized());
    }
  }
  const Vector2d extent = high - low;
  if (!(extent.minCoeff() > 0)) return failure(ErrorCode::configuration, kNoCommonView, where);
  const double longest = std::min((size.width - 1) / extent.x(), (size.height - 1) / extent.y());
  if (focal_px > longest) {
    return failure(ErrorCode::configuration,
                   fmt::format("with a focal length of {:.6g} px not all that the eyes see fits into {} × {} px; the "
                               "longest is {:.6g} px",
                               focal_px, size.width, size.height, longest),
                   where, "take a shorter focal length, a larger size, or another policy");
  }
  const double focal = focal_px > 0 ? focal_px : longest;
  return RectifiedStereo{size, focal, middle_of(size) - focal * (low + high) / 2, 0};
}

/// What no policy can make a view of. Tables and images of a pair take 12 bytes a pixel of the view.
Status check_numbers(ImageSize size, const VirtualView& view, const std::string& where) {
  constexpr std::int64_t kLargestArea = 1 << 26;
  if (size.width < 2 || size.height < 2 || std::int64_t{size.width} * size.height > kLargestArea) {
    return failure(ErrorCode::configuration,
                   fmt::format("a view of {} × {} px cannot be made: at least 2 × 2 px, at most {} in all", size.width,
                               size.height, kLargestArea),
                   where, "choose another size (imaging.view.width_px, height_px)");
  }
  if (!(view.focal_px >= 0) || !std::isfinite(view.focal_px)) {
    return failure(ErrorCode::configuration, fmt::format("a view has no focal length of {} px", view.focal_px), where);
  }
  if (!(view.depth_m >= 0) || !std::isfinite(view.depth_m)) {
    return failure(ErrorCode::configuration, fmt::format("a view has no depth of {} m", view.depth_m), where);
  }
  return {};
}

}  // namespace

double depth_of(const VirtualView& view) {
  return view.depth_m > 0 ? view.depth_m : kFar_m;
}

std::optional<double> resolution_on_axis(const Camera& camera, double depth_m) {
  const auto projection = project_with_jacobian(camera.model, depth_m * Vector3d::UnitZ());
  if (!projection) return std::nullopt;
  return depth_m * std::sqrt(std::abs(projection->by_point.leftCols<2>().determinant()));
}

Result<RectifiedStereo> choose_view(const TurnedEye& left, const TurnedEye& right, const VirtualView& view,
                                    const std::string& where) {
  const double depth = depth_of(view);
  const Eyes eyes{{left, depth}, {right, depth}};
  const ImageSize size = view.size.empty() ? left.camera.size : view.size;
  if (Status status = check_numbers(size, view, where); !status) return failure(status);
  if (view.policy == ViewPolicy::whole_view) return show_what_either_sees(eyes, size, view.focal_px, where);

  const auto left_resolution = resolution_on_axis(left.camera, depth);
  const auto right_resolution = resolution_on_axis(right.camera, depth);
  if (!left_resolution || !right_resolution) return failure(ErrorCode::configuration, kNoCommonView, where);
  const double natural_focal = (*left_resolution + *right_resolution) / 2;
  const auto left_outline = mean_outline(eyes.left), right_outline = mean_outline(eyes.right);
  if (!left_outline || !right_outline) return failure(ErrorCode::configuration, kNoCommonView, where);
  const Vector2d centre = (*left_outline + *right_outline) / 2;
  if (view.policy == ViewPolicy::all_valid) return show_what_both_see(eyes, centre, size, view.focal_px, where);
  const double focal = view.focal_px > 0 ? view.focal_px : natural_focal;
  return RectifiedStereo{size, focal, middle_of(size) - focal * centre, 0};
}

}  // namespace spartan
