// What somebody else writes to use Spartan with images of their own: a rig, a pipeline, frames pushed in.
//
// The "rover" looks at a textured wall 3 m away and moves 6 cm to the right from frame to frame, which is 6 pixels.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "spartan/rig/rig.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_options.h"

namespace {

constexpr int kWidth = 640, kHeight = 480;
constexpr double kFocal_px = 300, kWall_m = 3, kBaseline_m = 0.12, kStep_m = 0.06;
constexpr int kFrames = 5;

double noise(int x, int y) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x9E3779B1u + static_cast<std::uint32_t>(y) * 0x85EBCA77u;
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return (h ^ (h >> 15)) / 4294967296.0;
}

double texture(double x, double y, double size) {
  const double u = x / size, v = y / size;
  const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
  const double a = u - i, b = v - j;
  return (1 - b) * ((1 - a) * noise(i, j) + a * noise(i + 1, j)) +
         b * ((1 - a) * noise(i, j + 1) + a * noise(i + 1, j + 1));
}

/// The image of a camera that is `camera_m` to the right of the start.
std::vector<std::uint8_t> render_wall(double camera_m) {
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double on_wall_px = x + camera_m * kFocal_px / kWall_m;
      const double level = 0.6 * texture(on_wall_px, y, 13) + 0.4 * texture(on_wall_px, y, 5);
      pixels[static_cast<std::size_t>(y * kWidth + x)] = static_cast<std::uint8_t>(20 + 215 * level);
    }
  }
  return pixels;
}

spartan::FrameImage borrow(const std::vector<std::uint8_t>& pixels) {
  return spartan::FrameImage::borrow(spartan::ImageView<const std::uint8_t>(pixels.data(), kWidth, kHeight, kWidth),
                                     {});
}

spartan::Camera camera(const char* name) {
  spartan::Camera camera;
  camera.name = name;
  camera.size = {kWidth, kHeight};
  camera.model = spartan::PinholeModel{kFocal_px, kFocal_px, 0.5 * (kWidth - 1), 0.5 * (kHeight - 1)};
  return camera;
}

// In the middle of the image.
double distance_in(const spartan::TerrainView& terrain) {
  const float disparity = terrain.disparity(kWidth / 2, kHeight / 2);
  return terrain.geometry.focal_px * terrain.geometry.baseline_m / disparity;
}

}  // namespace

int main() {
  const spartan::Rig rig = spartan::rig_of_one_pair("front", camera("left"), camera("right"),
                                                    spartan::Pose::from_translation({-kBaseline_m, 0, 0}));
  auto pipeline = spartan::Pipeline::create(rig, spartan::RunOptions{}, spartan::ThreadPool(2));
  if (!pipeline) {
    std::fprintf(stderr, "%s\n", pipeline.error().message().c_str());
    return 1;
  }
  spartan::Pose world_from_body;
  double wall_m = 0;
  for (int k = 0; k < kFrames; ++k) {
    const auto left = render_wall(k * kStep_m), right = render_wall(k * kStep_m + kBaseline_m);
    spartan::StereoFrame frame;
    frame.frame_id = k;
    frame.pair = rig.pairs.front().name;
    frame.left_stamp = frame.right_stamp = spartan::Stamp{k * 1'000'000'000LL};
    frame.left = borrow(left);
    frame.right = borrow(right);
    const auto result = pipeline->add(frame);
    if (!result || !*result) {
      std::fprintf(stderr, "frame %d: %s\n", k, result ? "nothing" : result.error().message().c_str());
      return 1;
    }
    world_from_body = (*result)->world_from_body.pose;
    if ((*result)->terrain) wall_m = distance_in(*(*result)->terrain);
  }
  // Terrain comes some frames later: the last view, after the last frame.
  if (const auto terrain = pipeline->finish_terrain()) wall_m = distance_in(*terrain);
  // The body looks along x with y to the left.
  const double driven_m = -world_from_body.translation().y();
  std::printf("driven %.4f m to the right (truth %.2f), wall at %.3f m (truth %.1f)\n", driven_m,
              (kFrames - 1) * kStep_m, wall_m, kWall_m);
  const bool accurate = std::abs(driven_m - (kFrames - 1) * kStep_m) < 0.002 && std::abs(wall_m - kWall_m) < 0.05;
  return accurate ? 0 : 1;
}
