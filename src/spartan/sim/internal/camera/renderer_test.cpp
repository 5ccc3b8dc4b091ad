#include "spartan/sim/internal/camera/renderer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "spartan/core/trajectory.h"
#include "spartan/numerics/random.h"
#include "spartan/sim/internal/camera/brute_force_test.h"
#include "spartan/sim/internal/camera/sensor.h"
#include "spartan/sim/internal/camera/truth.h"
#include "spartan/sim/internal/world/rock_shape.h"

namespace spartan::sim::internal {
namespace {

// A camera above (0, 0), looking along x and down.
Pose looking_down(double height_m, double down_deg, double roll_deg = 0) {
  const double degree = std::numbers::pi / 180;
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(down_deg * degree, Eigen::Vector3d::UnitY()));
  const Eigen::Quaterniond roll(Eigen::AngleAxisd(roll_deg * degree, Eigen::Vector3d::UnitZ()));
  return {tilt * optical_from_forward().rotation().conjugate() * roll, Eigen::Vector3d(0, 0, height_m)};
}

Camera pinhole(int width, int height, double focal_px) {
  Camera camera;
  camera.name = "camera";
  camera.size = {width, height};
  camera.model = PinholeModel{focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0};
  return camera;
}

TerrainShapeOptions flat() {
  TerrainShapeOptions options;
  options.relief_m = options.ripple_height_m = options.dune_height_m = 0;
  return options;
}

// OpenCV projects the point where a pixel's ray hits the ground back to that pixel.
TEST(Renderer, HitPointsProjectToTheirPixelsWithOpenCv) {
  const ThreadPool workers(2);
  const TerrainShape shape({}, 3);
  const RockField rocks({.coverage = 0.1}, 3);
  const GroundScene scene(shape, rocks, {-1, -2, 4, 2}, workers);
  Camera camera = pinhole(320, 240, 240);
  const PinholeModel plain{240, 243, 161.3, 118.2};
  camera.model = RadialTangentialModel(plain, {-0.12, 0.03, 0.001, -0.0005});
  const Pose world_from_camera = looking_down(0.8, 35, 4);
  const Image<float> depth = render_depth(camera, scene, world_from_camera, workers);
  const Pose camera_from_world = world_from_camera.inverse();
  const Eigen::AngleAxisd rotation(camera_from_world.rotation());
  const Eigen::Vector3d rvec = rotation.angle() * rotation.axis();
  const cv::Mat k = (cv::Mat_<double>(3, 3) << 240, 0, 161.3, 0, 243, 118.2, 0, 0, 1);
  const std::vector<double> distortion{-0.12, 0.03, 0.001, -0.0005};
  double worst = 0;
  int count = 0;
  for (int y = 4; y < 240; y += 9) {
    for (int x = 4; x < 320; x += 9) {
      if (!std::isfinite(depth(x, y))) continue;
      const auto ray = unproject(camera.model, {x, y});
      ASSERT_TRUE(ray);
      const Eigen::Vector3d world =
          world_from_camera * Eigen::Vector3d(depth(x, y) / ray->direction.z() * ray->direction);
      // The point is on the ground, or on a rock above it.
      if (scene.region().contains(world.x(), world.y())) {
        EXPECT_GT(world.z(), shape.height(world.x(), world.y()) - 1.5e-3);
      }
      std::vector<cv::Point2d> seen;
      cv::projectPoints(std::vector<cv::Point3d>{{world.x(), world.y(), world.z()}},
                        cv::Vec3d(rvec.x(), rvec.y(), rvec.z()),
                        cv::Vec3d(camera_from_world.translation().x(), camera_from_world.translation().y(),
                                  camera_from_world.translation().z()),
                        k, distortion, seen);
      worst = std::max(worst, std::hypot(seen[0].x - x, seen[0].y - y));
      ++count;
    }
  }
  EXPECT_GT(count, 800);
  fmt::print("projections: largest difference from OpenCV {:.5f} px over {} points\n", worst, count);
  EXPECT_LT(worst, 0.01);
}

// The horizon in the image of a rolled camera is a slanted edge: its profile is the integral of the point spread
// function, at the position that the camera model predicts.
struct Edge {
  double sigma_px = 0, shift_px = 0;
};

Edge edge_of_horizon(double roll_deg) {
  const ThreadPool workers(2);
  const TerrainShape shape(flat(), 1);
  const RockField none({.coverage = 0, .pebbles_per_m2 = 0}, 1);
  const GroundScene scene(shape, none, {-1, -1, 1, 1}, workers);
  const SkyLight sky(scene, shape, workers);
  const Sun sun({.sun_lux = 0});
  const Soil soil({.albedo = 0.02, .contrast = 0}, 1);
  const LitScene lit{scene, sky, sun, soil, 5000};
  const Camera camera = pinhole(200, 200, 300);
  const Renderer renderer(camera, Sampling::of(4));
  const Pose pose = looking_down(1, 0, roll_deg);
  const LuminanceImage image = renderer.render(lit, pose, false, workers);
  // Distance of a pixel from the horizon: directions below z = 0 by the dip of the edge of the ground at 120 m.
  const double dip = std::atan2(1.0, GroundScene::kHorizon_m + 1);
  std::vector<std::pair<double, double>> profile;
  for (int y = 60; y < 140; ++y) {
    for (int x = 60; x < 140; ++x) {
      const Eigen::Vector3d d = pose.rotation() * Eigen::Vector3d((x - 99.5) / 300, (y - 99.5) / 300, 1);
      const double off = 300 * (std::atan2(d.z(), std::hypot(d.x(), d.y())) + dip);
      if (std::abs(off) < 4) profile.emplace_back(off, image.total(x, y));
    }
  }
  // Least squares for position, width and both levels: grid search over position and width.
  const auto cost = [&](double sigma, double shift) {
    double s1 = 0, sp = 0, spp = 0, sv = 0, svp = 0, svv = 0;
    for (const auto& [off, value] : profile) {
      const double p = 0.5 * (1 + std::erf((off - shift) / (sigma * std::numbers::sqrt2)));
      s1 += 1;
      sp += p;
      spp += p * p;
      sv += value;
      svp += value * p;
      svv += value * value;
    }
    const double b = (s1 * svp - sp * sv) / (s1 * spp - sp * sp), a = (sv - b * sp) / s1;
    return svv - a * sv - b * svp;
  };
  double best = 1e300;
  Edge edge;
  for (double sigma = 0.3; sigma < 0.8; sigma += 0.005) {
    for (double shift = -0.5; shift < 0.5; shift += 0.02) {
      if (const double m = cost(sigma, shift); m < best) {
        best = m;
        edge = {sigma, shift};
      }
    }
  }
  return edge;
}

TEST(Renderer, SlantedEdgeHasThePointSpreadAndPosition) {
  for (const double roll_deg : {5.0, 85.0, -175.0, -95.0}) {
    const Edge edge = edge_of_horizon(roll_deg);
    fmt::print("point spread on an edge at {} degrees: {:.3f} px, position error {:+.2f} px\n", roll_deg, edge.sigma_px,
               edge.shift_px);
    EXPECT_NEAR(edge.sigma_px, Renderer::kPointSpread_px, 0.05 * Renderer::kPointSpread_px);
    EXPECT_NEAR(edge.shift_px, 0, 0.05);
  }
}

struct Stereo {
  Rig rig;
  RectifiedView view;
};
Stereo parallel_pair(int width, int height, double focal_px, double baseline_m) {
  Stereo s;
  Camera left = pinhole(width, height, focal_px), right = left;
  left.name = "left";
  right.name = "right";
  left.mount_from_camera = looking_down(0.5, 40);
  right.mount_from_camera = left.mount_from_camera * Pose::from_translation({baseline_m, 0, 0});
  s.rig.cameras = {left, right};
  s.rig.pairs = {{"pair", "left", "right", 0.2}};
  s.view.geometry = {left.size, focal_px, {(width - 1) / 2.0, (height - 1) / 2.0}, baseline_m};
  return s;
}

double sampled(const FrameImage& image, double x, int y) {
  const int i = static_cast<int>(std::floor(x));
  const auto view = image.as<std::uint8_t>();
  if (i < 1 || i + 2 >= image.width()) return -1;
  // Catmull-Rom along the row.
  const double t = x - i, a = view(i - 1, y), b = view(i, y), c = view(i + 1, y), d = view(i + 2, y);
  return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

// The right image warped by the true disparity against the left one, while the rig moves from the first to the last
// row. The median of the absolute differences, and what the noise of both images makes of it, in gray levels.
struct WarpDifference {
  double median = 0, noise_floor = 0;
  int both = 0, left_only = 0;
};
WarpDifference warp_right_onto_left(const Pose& rig_top_from_bottom) {
  const ThreadPool workers(2);
  const TerrainShape shape({}, 3);
  const RockField rocks({.coverage = 0.1}, 3);
  const GroundScene scene(shape, rocks, {-0.5, -1.5, 3, 1.5}, workers);
  const SkyLight sky(scene, shape, workers);
  const LightOptions light;
  const Sun sun(light);
  const Soil soil({}, 3);
  const LitScene lit{scene, sky, sun, soil, light.sky_lux};
  const Stereo s = parallel_pair(320, 240, 300, 0.1);
  const SensorOptions sensor{.vignetting = 0};
  const bool rolls = rig_top_from_bottom.translation().norm() > 0;
  const auto pose_of = [&](int camera) {
    const Pose& pose = s.rig.cameras[static_cast<std::size_t>(camera)].mount_from_camera;
    return ShutterPose{pose, rig_top_from_bottom * pose, rolls};
  };
  const Renderer left(s.rig.cameras[0], Sampling::of(4)), right(s.rig.cameras[1], Sampling::of(4));
  const Exposure exposure = choose_exposure(sensor, left.mean_luminance(lit, at_rest(pose_of(0).top), 8));
  const auto expose = [&](const Renderer& renderer, const ShutterPose& pose, std::uint64_t seed) {
    Exposing exposing;
    exposing.world_from_camera.rolls = rolls;
    exposing.world_from_camera.top.fill(pose.top);
    exposing.world_from_camera.bottom.fill(pose.bottom);
    return Sensor(sensor, renderer.camera())
        .expose(renderer.render(lit, exposing, false, workers), exposure, {}, seed, workers);
  };
  const FrameImage left_image = expose(left, pose_of(0), 1), right_image = expose(right, pose_of(1), 2);
  PairPoses poses;
  poses.world_from_left = pose_of(0);
  poses.world_from_right = pose_of(1);
  const TrueDisparity truth = DisparityTruth(s.rig, s.rig, s.rig.pairs[0], s.view).of(scene, poses, workers);
  WarpDifference result;
  std::vector<double> differences;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      result.left_only += truth.mask(x, y) == 128 ? 1 : 0;
      if (truth.mask(x, y) != 255) continue;
      ++result.both;
      const double there = sampled(right_image, x - static_cast<double>(truth.disparity(x, y)), y);
      if (there >= 0) differences.push_back(std::abs(left_image.as<std::uint8_t>()(x, y) - there));
    }
  }
  std::nth_element(differences.begin(), differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2),
                   differences.end());
  result.median = differences[differences.size() / 2];
  // Noise of one image at the mean level: shot noise, read noise, quantization. The median of the absolute difference
  // of two images is 0.6745 √2 times it.
  const double electrons = 0.45 * 15000, levels = 255 * (1 - 1.0 / 64) / 15000;
  result.noise_floor = 0.6745 * std::sqrt(2 * (levels * levels * (electrons + 225) + 1.0 / 12));
  fmt::print("right warped onto left: median difference {:.3f} gray levels, noise floor {:.3f}\n", result.median,
             result.noise_floor);
  return result;
}

