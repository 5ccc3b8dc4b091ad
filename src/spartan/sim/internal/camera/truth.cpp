#include "spartan/sim/internal/camera/truth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace spartan::sim::internal {
namespace {

constexpr float kFarthestTruth_m = 400;   // beyond the corner of the horizon square
constexpr float kGroundOffset_m = 1e-3F;  // visibility rays end this far before the ground, against self-intersection
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr double kTile_m = 8;  // side of the tiles in which maps are rasterized

bool is_inside(const Eigen::Vector2d& pixel, ImageSize size) {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < size.width - 0.5 && pixel.y() < size.height - 0.5;
}

// A row as a fraction of the image's height.
double row_part(double row, ImageSize size) {
  return std::clamp((row + 0.5) / size.height, 0.0, 1.0);
}

}  // namespace

DisparityTruth::DisparityTruth(const Rig& true_rig, const Rig& nominal_rig, const StereoPair& pair,
                               const RectifiedView& view)
    : view_(view),
      true_right_(*true_rig.find_camera(pair.right)),
      nominal_right_(*nominal_rig.find_camera(pair.right)) {
  const Camera& true_left = *true_rig.find_camera(pair.left);
  const Camera& nominal_left = *nominal_rig.find_camera(pair.left);
  const auto [w, h] = view.geometry.size;
  directions_.assign(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), Eigen::Vector3f(0, 0, 0));
  row_parts_.assign(directions_.size(), 0.0F);
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) {
      const Eigen::Vector3d rectified((u - view.geometry.centre_px.x()) / view.geometry.focal_px,
                                      (v - view.geometry.centre_px.y()) / view.geometry.focal_px, 1);
      const auto recorded = project(nominal_left.model, view.left_from_rectified * rectified);
      if (!recorded || !is_inside(*recorded, true_left.size)) continue;
      const auto ray = unproject(true_left.model, *recorded);
      if (!ray) continue;
      const std::size_t at = static_cast<std::size_t>(v) * static_cast<std::size_t>(w) + static_cast<std::size_t>(u);
      directions_[at] = ray->direction.cast<float>();
      row_parts_[at] = static_cast<float>(row_part(recorded->y(), true_left.size));
    }
  }
}

std::optional<Eigen::Vector2d> DisparityTruth::right_pixel(const PairPoses& poses, const Eigen::Vector3d& point) const {
  const auto pixel_at = [&](double part) {
    return project(true_right_.model, poses.world_from_right.at(part).inverse() * point);
  };
  auto pixel = pixel_at(0.5);
  // The row depends on the pose and the pose on the row; the camera moves little between rows.
  constexpr int kSteps = 3;
  for (int step = 0; poses.world_from_right.rolls && pixel && step < kSteps; ++step)
    pixel = pixel_at(row_part(pixel->y(), true_right_.size));
  return pixel;
}

void DisparityTruth::fill_row(const GroundScene& scene, const PairPoses& poses, int row, TrueDisparity& truth) const {
  const int w = view_.geometry.size.width;
  for (int first = 0; first < w; first += kPacket) {
    RayPacket rays, back;
    RoverBody::Poses bodies{};
    std::array<Pose, kPacket> left, body_from_origin;
    for (int k = 0; k < kPacket; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(w) +
                             static_cast<std::size_t>(std::min(first + k, w - 1));
      const double part = static_cast<double>(row_parts_[at]);
      left[i] = poses.world_from_left.at(part);
      if (poses.rover) {
        body_from_origin[i] = poses.world_from_body.at(part).inverse() * Pose::from_translation(scene.origin());
        bodies[i] = &body_from_origin[i];
      }
      const bool valid = first + k < w && directions_[at].z() != 0;
      rays.set(k, (left[i].translation() - scene.origin()).cast<float>(),
               left[i].rotation().cast<float>() * directions_[at], valid ? kFarthestTruth_m : -1.0F);
    }
    HitPacket hits = scene.intersect(rays);
    std::array<float, kPacket> disparity{}, rover{};
    if (poses.rover) rover = poses.rover->intersect(rays, bodies, hits);
    for (int k = 0; k < kPacket; ++k) {
      const auto i = static_cast<std::size_t>(k);
      disparity[i] = kNaN;
      back.set(k, Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitZ(), -1.0F);
      if (rays.max_distance[k] < 0 || !std::isfinite(hits.distance[k]) || rover[i] > 0) continue;
      const Eigen::Vector3f along(rays.direction_x[k], rays.direction_y[k], rays.direction_z[k]);
      const Eigen::Vector3d place =
          left[i].translation() + static_cast<double>(hits.distance[k]) * along.cast<double>();
      const auto recorded = right_pixel(poses, place);
      if (!recorded) continue;
      const auto nominal = unproject(nominal_right_.model, *recorded);
      if (!nominal) continue;
      const Eigen::Vector3d rectified = view_.right_from_rectified.transpose() * nominal->direction;
      const double u = view_.geometry.focal_px * rectified.x() / rectified.z() + view_.geometry.centre_px.x();
      disparity[i] = static_cast<float>(first + k - u);
      if (!is_inside(*recorded, true_right_.size)) continue;
      const Eigen::Vector3d centre = poses.world_from_right.at(row_part(recorded->y(), true_right_.size)).translation();
      const Eigen::Vector3f to_point = (place - centre).cast<float>();
      const float distance = to_point.norm();
      back.set(k, (centre - scene.origin()).cast<float>(), to_point / distance, distance - kGroundOffset_m);
    }
    std::uint32_t hidden = scene.occluded(back);
    if (poses.rover) hidden |= poses.rover->occluded(back, bodies);
    for (int k = 0; k < kPacket && first + k < w; ++k) {
      const float d = disparity[static_cast<std::size_t>(k)];
      const bool known = std::isfinite(d) && d > 0;
      const bool both = known && back.max_distance[k] > 0 && (hidden >> k & 1U) == 0;
      truth.disparity(first + k, row) = known ? d : kNaN;
      truth.mask(first + k, row) = both ? 255 : known ? 128 : 0;
    }
  }
}

