// Compares every camera model with a reference implementation (OpenCV or mrcal): largest difference on a grid over the
// image, round trip pixel → ray → pixel, Jacobians against central differences, and time of a projection.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/ccalib/omnidir.hpp>
#include <string>
#include <vector>

#include "spartan/rig/models/camera_model.h"
#include "spartan/testing/camera_model_laws.h"
#include "timing.h"
#ifdef SPARTAN_HAS_MRCAL
#include "spartan/testing/mrcal_oracle.h"
#endif

namespace spartan {
namespace {

constexpr ImageSize kSize{1024, 768};
constexpr int kGrid = 64, kPoints = 200000, kRuns = 7;
const PinholeModel kCore{400.5, 398.25, 517.3, 379.1};

using Points = std::vector<cv::Point3d>;
using Pixels = std::vector<cv::Point2d>;

struct Oracle {
  std::string name;
  std::function<Pixels(const Points&)> project;  // empty: no reference
  double unit_distance = 0;                      // > 0: compare at this distance from the camera's origin only
  double min_z = 0;                              // of the compared directions
};

struct Case {
  std::string name;
  CameraModel model;
  Oracle oracle;
};

cv::Matx33d matrix() {
  return {kCore.fx, 0, kCore.cx, 0, kCore.fy, kCore.cy, 0, 0, 1};
}

Oracle opencv(const std::vector<double>& distortion) {
  return {"OpenCV projectPoints", [distortion](const Points& points) {
            Pixels projected;
            cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix(), distortion, projected);
            return projected;
          }};
}

Oracle opencv_fisheye(const EquidistantModel::Coefficients& k) {
  return {"OpenCV fisheye",
          [k](const Points& points) {
            Pixels projected;
            cv::fisheye::projectPoints(points, projected, cv::Vec3d(), cv::Vec3d(), matrix(),
                                       cv::Vec4d(k[0], k[1], k[2], k[3]));
            return projected;
          },
          0, 0.01};
}

Oracle opencv_omnidir(double xi) {
  return {"OpenCV omnidir", [xi](const Points& points) {
            Pixels projected;
            cv::omnidir::projectPoints(points, projected, cv::Vec3d(), cv::Vec3d(), matrix(), xi, cv::Vec4d());
            return projected;
          }};
}

#ifdef SPARTAN_HAS_MRCAL
Oracle mrcal(const std::string& name, std::vector<double> intrinsics, double unit_distance = 0) {
  const testing::MrcalModel model(name, std::move(intrinsics));
  return {"mrcal",
          [model](const Points& points) {
            Pixels projected;
            projected.reserve(points.size());
            for (const cv::Point3d& p : points) {
              const Eigen::Vector2d q = model.project({p.x, p.y, p.z});
              projected.emplace_back(q.x(), q.y());
            }
            return projected;
          },
          unit_distance};
}
#else
Oracle mrcal(const std::string&, const std::vector<double>&, double = 0) {
  return {"mrcal is not installed", {}};
}
#endif

std::vector<Case> cases() {
  const RadialTangentialModel::Coefficients five{-0.28, 0.074, 2e-4, -1e-4, 0.001};
  const RadialTangentialModel::Coefficients eight{0.3, 0.1, 0.0005, -0.0003, 0.01, 0.5, 0.15, 0.02};
  const EquidistantModel::Coefficients fisheye{-0.012, 0.031, -0.024, 0.006};
  const Eigen::Vector3d o = Eigen::Vector3d(0.013, -0.021, 1).normalized();
  const double alpha = std::atan2(o.x(), o.z()), beta = std::asin(o.y());
  const std::vector<double> core{kCore.fx, kCore.fy, kCore.cx, kCore.cy};
  const auto with = [&](std::vector<double> more) {
    more.insert(more.begin(), core.begin(), core.end());
    return more;
  };
  return {
      {"pinhole", kCore, opencv({})},
      {"radial_tangential, 5", RadialTangentialModel(kCore, five), opencv({five.begin(), five.begin() + 5})},
      {"radial_tangential, 8", RadialTangentialModel(kCore, eight), opencv({eight.begin(), eight.end()})},
      {"equidistant", EquidistantModel(kCore, fisheye), opencv_fisheye(fisheye)},
      {"double_sphere, alpha 0", DoubleSphereModel{kCore, 0.6, 0}, opencv_omnidir(0.6)},
      {"double_sphere", DoubleSphereModel{kCore, -0.2, 0.57}, {"closed forms (tests)", {}}},
      {"cahv", CahvModel{kCore, 0}, opencv({})},
      {"cahvor", CahvorModel({kCore, 0}, o, {0.002, -0.11, 0.03}),
       mrcal("LENSMODEL_CAHVOR", with({alpha, beta, 0.002, -0.11, 0.03}))},
      {"cahvore, linearity 0.37", CahvoreModel({kCore, 0}, o, {0.001, -0.02, 0.004}, {0.006, 0.002, -0.0005}, 0.37),
       mrcal("LENSMODEL_CAHVORE_linearity=0.37", with({alpha, beta, 0.001, -0.02, 0.004, 0.006, 0.002, -0.0005}), 1)},
  };
}

// The point on the ray at that distance from the camera's origin.
Eigen::Vector3d at_distance(const Ray& ray, double distance) {
  const double along = ray.origin.dot(ray.direction);
  const double t = std::sqrt(along * along - ray.origin.squaredNorm() + distance * distance) - along;
  return ray.origin + t * ray.direction;
}

struct Accuracy {
  int with_ray = 0, tested = 0, compared = 0;
  double oracle_px = 0, round_trip_px = 0, jacobian = 0;  // largest errors; that of the Jacobian is relative
};

Accuracy measure_accuracy(const Case& c) {
  Accuracy a;
  for (const Eigen::Vector2d& pixel : testing::image_grid(kSize, kGrid)) {
    ++a.tested;
    const auto ray = unproject(c.model, pixel);
    if (!ray) continue;
    ++a.with_ray;
    const Eigen::Vector3d point = at_distance(*ray, c.oracle.unit_distance > 0 ? c.oracle.unit_distance : 3);
    const auto ours = project_with_jacobian(c.model, point);
    if (!ours) continue;
    a.round_trip_px = std::max(a.round_trip_px, (ours->pixel - pixel).norm());
    const auto numeric = testing::numeric_jacobian<2, 3>(
        [&](const Eigen::Vector3d& p) { return project(c.model, p).value_or(Eigen::Vector2d(NAN, NAN)); }, point, 3e-4);
    if (numeric.allFinite()) a.jacobian = std::max(a.jacobian, (ours->by_point - numeric).norm() / numeric.norm());
    if (!c.oracle.project || ray->direction.z() < c.oracle.min_z) continue;
    const cv::Point2d other = c.oracle.project({{point.x(), point.y(), point.z()}}).front();
    a.oracle_px = std::max(a.oracle_px, std::hypot(other.x - ours->pixel.x(), other.y - ours->pixel.y()));
    ++a.compared;
  }
  return a;
}

void report(const Case& c) {
  const Accuracy a = measure_accuracy(c);
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;
  Points same;
  const auto grid = testing::image_grid(kSize, 96);
  for (int i = 0; std::ssize(points) < kPoints; ++i) {
    const Eigen::Vector2d& pixel = grid[static_cast<std::size_t>(i) % grid.size()];
    const auto ray = unproject(c.model, pixel);
    if (!ray || ray->direction.z() < 0.01) continue;
    pixels.push_back(pixel);
    points.push_back(at_distance(*ray, 1 + i % 7));
    same.emplace_back(points.back().x(), points.back().y(), points.back().z());
  }
  double sum = 0;
  const double project_ms = median_milliseconds(kRuns, [&] {
    for (const Eigen::Vector3d& p : points) sum += project(c.model, p)->x();
  });
  const double jacobian_ms = median_milliseconds(kRuns, [&] {
    for (const Eigen::Vector3d& p : points) sum += project_with_jacobian(c.model, p)->by_point(0, 0);
  });
  const double unproject_ms = median_milliseconds(kRuns, [&] {
    for (const Eigen::Vector2d& p : pixels) sum += unproject(c.model, p)->direction.x();
  });
  const double oracle_ms =
      c.oracle.project ? median_milliseconds(kRuns, [&] { sum += c.oracle.project(same).front().x; }) : NAN;
  constexpr double kPerMillion = 1e6 / kPoints;
  fmt::print("| {} | {} | {:.0f} % | {} | {:.1e} | {:.1e} | {:.0f} | {:.0f} | {:.0f} | {} |\n", c.name, c.oracle.name,
             100.0 * a.with_ray / a.tested, c.oracle.project ? fmt::format("{:.1e}", a.oracle_px) : "-",
             a.round_trip_px, a.jacobian, project_ms * kPerMillion, jacobian_ms * kPerMillion,
             unproject_ms * kPerMillion, c.oracle.project ? fmt::format("{:.0f}", oracle_ms * kPerMillion) : "-");
  if (!std::isfinite(sum)) fmt::print("not finite\n");
}

}  // namespace
}  // namespace spartan

int main() try {
  cv::setNumThreads(1);
  fmt::print(
      "Grid of {0} x {0} points over {1} x {2} px; times in ms per million calls, medians of {3} runs on one thread.\n"
      "| model | reference | grid with a ray | largest difference, px | round trip, px | Jacobian, relative | project "
      "| with "
      "Jacobian | "
      "unproject | "
      "reference: project |\n|---|---|---|---|---|---|---|---|---|---|\n",
      spartan::kGrid + 1, spartan::kSize.width, spartan::kSize.height, spartan::kRuns);
  for (const spartan::Case& c : spartan::cases()) spartan::report(c);
} catch (const std::exception& e) {
  std::fputs(e.what(), stderr);
  return 1;
}
