#include "spartan/sim/internal/world/ground_cover.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "spartan/sim/internal/world/rock_field.h"
#include "spartan/sim/internal/world/soil.h"
#include "spartan/sim/internal/world/terrain_shape.h"
#include "spartan/sim/internal/world/wheel_tracks.h"

namespace spartan::sim::internal {
namespace {

// Places on a lattice over a square around the origin.
struct Lattice {
  std::vector<double> x, y;
  Lattice(double side_m, double step_m) {
    for (double v = -0.5 * side_m; v < 0.5 * side_m; v += step_m) {
      for (double u = -0.5 * side_m; u < 0.5 * side_m; u += step_m) {
        x.push_back(u);
        y.push_back(v);
      }
    }
  }
};

TEST(GroundCover, SlabsCoverTheirFractionOfTheGround) {
  for (const double cover : {0.1, 0.4, 0.8}) {
    const Slabs slabs({cover, 0.5, 0.03}, 5);
    double covered = 0, height = 0;
    const Lattice lattice(80, 0.1);
    for (std::size_t k = 0; k < lattice.x.size(); ++k) {
      const Slabs::Point point = slabs.at(lattice.x[k], lattice.y[k]);
      covered += point.cover > 0 ? 1 : 0;
      height = std::max(height, point.height_m);
      EXPECT_GE(point.height_m, -1e-9);
    }
    EXPECT_NEAR(covered / static_cast<double>(lattice.x.size()), cover, 0.06) << cover;
    EXPECT_LT(height, 0.03 * 1.5 + 0.5 * 0.06);
    EXPECT_GT(height, 0.03);
  }
}

TEST(GroundCover, TopsOfSlabsAreFlatAndEndInEdges) {
  const Slabs slabs({1, 0.5, 0.03}, 5);
  int flat = 0, steep = 0, between = 0;
  for (double x = 0; x < 50; x += 0.002) {
    const double slope = (slabs.at(x + 0.001, 3).height_m - slabs.at(x, 3).height_m) / 0.001;
    (std::abs(slope) < 0.06 ? flat : std::abs(slope) > 0.3 ? steep : between)++;
  }
  EXPECT_GT(flat, 2 * (steep + between));
  EXPECT_GT(steep, between / 4);
}

TEST(GroundCover, DustIsBrightAndSmoothAndCoversItsFraction) {
  GroundCoverOptions options;
  options.dust = {.cover = 0.3, .size_m = 2, .depth_m = 0.02, .albedo_ratio = 1.5, .contrast_ratio = 0.2};
  const GroundCover cover(options, 3);
  const Lattice lattice(60, 0.25);
  std::vector<double> mean(lattice.x.size(), 1.0), contrast(lattice.x.size(), 1.0), height(lattice.x.size(), 0.0);
  cover.modulate(lattice.x, lattice.y, mean, contrast);
  cover.add_heights(lattice.x, lattice.y, height);
  double dusty = 0;
  for (std::size_t k = 0; k < mean.size(); ++k) {
    const double depth = cover.dust_depth(lattice.x[k], lattice.y[k]);
    dusty += depth > 0.01 ? 1 : 0;
    EXPECT_NEAR(height[k], depth, 1e-12);
    EXPECT_NEAR(mean[k], 1 + 0.5 * depth / 0.02, 1e-9);
    EXPECT_NEAR(contrast[k], 1 - 0.8 * depth / 0.02, 1e-9);
  }
  EXPECT_NEAR(dusty / static_cast<double>(mean.size()), 0.3, 0.06);
}

TEST(GroundCover, RocksLowerThanTheDustDisappearInIt) {
  GroundCoverOptions options;
  options.dust = {.cover = 1, .depth_m = 0.02};
  RockField field({.coverage = 0.1}, 3);
  const Region region{-2, -2, 2, 2};
  std::vector<Rock> before = field.rocks_in(region);
  std::erase_if(before, [](const Rock& rock) { return rock.height_m <= 0.02; });
  field.bury_under_dust(GroundCover(options, 3));
  const std::vector<Rock> left = field.rocks_in(region);
  ASSERT_EQ(left.size(), before.size());
  ASSERT_GT(left.size(), 10U);
  for (std::size_t i = 0; i < left.size(); ++i) {
    EXPECT_NEAR(left[i].height_m, before[i].height_m - 0.02, 1e-12) << "their tops stay where they were";
    const double half_width = left[i].diameter_m / before[i].diameter_m, up = 0.02 / before[i].height_m;
    EXPECT_NEAR(half_width * half_width + up * up, 1, 1e-12) << "the section of a half ellipsoid";
  }
}

TEST(Soil, ContrastVariesBetweenPlacesByItsSpread) {
  const SoilOptions same{.contrast = 0.05, .octave_gain = 1},
      varied{.contrast = 0.05, .octave_gain = 1, .contrast_spread = 0.8, .contrast_size_m = 3};
  // Standard deviation of the logarithm of the contrast between windows of 0.3 m.
  const auto spread = [](const SoilOptions& options) {
    const Soil soil(options, 4);
    double sum = 0, squares = 0;
    int windows = 0;
    for (double y = -30; y < 30; y += 2) {
      for (double x = -30; x < 30; x += 2, ++windows) {
        Lattice window(0.3, 0.015);
        for (double& u : window.x) u += x;
        for (double& v : window.y) v += y;
        const std::vector<double> footprint(window.x.size(), 1e-4);
        std::vector<double> albedo(window.x.size());
        soil.ground_albedo({window.x, window.y, footprint}, albedo);
        double mean = 0, variance = 0;
        for (const double a : albedo) mean += a / static_cast<double>(albedo.size());
        for (const double a : albedo) variance += (a - mean) * (a - mean);
        const double log_contrast = 0.5 * std::log(variance / static_cast<double>(albedo.size())) - std::log(mean);
        sum += log_contrast;
        squares += log_contrast * log_contrast;
      }
    }
    return std::sqrt(squares / windows - (sum / windows) * (sum / windows));
  };
  EXPECT_LT(spread(same), 0.15);
  EXPECT_NEAR(spread(varied), 0.8, 0.2);
}

TEST(WheelTracks, LieBelowTheWheelsAsFarAsTheRoverHasDriven) {
  const PathOptions path{.kind = PathKind::straight, .length_m = 3};
  const auto drive = Drive::plan(path, {}, Rig());
  ASSERT_TRUE(drive);
  const ChassisOptions chassis{.track_depth_m = 0.01};
  const double half_way_s = path.initial_stop_s + 0.5 + 1.0 + 1.5 / path.speed_m_s;
  const double x = drive->at(half_way_s).x;
  const auto poses =
      driven_poses([&](double time_s) { return drive->at(time_s); }, drive->seconds(), chassis, WheelTracks::kStep_m);
  const auto tracks = std::make_shared<const WheelTracks>(poses, half_way_s, chassis, Region{-2, -2, 5, 2});
  const auto depth = [&](double at_x, double at_y) { return tracks->depth(at_x, at_y); };
  for (const double y : {0.3, -0.3}) {
    double deepest = 0, shallowest = 1;
    for (double at = 0; at < x; at += 0.001) {
      deepest = std::max(deepest, depth(at, y));
      shallowest = std::min(shallowest, depth(at, y));
    }
    EXPECT_NEAR(deepest, 0.0135, 5e-4) << "prints of cleats";
    EXPECT_NEAR(shallowest, 0.0065, 5e-4);
    EXPECT_EQ(depth(1, y + 0.05), 0);
    EXPECT_GT(depth(x + 0.34, y), 0) << "the front wheels";
    EXPECT_EQ(depth(x + 0.37, y), 0) << "ahead of the front wheels";
  }
  TerrainShape shape({}, 7);
  const double before = shape.height(0.5, 0.3);
  shape.add_tracks(tracks);
  EXPECT_NEAR(shape.height(0.5, 0.3), before - depth(0.5, 0.3), 1e-12);
}

TEST(WheelTracks, HaveNoGapsAtAnySpeed) {
  const auto drive = Drive::plan({.kind = PathKind::straight, .length_m = 3, .speed_m_s = 1}, {}, Rig());
  ASSERT_TRUE(drive);
  const ChassisOptions chassis{.track_depth_m = 0.01};
  const auto poses =
      driven_poses([&](double time_s) { return drive->at(time_s); }, drive->seconds(), chassis, WheelTracks::kStep_m);
  const WheelTracks tracks(poses, drive->seconds(), chassis, {-2, -2, 5, 2});
  for (double x = 0; x < 3; x += 0.001) EXPECT_GT(tracks.depth(x, 0.3), 0.006) << x;
}

}  // namespace
}  // namespace spartan::sim::internal