TEST(TrueDisparity, WarpsRightOntoLeft) {
  const WarpDifference at_rest = warp_right_onto_left({});
  EXPECT_GT(at_rest.both, 320 * 240 / 2);
  EXPECT_GT(at_rest.left_only, 1000);
  EXPECT_LT(at_rest.median, 1.35 * at_rest.noise_floor);
  EXPECT_GT(at_rest.median, 0.5 * at_rest.noise_floor);
}

// With a shutter that rolls while the rig drives and turns: rows of both images that are exposed at the same time
// match.
TEST(TrueDisparity, HoldsForARollingShutter) {
  const Pose motion(Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitZ())), {0.03, 0.01, 0});
  const WarpDifference rolling = warp_right_onto_left(motion);
  EXPECT_LT(rolling.median, 1.35 * rolling.noise_floor);
}

TEST(Renderer, AgreesWithABruteForceReference) {
  const ThreadPool workers(2);
  const TerrainShape shape({}, 8);
  RockFieldOptions pebbly;
  pebbly.coverage = 0.2;
  pebbly.largest_m = 0.08;
  pebbly.pebbles_per_m2 = 0;
  const RockField rocks(pebbly, 8);
  const Region region{-0.15, -0.15, 0.15, 0.15};
  const GroundScene scene(shape, rocks, region, workers);
  const SkyLight sky(scene, shape, workers);
  const LightOptions light{.sun_elevation_deg = 35, .sky_lux = 0};
  const Sun sun(light);
  const Soil soil({.lunar_weight = 0.5}, 8);
  const LitScene lit{scene, sky, sun, soil, 0};
  const Camera camera = pinhole(36, 28, 120);
  const Pose pose(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())),
                  Eigen::Vector3d(0, 0, shape.height(0, 0) + 0.6));
  const LuminanceImage fast = Renderer(camera, Sampling::of(16)).render(lit, pose, false, workers);

  const BruteForce brute(shape, rocks.rocks_in(region.grown(0.1)), scene.region());
  const double bounce = soil.mean_albedo() * sun.horizontal_lux(0);
  constexpr int kFine = 3, kReach = 2 * kFine;
  const int w = 36 * kFine + 2 * kReach, h = 28 * kFine + 2 * kReach;
  Image<float> fine(w, h);
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i) {
      const double u = (i - kReach + 0.5) / kFine - 0.5, v = (j - kReach + 0.5) / kFine - 0.5;
      const Eigen::Vector3d look =
          pose.rotation() * Eigen::Vector3d((u - 17.5) / 120, (v - 13.5) / 120, 1).normalized();
      const auto hit = brute.first(pose.translation(), look, 0);
      const Eigen::Vector3d place = pose.translation() + hit.distance * look;
      const double px = hit.rock ? place.x() + 0.6 * place.z() : place.x(),
                   py = hit.rock ? place.y() - 0.8 * place.z() : place.y();
      const double footprint = hit.distance / 120 / 4;
      double albedo = 0;
      const Soil::Places there{{&px, 1}, {&py, 1}, {&footprint, 1}};
      hit.rock ? soil.rock_albedo(there, {&albedo, 1}) : soil.ground_albedo(there, {&albedo, 1});
      double sunlight = 0;
      for (int k = 0; k < Sun::kPoints; ++k) {
        const Eigen::Vector3d towards = sun.direction(k).cast<double>();
        if (hit.normal.dot(towards) <= 0 || brute.first(place + 2e-4 * hit.normal, towards, 0).distance < 1e8) continue;
        const double i0 = hit.normal.dot(towards), e = -hit.normal.dot(look);
        sunlight += light.sun_lux * (0.5 * 2 * i0 / (i0 + e) + 0.5 * i0) / Sun::kPoints;
      }
      const double view_factor =
          sky.view_factor(place, static_cast<float>(hit.normal.z()));  // tested in sky_light_test.cpp
      fine(i, j) = static_cast<float>(albedo * (sunlight + bounce * (1 - view_factor)) / std::numbers::pi);
    }
  }
  double squares = 0, sum = 0, total = 0;
  for (int y = 0; y < 28; ++y) {
    for (int x = 0; x < 36; ++x) {
      double value = 0, weights = 0;
      for (int b = -kReach; b < kFine + kReach; ++b) {
        for (int a = -kReach; a < kFine + kReach; ++a) {
          const double dx = (a + 0.5) / kFine - 0.5, dy = (b + 0.5) / kFine - 0.5;
          const double weight = std::exp(-(dx * dx + dy * dy) / (2 * 0.25));
          value += weight * fine(x * kFine + kReach + a, y * kFine + kReach + b);
          weights += weight;
        }
      }
      const double difference = fast.total(x, y) - value / weights;
      squares += difference * difference;
      sum += difference;
      total += value / weights;
    }
  }
  const double n = 28 * 36, mean = total / n;
  EXPECT_GT(mean, 100);
  fmt::print("brute force: mean difference {:+.4f} %, RMS {:.3f} %\n", 100 * sum / n / mean,
             100 * std::sqrt(squares / n) / mean);
  EXPECT_LT(std::abs(sum / n), 0.003 * mean);
  EXPECT_LT(std::sqrt(squares / n), 0.02 * mean);
}

