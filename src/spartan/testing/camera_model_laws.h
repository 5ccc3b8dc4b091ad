// Properties that every camera model must have, as reusable checks. A new model runs them in its own test.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan::testing {

/// A grid of pixel coordinates over the whole image, including its borders and corners.
inline std::vector<Eigen::Vector2d> image_grid(ImageSize size, int steps = 16) {
  std::vector<Eigen::Vector2d> grid;
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= steps; ++i)
      grid.emplace_back(i * double(size.width) / steps - 0.5, j * double(size.height) / steps - 0.5);
  }
  return grid;
}

/// Round trip pixel → ray → pixel at several depths, to `tolerance_px`; the model must have a ray for every pixel of
/// the image. Points nearer than `sees_from_m` may have no projection, but never a different one.
inline void expect_round_trips(const CameraModel& model, ImageSize size, double tolerance_px = 1e-9,
                               double sees_from_m = 0) {
  for (const Eigen::Vector2d& pixel : image_grid(size)) {
    const auto ray = unproject(model, pixel);
    ASSERT_TRUE(ray) << pixel.transpose();
    EXPECT_NEAR(ray->direction.norm(), 1, 1e-12);
    for (const double depth : {0.001, 0.003, 0.01, 0.02, 1.0, 300.0}) {
      const auto back = project(model, ray->origin + depth * ray->direction);
      if (!back && depth < sees_from_m) continue;
      ASSERT_TRUE(back) << pixel.transpose() << " at " << depth << " m";
      EXPECT_LE((*back - pixel).norm(), tolerance_px) << pixel.transpose() << " at " << depth << " m";
    }
  }
}

/// Wherever the model has a ray, in the image and far around it, the ray projects to its pixel.
/// Returns the fraction of the grid that has a ray; the image alone is a ninth of it.
[[nodiscard]] inline double expect_consistent_answers(const CameraModel& model, ImageSize size,
                                                      double tolerance_px = 1e-9) {
  int with_ray = 0, tested = 0;
  for (const Eigen::Vector2d& pixel : image_grid({3 * size.width, 3 * size.height}, 48)) {
    ++tested;
    const Eigen::Vector2d shifted = pixel - Eigen::Vector2d(size.width, size.height);
    const auto ray = unproject(model, shifted);
    if (!ray) continue;
    ++with_ray;
    const auto back = project(model, ray->origin + 2 * ray->direction);
    EXPECT_TRUE(back) << shifted.transpose();
    if (!back) continue;
    EXPECT_LE((*back - shifted).norm(), tolerance_px * std::max(1.0, shifted.norm() / size.width))
        << shifted.transpose();
  }
  return static_cast<double>(with_ray) / tested;
}

/// ∂pixel/∂point against central differences; the tolerance is relative to its norm.
inline void expect_true_jacobians(const CameraModel& model, ImageSize size, double tolerance = 1e-6) {
  for (const Eigen::Vector2d& pixel : image_grid(size, 6)) {
    const auto ray = unproject(model, pixel);
    ASSERT_TRUE(ray) << pixel.transpose();
    for (const double depth : {0.5, 20.0}) {
      const Eigen::Vector3d point = ray->origin + depth * ray->direction;
      const auto analytic = project_with_jacobian(model, point);
      ASSERT_TRUE(analytic);
      EXPECT_EQ(analytic->pixel, *project(model, point));
      const Eigen::Matrix<double, 2, 3> numeric =
          numeric_jacobian<2, 3>([&](const Eigen::Vector3d& p) { return *project(model, p); }, point, 1e-4 * depth);
      EXPECT_LE((analytic->by_point - numeric).norm(), tolerance * numeric.norm()) << pixel.transpose();
    }
  }
}

/// Points behind a camera with less than 180° field of view, and coordinates that are not finite, have no projection;
/// no projection and no ray contains NaN.
inline void expect_defined_limits(const CameraModel& model, bool sees_beside = false) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(project(model, {0, 0, 0}));
  EXPECT_EQ(project(model, {0.1, 0, 0}).has_value(), sees_beside);
  if (!sees_beside) {
    EXPECT_FALSE(project(model, {0, 0, -1}));
  }
  EXPECT_FALSE(project(model, {kNan, 0, 1}));
  EXPECT_FALSE(project(model, {0, 0, kNan}));
  EXPECT_FALSE(unproject(model, {kNan, 0}));
  EXPECT_FALSE(unproject(model, {0, kInfinity}));
  for (const double x : {-1e9, -1e3, -3.0, -1.0, -0.3, 0.0, 0.5, 2.0, 1e4}) {
    for (const double y : {-1e5, -1.5, 0.0, 0.7, 1e8}) {
      for (const double z : {1.0, 0.0, -0.2, -1e3}) {
        if (const auto pixel = project(model, {x, y, z})) {
          EXPECT_TRUE(pixel->allFinite()) << x << ", " << y << ", " << z;
        }
        if (const auto both = project_with_jacobian(model, {x, y, z})) {
          EXPECT_TRUE(both->pixel.allFinite() && both->by_point.allFinite()) << x << ", " << y << ", " << z;
        }
      }
      if (const auto ray = unproject(model, {500 * x, 500 * y})) {
        EXPECT_TRUE(ray->direction.allFinite() && ray->origin.allFinite()) << x << ", " << y;
        EXPECT_NEAR(ray->direction.norm(), 1, 1e-9);
      }
    }
  }
}

}  // namespace spartan::testing
