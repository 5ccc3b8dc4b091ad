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
#include "wall.h"

namespace {

constexpr double kStep_m = 0.06;
constexpr int kFrames = 5;

spartan::FrameImage borrow(const std::vector<std::uint8_t>& pixels) {
  return spartan::FrameImage::borrow(spartan::ImageView<const std::uint8_t>(pixels.data(), kWidth, kHeight, kWidth),
                                     {});
}

// In the middle of the image.
double distance_in(const spartan::TerrainView& terrain) {
  const float disparity = terrain.disparity(kWidth / 2, kHeight / 2);
  return terrain.geometry.focal_px * terrain.geometry.baseline_m / disparity;
}

}  // namespace

int main() {
  const spartan::Rig rig = wall_rig();
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
