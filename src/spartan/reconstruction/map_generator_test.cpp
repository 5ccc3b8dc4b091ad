#include "spartan/reconstruction/map_generator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"
#include "spartan/testing/text_checks.h"

namespace spartan {
namespace {

// Points of a surface z(x, y) ahead of the rover, 1 cm apart, seen from 1 m above its origin.
template <class Height>
std::vector<SurfacePoint> points_on(const Height& height, double noise_m = 0.002) {
  std::vector<SurfacePoint> points;
  Random random(3, 1);
  for (double x = 0.5; x < 3.5; x += 0.0103) {
    for (double y = -1.5; y < 1.5; y += 0.0107) {
      const Eigen::Vector3d p(x, y, height(x, y) + random.normal(0, noise_m));
      const Eigen::Vector3d ray = (p - Eigen::Vector3d(0, 0, 1)).normalized();
      points.push_back({p.cast<float>(), 0.005F, ray.cast<float>(), GroundClass::ground});
    }
  }
  return points;
}

template <class T>
T at(const LocalMap& map, const Image<T>& layer, double x, double y) {
  const GridCell cell = cell_at(map.place, x, y);
  return layer(cell.column, cell.row);
}

TEST(LocalMap, CellsAndTheirCentresAgree) {
  const GeoTransform place{-1.5, 2.0, 0.25};
  for (int row = 0; row < 9; ++row) {
    for (int column = 0; column < 9; ++column) {
      const Eigen::Vector2d middle = cell_centre(place, column, row);
      EXPECT_EQ(cell_at(place, middle.x(), middle.y()).column, column);
      EXPECT_EQ(cell_at(place, middle.x(), middle.y()).row, row);
    }
  }
  EXPECT_EQ(cell_at(place, -1.4, 1.9).row, 0) << "row 0 lies in the north";
}

TEST(GroundClass, BandHasTheDocumentedValues) {
  Image<GroundClass> classes(4, 1);
  classes(1, 0) = GroundClass::ground;
  classes(2, 0) = GroundClass::obstacle;
  classes(3, 0) = GroundClass::cavity;
  const Image<float> band = class_band(classes);
  for (int x = 0; x < 4; ++x) EXPECT_EQ(band(x, 0), static_cast<float>(x));
}

TEST(LocalMap, BandsHaveTheDocumentedNames) {
  const LocalMap map = MapGenerator::create({}, ThreadPool(1))->generate({}, Pose());
  std::string names;
  const MapBands bands = map.bands();
  for (const MapBand& band : bands.list) {
    names += (names.empty() ? "" : " ") + band.name;
    EXPECT_EQ(band.values.size(), map.size()) << band.name;
  }
  EXPECT_EQ(names,
            "elevation_m elevation_min_m elevation_max_m variance_m2 count slope_rad roughness_m step_m class "
            "occupancy_logodds cost");
}

TEST(MapGenerator, PlaneGroundIsFreeWithLowCost) {
  const auto slope = [](double x, double y) { return 0.08 * x - 0.05 * y; };
  const LocalMap map = MapGenerator::create({}, ThreadPool(1))->generate(points_on(slope), Pose());
  int known = 0;
  for (int row = 0; row < map.size().height; ++row) {
    for (int column = 0; column < map.size().width; ++column) {
      if (!(map.count(column, row) > 0)) {
        EXPECT_EQ(map.kind(column, row), GroundClass::unknown) << "an unobserved cell is never free";
        EXPECT_TRUE(std::isnan(map.elevation_m(column, row)));
        EXPECT_EQ(map.occupancy_logodds(column, row), 0);
        continue;
      }
      ++known;
      const Eigen::Vector2d middle = cell_centre(map.place, column, row);
      // At the border of the points, those of a cell are not distributed around its centre.
      if (middle.x() < 0.6 || middle.x() > 3.4 || std::abs(middle.y()) > 1.4) continue;
      EXPECT_NEAR(map.elevation_m(column, row), slope(middle.x(), middle.y()), 0.003);
      EXPECT_EQ(map.kind(column, row), GroundClass::ground);
      EXPECT_LT(map.occupancy_logodds(column, row), -3);
      EXPECT_NEAR(map.slope_rad(column, row), std::atan(std::hypot(0.08, 0.05)), 0.01);
      EXPECT_LT(map.roughness_m(column, row), 0.003);
      EXPECT_NEAR(map.step_m(column, row), 2 * 0.05 * 0.13, 0.004);
      EXPECT_LT(map.cost(column, row), 0.4);
    }
  }
  EXPECT_NEAR(known, 60 * 60, 130);
  EXPECT_TRUE(map.obstacles.empty());
}

TEST(MapGenerator, ClassifiesRocksPitsAndOccludedGround) {
  const auto surface = [](double x, double y) {
    if (std::hypot(x - 2, y - 0.5) < 0.2) return 0.22 + 0.05 * x;
    if (std::hypot(x - 1.5, y + 0.7) < 0.25) return -0.2 + 0.05 * x;
    return 0.05 * x;
  };
  std::vector<SurfacePoint> points = points_on(surface);
  std::erase_if(points, [](const SurfacePoint& p) {  // occluded by the rock
    return p.in_body.x() > 2.2F && p.in_body.x() < 2.5F && std::abs(p.in_body.y() - 0.5F) < 0.15F;
  });
  const LocalMap map = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  EXPECT_EQ(at(map, map.kind, 2, 0.5), GroundClass::obstacle);
  EXPECT_EQ(at(map, map.kind, 1.5, -0.7), GroundClass::cavity);
  EXPECT_EQ(at(map, map.kind, 2.35, 0.5), GroundClass::unknown);
  EXPECT_EQ(at(map, map.kind, 1.0, 0.5), GroundClass::ground);
  EXPECT_GT(at(map, map.occupancy_logodds, 2, 0.5), 3);
  EXPECT_EQ(at(map, map.cost, 2, 0.5), 1);
  EXPECT_EQ(at(map, map.cost, 1.5, -0.7), 1);
  EXPECT_NEAR(at(map, map.ground_m, 2, 0.5), 0.1, 0.02) << "the ground surface continues beneath the rock";
  EXPECT_NEAR(at(map, map.elevation_m, 2, 0.5), 0.32, 0.01);
  ASSERT_EQ(map.obstacles.size(), 1U);
  EXPECT_LT((map.obstacles[0].middle_m - Eigen::Vector2d(2, 0.5)).norm(), 0.05);
  EXPECT_NEAR(map.obstacles[0].width_m, 0.4, 0.08);
  EXPECT_NEAR(map.obstacles[0].height_m, 0.22, 0.03);
}

// A rock of which the view contains the front only.
TEST(MapGenerator, ATruncatedObjectNeedsLessHeightToBeAnObstacle) {
  const auto surface = [](double x, double y) {
    return x > 3.4 && std::abs(y) < 0.2 ? std::min(0.5 * (x - 3.4), 0.05) : 0.0;
  };
  std::vector<SurfacePoint> points = points_on(surface);
  const LocalMap whole = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  EXPECT_EQ(at(whole, whole.kind, 3.47, 0), GroundClass::ground);
  for (SurfacePoint& p : points) p.truncated = p.in_body.x() > 3.4F;
  const LocalMap map = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  EXPECT_EQ(at(map, map.kind, 3.47, 0), GroundClass::obstacle);
  EXPECT_EQ(at(map, map.kind, 3.2, 0), GroundClass::ground);
  EXPECT_EQ(at(map, map.kind, 3.42, 0), GroundClass::ground)
      << "ground at the upper edge of the view is not an obstacle";
}

// Distant cells hold one row of points, and behind a crest only a part of a cell is seen.
TEST(MapGenerator, ElevationsAreOfTheCentresOfTheCells) {
  const auto slope = [](double x, double y) { return 0.3 * x - 0.2 * y; };
  std::vector<SurfacePoint> points = points_on(slope, 0);
  const auto place_in_cell = [](float x) { return static_cast<double>(x) / 0.05 - std::floor(x / 0.05); };
  std::erase_if(points, [&](const SurfacePoint& p) { return place_in_cell(p.in_body.x()) > 0.45; });
  const LocalMap map = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  int seen = 0;
  for (double x = 0.625; x < 3.4; x += 0.05) {
    for (double y = -1.375; y < 1.4; y += 0.05) {
      EXPECT_NEAR(at(map, map.elevation_m, x, y), slope(x, y), 0.0005) << x << ", " << y;
      ++seen;
    }
  }
  EXPECT_GT(seen, 1000);
}

// Points of one cell at a place.
std::vector<SurfacePoint> points_at(double x, double y, double z, int count) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3f place(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    points.push_back({place, 0.005F, Eigen::Vector3f(0.9F, 0, -0.44F), GroundClass::ground, false});
  }
  return points;
}

TEST(MapGenerator, LeavesOutCellsThatStandApart) {
  const auto flat = [](double, double) { return 0.0; };
  std::vector<SurfacePoint> points = points_on(flat);
  const auto with = [&](const std::vector<SurfacePoint>& more) {
    std::vector<SurfacePoint> all = points;
    all.insert(all.end(), more.begin(), more.end());
    return MapGenerator::create({}, ThreadPool(1))->generate(all, Pose());
  };
  // A cell of its own, far outside of what is seen, and metres above the ground.
  const LocalMap map = with(points_at(3.93, 3.93, 1.5, 9));
  EXPECT_FALSE(std::isfinite(at(map, map.elevation_m, 3.93, 3.93)));
  MapOptions all;
  all.min_support_cells = 1;
  std::vector<SurfacePoint> alone = points;
  for (const SurfacePoint& p : points_at(3.93, 3.93, 1.5, 9)) alone.push_back(p);
  const LocalMap kept = MapGenerator::create(all, ThreadPool(1))->generate(alone, Pose());
  EXPECT_TRUE(std::isfinite(at(kept, kept.elevation_m, 3.93, 3.93)));
}

TEST(MapGenerator, FewWrongPointsDoNotMoveACell) {
  std::vector<SurfacePoint> points = points_on([](double, double) { return 0.0; });
  for (const SurfacePoint& p : points_at(2, 0.5, 0.02, 38)) points.push_back(p);
  const LocalMap before = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  points.push_back(points_at(2, 0.5, 1.2, 1)[0]);
  const LocalMap after = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  EXPECT_NEAR(at(after, after.elevation_max_m, 2, 0.5), at(before, before.elevation_max_m, 2, 0.5), 0.021);
  EXPECT_NEAR(at(after, after.elevation_m, 2, 0.5), at(before, before.elevation_m, 2, 0.5), 0.002);
  EXPECT_EQ(at(after, after.kind, 2, 0.5), GroundClass::ground);
}

// Rotating the points and correcting the attitude accordingly does not change the map.
TEST(MapGenerator, IsInvariantToTheBodyFrame) {
  const auto surface = [](double x, double y) {
    return 0.05 * std::sin(3 * x) + (std::hypot(x - 2, y) < 0.2 ? 0.2 : 0.0);
  };
  const std::vector<SurfacePoint> points = points_on(surface);
  const Pose rotation(Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d(0.3, -0.9, 0.1).normalized())),
                      {0.1, 0.2, 0.3});
  std::vector<SurfacePoint> rotated = points;
  for (SurfacePoint& p : rotated) {
    p.in_body = (rotation * p.in_body.cast<double>()).cast<float>();
    p.ray = (rotation.rotation() * p.ray.cast<double>()).cast<float>();
  }
  const Pose map_from_body = Pose::from_translation({0.5, 0, 0});
  const LocalMap a = MapGenerator::create({}, ThreadPool(1))->generate(points, map_from_body);
  // The map frame is the same. The map is centred on the body's origin, so its window may differ, but not its cells.
  const LocalMap b = MapGenerator::create({}, ThreadPool(1))->generate(rotated, map_from_body * rotation.inverse());
  int same = 0, different = 0;
  for (double x = 1.2; x < 3.8; x += 0.05) {
    for (double y = -1.3; y < 1.3; y += 0.05) {
      const float one = at(a, a.elevation_m, x + 0.01, y + 0.01), other = at(b, b.elevation_m, x + 0.01, y + 0.01);
      if (std::isnan(one) || std::isnan(other)) continue;
      // Points on the border of a cell may change sides by rounding.
      (std::abs(one - other) < 1e-3 && at(a, a.kind, x + 0.01, y + 0.01) == at(b, b.kind, x + 0.01, y + 0.01)
           ? same
           : different) += 1;
    }
  }
  EXPECT_GT(same, 2500);
  EXPECT_LT(different, same / 100);
}