// Luminance of a level plate of the rover below a camera, without light from the sky.
LuminanceImage plate_of_the_rover(double sun_elevation_deg) {
  const ThreadPool workers(1);
  const TerrainShape shape(flat(), 1);
  const GroundScene scene(shape, RockField({.coverage = 0, .pebbles_per_m2 = 0}, 1), {-1, -1, 1, 1}, workers);
  const SkyLight sky(scene, shape, workers);
  const Sun sun({.sun_elevation_deg = sun_elevation_deg});
  const Soil soil({}, 1);
  RoverMesh plate;
  plate.mesh.vertices = {{-3, -3, 0.5}, {3, -3, 0.5}, {3, 3, 0.5}, {-3, 3, 0.5}};
  plate.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  plate.albedo = {0.5F, 0.5F};
  const RoverBody rover(plate);
  Exposing exposing = at_rest(looking_down(1, 90));
  exposing.rover = &rover;
  return Renderer(pinhole(32, 24, 40), Sampling::of(4)).render({scene, sky, sun, soil, 0}, exposing, true, workers);
}

TEST(Renderer, TheRoverScattersByLambertsLawAndIsAMaterialOfItsOwn) {
  const LuminanceImage low = plate_of_the_rover(20), high = plate_of_the_rover(70);
  const double degree = std::numbers::pi / 180;
  for (const auto& [x, y] : {std::pair{3, 3}, {16, 12}, {30, 20}}) {
    EXPECT_GT(low.total(x, y), 0);
    EXPECT_EQ(low.by_material[static_cast<std::size_t>(Material::rover)](x, y), low.total(x, y));
    EXPECT_NEAR(high.total(x, y) / low.total(x, y), std::sin(70 * degree) / std::sin(20 * degree), 1e-3);
  }
}

