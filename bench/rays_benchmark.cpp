// How many rays a second one core casts into the simulated ground: Embree's bare intersections beside the whole
// picture. `make bench-rays_benchmark`; items are rays.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <numbers>
#include <vector>

#include "spartan/sim/renderer.h"

namespace spartan::sim {
namespace {

// The wide camera's first look: 0.9 to 4 m ahead, over ground with 7 % of rocks.
struct Stage {
  TerrainShape shape{TerrainShapeOptions{}, 21};
  RockField rocks{RockFieldOptions{}, 21};
  Soil soil{SoilOptions{}, 21};
  Sun sun{LightOptions{}};
  GroundScene scene{shape, rocks, {-0.5, -2.5, 6, 2.5}, Workers(2)};
  SkyLight sky{scene, shape, Workers(2)};
  Camera camera;
  Pose world_from_camera;

  Stage() {
    camera.name = "wide";
    camera.size = {1120, 1120};
    camera.model = PinholeModel{1200.9239, 1200.9239, 559.5, 559.5};
    const Eigen::Matrix3d forward{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}};
    const Eigen::AngleAxisd tilt(39 * std::numbers::pi / 180, Eigen::Vector3d::UnitY());
    world_from_camera = {Eigen::Quaterniond(tilt.toRotationMatrix() * forward),
                         Eigen::Vector3d(0, 0, shape.height(0, 0) + 1)};
  }
  LitScene around() const { return {scene, sky, sun, soil, LightOptions{}.sky_lux}; }
};

const Stage& stage() {
  static const Stage made;
  return made;
}

// The picture's rays, two by two a pixel.
std::vector<RayPacket> primary_rays(const Stage& s) {
  const Eigen::Matrix3f turn = s.world_from_camera.rotation().toRotationMatrix().cast<float>();
  const Eigen::Vector3f eye = (s.world_from_camera.translation() - s.scene.origin()).cast<float>();
  const int side = 2 * s.camera.size.width;
  std::vector<RayPacket> packets;
  packets.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) / kPacket);
  for (int y = 0; y < side; ++y) {
    for (int first = 0; first < side; first += kPacket) {
      RayPacket rays;
      for (int k = 0; k < kPacket; ++k) {
        const auto ray = unproject(s.camera.model, {(first + k + 0.5) / 2 - 0.5, (y + 0.5) / 2 - 0.5});
        rays.set(k, eye, turn * ray->direction.normalized().cast<float>(), 200.0F);
      }
      packets.push_back(rays);
    }
  }
  return packets;
}

void count(benchmark::State& state, std::size_t rays) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays));
}

void EmbreePrimary(benchmark::State& state) {
  const std::vector<RayPacket> packets = primary_rays(stage());
  for (auto _ : state) {
    for (const RayPacket& rays : packets) benchmark::DoNotOptimize(stage().scene.intersect(rays));
  }
  count(state, packets.size() * kPacket);
}
BENCHMARK(EmbreePrimary)->Unit(benchmark::kMillisecond);

void EmbreeShadow(benchmark::State& state) {
  std::vector<RayPacket> packets = primary_rays(stage());
  for (RayPacket& rays : packets) {
    const HitPacket hits = stage().scene.intersect(rays);
    for (int k = 0; k < kPacket; ++k) {
      const Eigen::Vector3f from(rays.origin_x[k], rays.origin_y[k], rays.origin_z[k]),
          along(rays.direction_x[k], rays.direction_y[k], rays.direction_z[k]);
      const bool met = hits.distance[k] < 200;
      rays.set(k, met ? Eigen::Vector3f(from + (hits.distance[k] - 1e-4F) * along) : from, stage().sun.direction(0),
               met ? 200.0F : -1.0F);
    }
  }
  for (auto _ : state) {
    for (const RayPacket& rays : packets) benchmark::DoNotOptimize(stage().scene.occluded(rays));
  }
  count(state, packets.size() * kPacket);
}
BENCHMARK(EmbreeShadow)->Unit(benchmark::kMillisecond);

// With shadow, sky, soil, exposure and point spread.
void WholePicture(benchmark::State& state) {
  const Renderer renderer(stage().camera, Sampling::of(4));
  Renderer::Poses poses;
  poses.fill(stage().world_from_camera);
  for (auto _ : state) benchmark::DoNotOptimize(renderer.render(stage().around(), poses, false, Workers(1)));
  count(state, static_cast<std::size_t>(renderer.rays()));
}
BENCHMARK(WholePicture)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace spartan::sim