TEST(MapGenerator, MorePointsNeverRaiseTheVariance) {
  const auto flat = [](double, double) { return 0.0; };
  std::vector<SurfacePoint> points = points_on(flat);
  const LocalMap some = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  std::vector<SurfacePoint> twice = points;
  twice.insert(twice.end(), points.begin(), points.end());
  const LocalMap more = MapGenerator::create({}, ThreadPool(1))->generate(twice, Pose());
  for (int row = 0; row < some.size().height; ++row) {
    for (int column = 0; column < some.size().width; ++column) {
      if (!(some.count(column, row) > 0)) continue;
      EXPECT_LE(more.variance_m2(column, row), some.variance_m2(column, row) * 1.0001F);
    }
  }
}

TEST(MapGenerator, ErrorsOfTheCalibrationRaiseTheVarianceButNotTheClass) {
  std::vector<SurfacePoint> points = points_on([](double x, double y) { return std::hypot(x - 2, y) < 0.2 ? 0.2 : 0; });
  const LocalMap exact = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  EXPECT_EQ(at(exact, exact.common_variance_m2, 3, 0), 0) << "range and baseline of the points are not known";
  for (SurfacePoint& p : points) {
    p.range_m = (p.in_body - Eigen::Vector3f(0, 0, 1)).norm();
    p.baseline_m = 0.5;
  }
  MapOptions options;
  options.calibration = {0, 0, 0.5, 2, 0};
  const LocalMap map = MapGenerator::create(options, ThreadPool(1))->generate(points, Pose());
  for (const double x : {1.02, 3.02}) {
    const double expected = std::pow(x * 0.5 * kRadiansPerDegree, 2) + 4e-6;
    EXPECT_NEAR(at(map, map.common_variance_m2, x, 0.02), expected, 0.05 * expected);
    EXPECT_FLOAT_EQ(at(map, map.variance_m2, x, 0.02),
                    at(exact, exact.variance_m2, x, 0.02) + at(map, map.common_variance_m2, x, 0.02));
  }
  for (int row = 0; row < map.size().height; ++row) {
    for (int column = 0; column < map.size().width; ++column) {
      ASSERT_EQ(map.kind(column, row), exact.kind(column, row));
      ASSERT_EQ(map.occupancy_logodds(column, row), exact.occupancy_logodds(column, row));
    }
  }
}

