// Rays per second and core of the simulator: Embree's intersections alone, and the whole renderer.
// `make bench-rays_benchmark`; items are rays.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <numbers>
#include <vector>

#include "spartan/sim/internal/camera/renderer.h"

namespace spartan::sim {

using namespace internal;
namespace {

// A view of the wide camera: 0.9 to 4 m ahead, over ground with 7 % of rocks.
struct TestScene {
  TerrainShape shape{TerrainShapeOptions{}, 21};
  RockField rocks{RockFieldOptions{}, 21};
  Soil soil{SoilOptions{}, 21};
  Sun sun{LightOptions{}};
  GroundScene scene{shape, rocks, {-0.5, -2.5, 6, 2.5}, ThreadPool(2)};
  SkyLight sky{scene, shape, ThreadPool(2)};
  Camera camera;
  Pose world_from_camera;

  TestScene() {
    camera.name = "wide";
    camera.size = {1120, 1120};
    camera.model = PinholeModel{1200.9239, 1200.9239, 559.5, 559.5};
    const Eigen::Matrix3d forward{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}};
    const Eigen::AngleAxisd tilt(39 * std::numbers::pi / 180, Eigen::Vector3d::UnitY());
    world_from_camera = {Eigen::Quaterniond(tilt.toRotationMatrix() * forward),
                         Eigen::Vector3d(0, 0, shape.height(0, 0) + 1)};
  }
  LitScene lit() const { return {scene, sky, sun, soil, LightOptions{}.sky_lux}; }
};

const TestScene& test_scene() {
  static const TestScene scene;
  return scene;
}

// The rays of an image, 2 × 2 per pixel.
std::vector<RayPacket> primary_rays(const TestScene& s) {
  const Eigen::Matrix3f rotation = s.world_from_camera.rotation().toRotationMatrix().cast<float>();
  const Eigen::Vector3f centre = (s.world_from_camera.translation() - s.scene.origin()).cast<float>();
  const int side = 2 * s.camera.size.width;
  std::vector<RayPacket> packets;
  packets.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) / kPacket);
  for (int y = 0; y < side; ++y) {
    for (int first = 0; first < side; first += kPacket) {
      RayPacket rays;
      for (int k = 0; k < kPacket; ++k) {
        const auto ray = unproject(s.camera.model, {(first + k + 0.5) / 2 - 0.5, (y + 0.5) / 2 - 0.5});
        rays.set(k, centre, rotation * ray->direction.normalized().cast<float>(), 200.0F);
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
  const std::vector<RayPacket> packets = primary_rays(test_scene());
  for (auto _ : state) {
    for (const RayPacket& rays : packets) benchmark::DoNotOptimize(test_scene().scene.intersect(rays));
  }
  count(state, packets.size() * kPacket);
}
BENCHMARK(EmbreePrimary)->Unit(benchmark::kMillisecond);

void EmbreeShadow(benchmark::State& state) {
  std::vector<RayPacket> packets = primary_rays(test_scene());
  for (RayPacket& rays : packets) {
    const HitPacket hits = test_scene().scene.intersect(rays);
    for (int k = 0; k < kPacket; ++k) {
      const Eigen::Vector3f from(rays.origin_x[k], rays.origin_y[k], rays.origin_z[k]),
          along(rays.direction_x[k], rays.direction_y[k], rays.direction_z[k]);
      const bool hit = hits.distance[k] < 200;
      rays.set(k, hit ? Eigen::Vector3f(from + (hits.distance[k] - 1e-4F) * along) : from,
               test_scene().sun.direction(0), hit ? 200.0F : -1.0F);
    }
  }
  for (auto _ : state) {
    for (const RayPacket& rays : packets) benchmark::DoNotOptimize(test_scene().scene.occluded(rays));
  }
  count(state, packets.size() * kPacket);
}
BENCHMARK(EmbreeShadow)->Unit(benchmark::kMillisecond);

// With shadows, sky light, soil, motion blur and point spread function.
void WholeImage(benchmark::State& state) {
  const Renderer renderer(test_scene().camera, Sampling::of(4));
  for (auto _ : state)
    benchmark::DoNotOptimize(renderer.render(test_scene().lit(), test_scene().world_from_camera, false, ThreadPool(1)));
  count(state, static_cast<std::size_t>(renderer.rays()));
}
BENCHMARK(WholeImage)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace spartan::sim
