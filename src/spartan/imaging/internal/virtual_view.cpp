#include "spartan/imaging/internal/virtual_view.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace spartan::internal {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Depth used for infinity, m. A power of two, so that central cameras give the same bits as at depth 1.
constexpr double kFar_m = 1 << 20;
// cos 85° and tan 85°: a plane that shows more has to be wider than 11 times its distance to either side.
constexpr double kMinCosine = 0.0871557, kMaxTangent = 11.430052;
// tan 70°: further out a plane magnifies radially by more than a factor of 8 (1 / cos² 70°).
constexpr double kOutlineTangent = 2.747477;

constexpr const char* kNoCommonView = "the two cameras have no common view";

/// Maps between points of the view plane at depth 1 and pixels of one camera.
class PlaneProjection {
 public:
  PlaneProjection(const RotatedCamera& camera, double depth_m)
      : camera_(camera.camera), camera_from_rectified_(camera.camera_from_rectified), depth_(depth_m) {}

  bool sees(const Vector2d& point) const {
    const auto pixel = project(camera_.model, camera_from_rectified_ * (depth_ * point.homogeneous()));
    return pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= camera_.size.width - 1 &&
           pixel->y() <= camera_.size.height - 1;
  }

  /// Directions, in the rectified frame, along the edge of the sensor or of the model's domain inside it. z may be
  /// negative.
  std::vector<Vector3d> outline() const {
    constexpr int kPerSide = 32;  // points per side of the sensor
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

  // The direction of a border pixel or, by bisection, of the edge of the model's domain on the line from the image
  // centre.
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

struct Cameras {
  PlaneProjection left, right;
  bool both_see(const Vector2d& point) const { return left.sees(point) && right.sees(point); }
};

Vector2d middle_of(ImageSize size) {
  return {(size.width - 1) / 2.0, (size.height - 1) / 2.0};
}

/// The intersection of a direction with the plane at depth 1; clamped to 70° from the optical axis of the view.
Vector2d on_plane(const Vector3d& direction) {
  const double length = direction.head<2>().norm();
  if (length < kOutlineTangent * direction.z()) return direction.hnormalized();
  return direction.head<2>() * (kOutlineTangent / length);
}

/// The mean of a camera's outline on the plane at depth 1. Directions beyond 70° are clamped; otherwise they dominate
/// the mean: on the plane the midpoint of 84° on one side and 86° on the other is at 67°.
std::optional<Vector2d> mean_outline(const PlaneProjection& camera) {
  Vector2d sum = Vector2d::Zero();
  int count = 0;
  for (const Vector3d& direction : camera.outline()) {
    sum += on_plane(direction);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

// --- all_valid ---

/// Whether both cameras see every `step`-th border pixel of a view around `centre` (at depth 1) with this focal length.
bool border_is_seen(const Cameras& cameras, const Vector2d& centre, double focal_px, ImageSize size, int step) {
  const Vector2d half = middle_of(size);
  const auto seen = [&](double x, double y) { return cameras.both_see(centre + (Vector2d(x, y) - half) / focal_px); };
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

/// The widest view around a centre by bisection, as 1 / focal length; 0 where not even the centre is seen.
double widest_view_around(const Cameras& cameras, const Vector2d& centre, ImageSize size, double max_width) {
  const int step = std::max(1, std::min(size.width, size.height) / 16);
  if (!cameras.both_see(centre)) return 0;
  double fits = 0, too_wide = max_width;
  // 24 bisections: to 2⁻²⁴ of the widest view.
  for (int i = 0; i < 24; ++i) {
    const double width = (fits + too_wide) / 2;
    (border_is_seen(cameras, centre, 1 / width, size, step) ? fits : too_wide) = width;
  }
  return fits;
}

struct CentredView {
  Vector2d centre;
  double width;  ///< 1 / focal length
};

/// Hill climbing from `start` to the centre of the widest view, by steps along axes and diagonals that are halved.
CentredView largest_view(const Cameras& cameras, const Vector2d& start, ImageSize size) {
  const double max_width = 2 * kMaxTangent / std::max(size.width, size.height);
  CentredView best{start, widest_view_around(cameras, start, size, max_width)};
  // Steps on the plane at depth 1, from a third of its depth to well below a pixel; at most 20 of each size. Empirical.
  for (double step = 0.3; step > 1e-5; step /= 2) {
    bool improved = true;
    for (int i = 0; improved && i < 20; ++i) {
      improved = false;
      for (const Vector2d& direction : {Vector2d(1, 0), Vector2d(-1, 0), Vector2d(0, 1), Vector2d(0, -1),
                                        Vector2d(1, 1), Vector2d(1, -1), Vector2d(-1, 1), Vector2d(-1, -1)}) {
        const Vector2d centre = best.centre + step * direction;
        const double width = widest_view_around(cameras, centre, size, max_width);
        if (width <= best.width * (1 + 1e-9)) continue;
        best = {centre, width};
        improved = true;
      }
    }
  }
  return best;
}

Result<RectifiedStereo> make_all_valid_view(const Cameras& cameras, const Vector2d& start, ImageSize size,
                                            double focal_px, const std::string& where) {
  const CentredView best_view = largest_view(cameras, start, size);
  if (!(best_view.width > 0)) return failure(ErrorCode::configuration, kNoCommonView, where);
  double min_focal = 1 / best_view.width;
  // The search sampled the border; now all of its pixels must be seen.
  while (!border_is_seen(cameras, best_view.centre, min_focal, size, 1)) min_focal *= 1.0002;
  if (focal_px > 0 && focal_px < min_focal) {
    return failure(ErrorCode::configuration,
                   fmt::format("a view of {} × {} px with a focal length of {:.6g} px has pixels that a camera does "
                               "not see; the shortest focal length is {:.6g} px",
                               size.width, size.height, focal_px, min_focal),
                   where, "choose a longer focal length, a smaller size or another policy (imaging.view)");
  }
  const double focal = focal_px > 0 ? focal_px : min_focal;
  return RectifiedStereo{size, focal, middle_of(size) - focal * best_view.centre, 0};
}

// --- whole_view ---

Result<RectifiedStereo> make_whole_view(const Cameras& cameras, ImageSize size, double focal_px,
                                        const std::string& where) {
  Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const PlaneProjection* camera : {&cameras.left, &cameras.right}) {
    for (const Vector3d& direction : camera->outline()) {
      if (direction.z() < kMinCosine) {
        return failure(ErrorCode::configuration,
                       "a camera sees more than 85° from the optical axis of the view: no plane shows all of it", where,
                       "choose another policy, such as keep_resolution with a shorter focal length");
      }
      low = low.cwiseMin(direction.hnormalized());
      high = high.cwiseMax(direction.hnormalized());
    }
  }
  const Vector2d extent = high - low;
  if (!(extent.minCoeff() > 0)) return failure(ErrorCode::configuration, kNoCommonView, where);
  const double max_focal = std::min((size.width - 1) / extent.x(), (size.height - 1) / extent.y());
  if (focal_px > max_focal) {
    return failure(
        ErrorCode::configuration,
        fmt::format("with a focal length of {:.6g} px not all that the cameras see fits into {} × {} px; the "
                    "longest focal length is {:.6g} px",
                    focal_px, size.width, size.height, max_focal),
        where, "choose a shorter focal length, a larger size or another policy (imaging.view)");
  }
  const double focal = focal_px > 0 ? focal_px : max_focal;
  return RectifiedStereo{size, focal, middle_of(size) - focal * (low + high) / 2, 0};
}

/// Rejects sizes and numbers that are invalid for every policy. Tables and images of a pair take 12 bytes per pixel of
/// the view, 805 MB for the largest.
Status check_numbers(ImageSize size, const VirtualView& view, const std::string& where) {
  constexpr std::int64_t kLargestArea = 1 << 26;
  if (size.width < 2 || size.height < 2 || std::int64_t{size.width} * size.height > kLargestArea) {
    return failure(
        ErrorCode::configuration,
        fmt::format("a view of {} × {} px is impossible: it needs at least 2 × 2 px and at most {} px in total",
                    size.width, size.height, kLargestArea),
        where, "choose another size (imaging.view.width_px, height_px)");
  }
  if (!(view.focal_px >= 0) || !std::isfinite(view.focal_px)) {
    return failure(ErrorCode::configuration,
                   fmt::format("the focal length {} px of the view is negative or not finite", view.focal_px), where,
                   "correct imaging.view.focal_px");
  }
  if (!(view.depth_m >= 0) || !std::isfinite(view.depth_m)) {
    return failure(ErrorCode::configuration,
                   fmt::format("the depth {} m of the view is negative or not finite", view.depth_m), where,
                   "correct imaging.view.depth_m");
  }
  return {};
}

}  // namespace

double effective_depth(const VirtualView& view) {
  return view.depth_m > 0 ? view.depth_m : kFar_m;
}

std::optional<double> resolution_on_axis(const Camera& camera, double depth_m) {
  const auto projection = project_with_jacobian(camera.model, depth_m * Vector3d::UnitZ());
  if (!projection) return std::nullopt;
  return depth_m * std::sqrt(std::abs(projection->by_point.leftCols<2>().determinant()));
}

Result<RectifiedStereo> choose_view(const RotatedCamera& left, const RotatedCamera& right, const VirtualView& view,
                                    const std::string& where) {
  const double depth = effective_depth(view);
  const Cameras cameras{{left, depth}, {right, depth}};
  const ImageSize size = view.size.empty() ? left.camera.size : view.size;
  if (Status status = check_numbers(size, view, where); !status) return failure(status);
  if (view.policy == ViewPolicy::whole_view) return make_whole_view(cameras, size, view.focal_px, where);

  const auto left_resolution = resolution_on_axis(left.camera, depth);
  const auto right_resolution = resolution_on_axis(right.camera, depth);
  if (!left_resolution || !right_resolution) return failure(ErrorCode::configuration, kNoCommonView, where);
  const double natural_focal = (*left_resolution + *right_resolution) / 2;
  const auto left_outline = mean_outline(cameras.left), right_outline = mean_outline(cameras.right);
  if (!left_outline || !right_outline) return failure(ErrorCode::configuration, kNoCommonView, where);
  const Vector2d centre = (*left_outline + *right_outline) / 2;
  if (view.policy == ViewPolicy::all_valid) return make_all_valid_view(cameras, centre, size, view.focal_px, where);
  const double focal = view.focal_px > 0 ? view.focal_px : natural_focal;
  return RectifiedStereo{size, focal, middle_of(size) - focal * centre, 0};
}

}  // namespace spartan::internal