TEST(MapGenerator, CostOfASlopeIsItsShareOfTheLimit) {
  const double rise = std::tan(10 * kRadiansPerDegree);
  const LocalMap map =
      MapGenerator::create({}, ThreadPool(1))->generate(points_on([&](double x, double) { return rise * x; }), Pose());
  EXPECT_NEAR(at(map, map.slope_rad, 2, 0), 10 * kRadiansPerDegree, 0.2 * kRadiansPerDegree);
  EXPECT_NEAR(at(map, map.cost, 2, 0), 0.5, 0.05) << "10 of at most 20 degrees";
}

// Four cells far from all others: too few for the surface of the ground.
TEST(MapGenerator, AnIslandWithoutGroundIsUnknown) {
  const Eigen::Vector3f ray = Eigen::Vector3f(3.4F, 3.4F, -1).normalized();
  std::vector<SurfacePoint> points;
  for (const float x : {3.41F, 3.46F}) {
    for (const float y : {3.41F, 3.46F}) points.insert(points.end(), 3, {{x, y, 0}, 0.005F, ray, GroundClass::ground});
  }
  const LocalMap map = MapGenerator::create({}, ThreadPool(1))->generate(points, Pose());
  EXPECT_EQ(at(map, map.count, 3.41, 3.41), 3);
  EXPECT_NEAR(at(map, map.elevation_m, 3.41, 3.41), 0, 1e-6) << "its elevation is measured all the same";
  EXPECT_EQ(at(map, map.kind, 3.41, 3.41), GroundClass::unknown);
  EXPECT_EQ(at(map, map.occupancy_logodds, 3.41, 3.41), 0);
}

TEST(MapGenerator, RefusesOptionsOutOfBounds) {
  MapOptions options;
  options.cell_m = 0;
  EXPECT_THAT(testing::error_message(MapGenerator::create(options, ThreadPool(1))),
              ::testing::HasSubstr("map options: cell_m is 0"));
}

}  // namespace
}  // namespace spartan