TrueDisparity DisparityTruth::of(const GroundScene& scene, const PairPoses& poses, const ThreadPool& workers) const {
  const auto [w, h] = view_.geometry.size;
  TrueDisparity truth{Image<float>(w, h), Image<std::uint8_t>(w, h)};
  workers.parallel_for(0, h, 8, [&](int from, int to) {
    for (int row = from; row < to; ++row) fill_row(scene, poses, row, truth);
  });
  return truth;
}

namespace {

// Fills the part of the map inside one scene's region by vertical rays.
void fill_tile(const TerrainShape& shape, const GroundScene& scene, GroundMap& map, int i0, int j0, int i1, int j1) {
  const double top_m = 50;
  for (int j = j0; j < j1; ++j) {
    const double y = map.north_m - (j + 0.5) * map.cell_m;
    for (int first = i0; first < i1; first += kPacket) {
      RayPacket rays;
      for (int k = 0; k < kPacket; ++k) {
        const double x = map.west_m + (first + k + 0.5) * map.cell_m;
        const Eigen::Vector3d from(x, y, scene.origin().z() + top_m);
        rays.set(k, (from - scene.origin()).cast<float>(), -Eigen::Vector3f::UnitZ(), first + k < i1 ? 200.0F : -1.0F);
      }
      const HitPacket hits = scene.intersect(rays);
      for (int k = 0; k < kPacket && first + k < i1; ++k) {
        const double x = map.west_m + (first + k + 0.5) * map.cell_m;
        const double ground = shape.height(x, y);
        map.ground(first + k, j) = static_cast<float>(ground);
        map.level(first + k, j) = static_cast<float>(ground + shape.cavity_depth(x, y));
        const double rock = hits.rock[k] ? scene.origin().z() + top_m - static_cast<double>(hits.distance[k]) : ground;
        map.surface(first + k, j) =
            static_cast<float>(std::max(ground, rock));  // the lower side of a rock on a slope may be below the ground
      }
    }
  }
}

}  // namespace

GroundMap map_ground(const TerrainShape& shape, const RockField& rocks, const Region& region, double cell_m,
                     const ThreadPool& workers) {
  GroundMap map;
  constexpr double kRounding = 1e-6;  // in cells: a region that ends on the lattice gets no extra cell
  map.cell_m = cell_m;
  map.west_m = std::floor(region.x0 / cell_m + kRounding) * cell_m;
  map.north_m = std::ceil(region.y1 / cell_m - kRounding) * cell_m;
  const int width = static_cast<int>(std::ceil((region.x1 - map.west_m) / cell_m - kRounding));
  const int height = static_cast<int>(std::ceil((map.north_m - region.y0) / cell_m - kRounding));
  for (Image<float>* image : {&map.surface, &map.ground, &map.level}) *image = Image<float>(width, height);
  const int tile = std::max(1, static_cast<int>(kTile_m / cell_m));
  for (int j0 = 0; j0 < height; j0 += tile) {
    for (int i0 = 0; i0 < width; i0 += tile) {
      const int i1 = std::min(i0 + tile, width), j1 = std::min(j0 + tile, height);
      const Region part{map.west_m + i0 * cell_m, map.north_m - j1 * cell_m, map.west_m + i1 * cell_m,
                        map.north_m - j0 * cell_m};
      const GroundScene scene = GroundScene::rocks_only(shape, rocks, part, workers);
      workers.parallel_for(j0, j1, 16, [&](int from, int to) { fill_tile(shape, scene, map, i0, from, i1, to); });
    }
  }
  return map;
}

Image<float> classify_ground(const GroundMap& map, double obstacle_m, double cavity_m) {
  const auto [w, h] = map.surface.size();
  Image<float> kinds(w, h, 1.0F);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      if (map.surface(x, y) - map.level(x, y) > obstacle_m) {
        kinds(x, y) = 2;
      } else if (map.level(x, y) - map.surface(x, y) > cavity_m) {
        kinds(x, y) = 3;
      }
    }
  }
  return kinds;
}

}  // namespace spartan::sim::internal
