// Laws that every camera model must obey, as reusable checks. A further model runs them in its own test.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/rig/camera_model.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan::testing {

/// Places over the whole picture, its borders and corners included.
inline std::vector<Eigen::Vector2d> picture_grid(ImageSize size, int steps = 16) {
  std::vector<Eigen::Vector2d> grid;
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= steps; ++i)
      grid.emplace_back(i * double(size.width) / steps - 0.5, j * double(size.height) / steps - 0.5);
  }
  return grid;
}

/// pixel → ray → pixel at several depths, to `tolerance_px`; the model must see every place of the picture.
inline void expect_round_trips(const CameraModel& model, ImageSize size, double tolerance_px = 1e-9) {
  for (const Eigen::Vector2d& pixel : picture_grid(size)) {
    const auto ray = unproject(model, pixel);
    ASSERT_TRUE(ray) << pixel.transpose();
    EXPECT_NEAR(ray->direction.norm(), 1, 1e-12);
    for (const double depth : {0.01, 1.0, 300.0}) {
      const auto back = project(model, ray->origin + depth * ray->direction);
      ASSERT_TRUE(back) << pixel.transpose() << " at " << depth << " m";
      EXPECT_LE((*back - pixel).norm(), tolerance_px) << pixel.transpose() << " at " << depth << " m";
    }
  }
}

/// ∂pixel/∂point against central differences, relative to its size.
inline void expect_true_jacobians(const CameraModel& model, ImageSize size, double tolerance = 1e-6) {
  for (const Eigen::Vector2d& pixel : picture_grid(size, 6)) {
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

/// Points behind the camera and numbers that are none get no answer, and no answer holds a NaN.
inline void expect_honest_limits(const CameraModel& model) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(project(model, {0, 0, -1}));
  EXPECT_FALSE(project(model, {0.1, 0, 0}));
  EXPECT_FALSE(project(model, {kNan, 0, 1}));
  EXPECT_FALSE(project(model, {0, 0, kNan}));
  EXPECT_FALSE(unproject(model, {kNan, 0}));
  EXPECT_FALSE(unproject(model, {0, kInfinity}));
  for (const double x : {-1e9, -1e3, -3.0, -1.0, -0.3, 0.0, 0.5, 2.0, 1e4}) {
    for (const double y : {-1e5, -1.5, 0.0, 0.7, 1e8}) {
      if (const auto pixel = project(model, {x, y, 1})) {
        EXPECT_TRUE(pixel->allFinite()) << x << ", " << y;
      }
      if (const auto both = project_with_jacobian(model, {x, y, 1})) {
        EXPECT_TRUE(both->pixel.allFinite() && both->by_point.allFinite()) << x << ", " << y;
      }
      if (const auto ray = unproject(model, {500 * x, 500 * y})) {
        EXPECT_TRUE(ray->direction.allFinite() && ray->origin.allFinite()) << x << ", " << y;
        EXPECT_NEAR(ray->direction.norm(), 1, 1e-9);
      }
    }
  }
}

}  // namespace spartan::testing