TEST(Renderer, IsBitIdenticalForAnyNumberOfThreads) {
  const TerrainShape shape({}, 3);
  const RockField rocks({.coverage = 0.1}, 3);
  const Camera camera = pinhole(160, 120, 120);
  std::vector<Image<float>> images;
  for (const int threads : {1, 2}) {
    const ThreadPool workers(threads);
    const GroundScene scene(shape, rocks, {-0.5, -1, 2, 1}, workers);
    const SkyLight sky(scene, shape, workers);
    const Sun sun({});
    const Soil soil({}, 3);
    const Pose pose = looking_down(0.5, 40);
    images.push_back(std::move(
        Renderer(camera, Sampling::of(2)).render({scene, sky, sun, soil, 5000}, pose, false, workers).by_material[0]));
  }
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) ASSERT_EQ(images[0](x, y), images[1](x, y)) << x << ", " << y;
  }
}

// True disparities and occlusions against every triangle, from straight above; the far ground and rocks of the scene
// are not among the reference's triangles.
TEST(TrueDisparity, AgreesWithABruteForceReference) {
  const ThreadPool workers(2);
  const TerrainShape shape({}, 8);
  RockFieldOptions pebbly;
  pebbly.coverage = 0.3;
  pebbly.largest_m = 0.15;
  pebbly.height_ratio = 1;
  pebbly.smallest_m = 0.02;
  pebbly.pebbles_per_m2 = 0;
  const RockField rocks(pebbly, 11);
  const Region region{-0.3, -0.15, 0.3, 0.15};
  const GroundScene scene(shape, rocks, region, workers);
  const BruteForce brute(shape, rocks.rocks_in(region.grown(0.1)), scene.region());
  constexpr double kBaseline_m = 0.12, kFocal_px = 60;
  const Stereo s = parallel_pair(72, 28, kFocal_px, kBaseline_m);
  const Pose left(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())),
                  Eigen::Vector3d(-0.02, 0, shape.height(0, 0) + 0.25));
  const Pose right = left * Pose::from_translation({kBaseline_m, 0, 0});
  PairPoses poses;
  poses.world_from_left.top = left;
  poses.world_from_right.top = right;
  const TrueDisparity truth = DisparityTruth(s.rig, s.rig, s.rig.pairs[0], s.view).of(scene, poses, workers);
  int both = 0, hidden = 0, masks_differ = 0, missed = 0;
  for (int y = 0; y < 28; ++y) {
    for (int x = 0; x < 72; ++x) {
      const Eigen::Vector3d direction((x - 35.5) / kFocal_px, (y - 13.5) / kFocal_px, 1);
      const double depth =
          brute.first(left.translation(), left.rotation() * direction.normalized(), 0).distance / direction.norm();
      if (depth > 1) {
        ++missed;
        continue;
      }
      const double disparity = kFocal_px * kBaseline_m / depth;
      EXPECT_NEAR(truth.disparity(x, y), disparity, 2e-4) << x << ' ' << y;
      if (x - disparity < 0) continue;  // outside the right image
      const Eigen::Vector3d point = left * Eigen::Vector3d(depth * direction), to_point = point - right.translation();
      const double seen = brute.first(right.translation(), to_point.normalized(), 0).distance;
      const bool visible = seen > to_point.norm() - 1e-3;
      (visible ? both : hidden)++;
      masks_differ += visible != (truth.mask(x, y) == 255) ? 1 : 0;
    }
  }
  EXPECT_GT(both, 300);
  EXPECT_GT(hidden, 5);
  EXPECT_LE(missed, 2) << "rays between two triangles of the reference";
  EXPECT_LE(masks_differ, 1) << "edges of rocks";
}

}  // namespace
}  // namespace spartan::sim::internal
