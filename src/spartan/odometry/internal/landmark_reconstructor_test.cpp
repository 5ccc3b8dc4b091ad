#include "spartan/odometry/internal/landmark_reconstructor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "spartan/odometry/internal/matching/smoothed_image.h"
#include "spartan/testing/synthetic_world.h"

namespace spartan::internal {
namespace {

using testing::SyntheticFrame;

// A camera half a metre above rough ground, tilted 32° down; disparities from 12 to 60 px.
struct Scene {
  Scene() {
    const double s = std::sin(0.55), c = std::cos(0.55);
    Eigen::Matrix3d world_from_optical;
    world_from_optical << 0, -s, c, -1, 0, 0, 0, -c, -s;
    stereo = {{320, 240}, 246.0, {159.5, 119.5}, 0.12};
    frame = testing::SyntheticWorld(testing::SyntheticWorldOptions{})
                .render(stereo, Pose(world_from_optical, {0, 0, 0.5}), 1);
    left.compute(frame.left, ThreadPool(1));
    right.compute(frame.right, ThreadPool(1));
  }
  StereoImages images() const {
    return {stereo, frame.left, frame.right, left.view(), right.view(), {}, {}, frame.disparity};
  }
  RectifiedStereo stereo;
  SyntheticFrame frame;
  SmoothedImage left, right;
};

const Scene& scene() {
  static const Scene scene;
  return scene;
}

// Errors (estimate − truth) over a grid of pixels that both cameras see, and the number of those pixels.
struct Errors {
  std::vector<double> found;
  int pixels = 0;
  double density() const { return static_cast<double>(found.size()) / pixels; }
  double median() const { return quantile(0.5); }
  double quantile(double q) const {
    std::vector<double> sorted = found;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
  }
};

Errors errors_of(const LandmarkReconstructionOptions& options) {
  const LandmarkReconstructor reconstruction(options);
  Errors errors;
  for (int y = 20; y < 220; y += 7) {
    for (int x = 80; x < 300; x += 7) {
      if (scene().frame.mask(x, y) != 255) continue;
      ++errors.pixels;
      const auto found = reconstruction.reconstruct(scene().images(), x, y);
      if (found) errors.found.push_back(found->disparity - scene().frame.disparity(x, y));
    }
  }
  return errors;
}

TEST(LandmarkReconstructor, DisparitiesAreAccurateToATwentiethOfAPixel) {
  const Errors errors = errors_of({});
  EXPECT_GT(errors.density(), 0.6);
  // No bias: a hundredth of a pixel is 0.05 % of the range here.
  EXPECT_NEAR(errors.median(), 0, 0.015);
  EXPECT_LT(0.5 * (errors.quantile(0.84) - errors.quantile(0.16)), 0.08);
  const auto wrong = std::count_if(errors.found.begin(), errors.found.end(), [](double e) { return std::abs(e) > 1; });
  EXPECT_LT(wrong, 0.03 * static_cast<double>(errors.found.size()));
}

TEST(LandmarkReconstructor, EstimatingTheSlantReducesTheErrorOnTheGround) {
  LandmarkReconstructionOptions fronto_parallel;
  fronto_parallel.slant = false;
  const auto spread = [](const Errors& e) { return e.quantile(0.84) - e.quantile(0.16); };
  EXPECT_GT(spread(errors_of(fronto_parallel)), 1.5 * spread(errors_of({})));
}

TEST(LandmarkReconstructor, ReadsTheDenseDisparityImage) {
  LandmarkReconstructionOptions options;
  options.source = DisparitySource::dense;
  const Errors errors = errors_of(options);
  EXPECT_GT(errors.density(), 0.9);
  for (const double e : errors.found) EXPECT_EQ(e, 0);
  StereoImages without = scene().images();
  without.disparity = {};
  EXPECT_TRUE(
      LandmarkReconstructor(options).reconstruct(without, 160, 120).has_value());  // falls back to the row search
}

TEST(LandmarkReconstructor, RefinesAPrediction) {
  const LandmarkReconstructor reconstruction{LandmarkReconstructionOptions{}};
  int found = 0;
  for (int y = 40; y < 200; y += 20) {
    RowAlignment predicted;
    const double truth = scene().frame.disparity(200, y);
    predicted.disparity = truth + 0.5;
    predicted.slant.y() = 0.5 * (scene().frame.disparity(200, y + 1) - scene().frame.disparity(200, y - 1));
    const auto refined = reconstruction.refine(scene().images(), {200, y}, predicted, 3);
    if (!refined || std::abs(refined->disparity - truth) > 0.25) continue;
    ++found;
    // The result lies farther away than a radius of 0.1 px.
    EXPECT_FALSE(reconstruction.refine(scene().images(), {200, y}, predicted, 0.1).has_value());
  }
  EXPECT_GE(found, 6);  // of 8
}

TEST(LandmarkReconstructor, RejectsMaskedPixelsFlatImagesAndBorders) {
  const LandmarkReconstructor reconstruction{LandmarkReconstructionOptions{}};
  StereoImages images = scene().images();
  const Image<std::uint8_t> all_invalid(320, 240);
  images.right_mask = all_invalid;
  EXPECT_FALSE(reconstruction.reconstruct(images, 160, 120).has_value());
  for (const auto& [x, y] : {std::pair(0, 0), {319, 120}, {160, 239}, {160, 1}}) {
    EXPECT_FALSE(reconstruction.reconstruct(scene().images(), x, y).has_value());
  }
  const Image<std::uint8_t> flat(320, 240, 80);
  StereoImages blank = scene().images();
  blank.left = blank.right = flat;
  EXPECT_FALSE(reconstruction.reconstruct(blank, 160, 120).has_value());
}

}  // namespace
}  // namespace spartan::internal
