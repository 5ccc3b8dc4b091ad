#include "spartan/reconstruction/internal/matching/subpixel_refinement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"

namespace spartan::internal::matching {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr int kWidth = 150, kHeight = 90;

// A texture without frequencies that a pixel grid cannot hold, in gray levels around 0.
class Texture {
 public:
  Texture() {
    Random random(8);
    for (Wave& wave : waves_) {
      const double length_px = random.uniform(5, 25), angle = random.uniform(0, 2 * M_PI);
      wave = {2 * M_PI / length_px * std::cos(angle), 2 * M_PI / length_px * std::sin(angle),
              random.uniform(0, 2 * M_PI)};
    }
  }
  double operator()(double x, double y) const {
    double sum = 0;
    for (const Wave& wave : waves_) sum += std::sin(wave.along_x * x + wave.along_y * y + wave.phase);
    return 12 * sum;
  }

 private:
  struct Wave {
    double along_x, along_y, phase;
  };
  std::array<Wave, 12> waves_{};
};

std::uint8_t gray(double level) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
}

// A textured plane: disparity offset + along_x · x + along_y · y.
struct Plane {
  double offset = 9.3, along_x = 0, along_y = 0;
  double gain = 1, level = 128;  // of the right image
  double disparity(int x, int y) const { return offset + along_x * x + along_y * y; }
};

struct PlanePair {
  Image<std::uint8_t> left{kWidth, kHeight}, right{kWidth, kHeight};
};

PlanePair render(const Plane& plane) {
  const Texture texture;
  PlanePair pair;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      pair.left(x, y) = gray(128 + texture(x, y));
      // The left column that the right column x sees: x = x_left − d(x_left, y).
      const double left_x = (x + plane.offset + plane.along_y * y) / (1 - plane.along_x);
      pair.right(x, y) = gray(plane.level + plane.gain * texture(left_x, y));
    }
  }
  return pair;
}

Image<float> true_disparity(const Plane& plane) {
  Image<float> disparity(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) disparity(x, y) = static_cast<float>(plane.disparity(x, y));
  }
  return disparity;
}

struct Errors {
  double mean = 0, rms = 0;
};
Errors errors_of(const Image<float>& disparity, const Plane& plane) {
  Errors e;
  int count = 0;
  for (int y = 8; y < kHeight - 8; ++y) {
    for (int x = 30; x < kWidth - 8; ++x) {
      const double error = disparity(x, y) - plane.disparity(x, y);
      e.mean += error;
      e.rms += error * error;
      ++count;
    }
  }
  return {e.mean / count, std::sqrt(e.rms / count)};
}

SubpixelRefinement refinement(int threads = 1, SimdTarget simd = SimdTarget::automatic) {
  return {refinement_kernels_for(simd_target_index(simd)), ThreadPool(threads)};
}

// Refines `disparity` in place.
void refine(const PlanePair& pair, SubpixelRefinement& by, Image<float>& disparity) {
  by.resize(disparity.size());
  for (int y = 0; y < disparity.height(); ++y) std::copy_n(disparity.row(y), disparity.width(), by.disparity().row(y));
  by.refine(pair.left, pair.right);
  disparity = Image<float>::copy_of(by.disparity());
}
void refine(const PlanePair& pair, Image<float>& disparity) {
  SubpixelRefinement by = refinement();
  refine(pair, by, disparity);
}

// Refines the whole-pixel disparities of a plane, as matching finds them.
Errors errors_from_whole_pixels(const Plane& plane) {
  const PlanePair pair = render(plane);
  Image<float> disparity = true_disparity(plane);
  Random random(3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      disparity(x, y) = static_cast<float>(std::round(disparity(x, y) + random.normal(0, 0.1)));
  }
  refine(pair, disparity);
  return errors_of(disparity, plane);
}

TEST(SubpixelRefinement, FindsFractionsOfPixelsWithoutBias) {
  for (const double fraction : {0.0, 0.2, 0.35, 0.5, 0.65, 0.8}) {
    const Errors e = errors_from_whole_pixels({.offset = 9 + fraction});
    EXPECT_LT(std::abs(e.mean), 0.02) << fraction;
    EXPECT_LT(e.rms, 0.05) << fraction;
  }
}

TEST(SubpixelRefinement, FindsTheSlopeOfThePlane) {
  for (const Plane& plane : {Plane{.along_y = 0.34}, Plane{.along_x = 0.1}, Plane{.along_x = -0.08, .along_y = 0.15}}) {
    const Errors e = errors_from_whole_pixels(plane);
    EXPECT_LT(std::abs(e.mean), 0.02);
    EXPECT_LT(e.rms, 0.06);
  }
}

TEST(SubpixelRefinement, SolvesGainAndOffset) {
  const Errors e = errors_from_whole_pixels({.gain = 0.75, .level = 100});
  EXPECT_LT(std::abs(e.mean), 0.02);
  EXPECT_LT(e.rms, 0.05);
}

TEST(SubpixelRefinement, KeepsADepthEdge) {
  const Plane plane;
  const PlanePair pair = render(plane);
  Image<float> disparity = true_disparity(plane);
  // A step of 6 px that the images do not contain: neither side may leak into the other.
  for (int y = 0; y < kHeight; ++y) std::fill(disparity.row(y) + 80, disparity.row(y) + kWidth, 15.3F);
  refine(pair, disparity);
  for (int y = 10; y < kHeight - 10; ++y) {
    EXPECT_NEAR(disparity(77, y), 9.3, 0.5);
    EXPECT_NEAR(disparity(82, y), 15.3, 1.0);
  }
}

TEST(SubpixelRefinement, LeavesUnknownPixelsUnknownAndUsesNone) {
  const Plane plane;
  const PlanePair pair = render(plane);
  Image<float> disparity = true_disparity(plane);
  Random random(5);
  std::vector<bool> unknown;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      unknown.push_back(random.below(3) == 0);
      if (unknown.back()) disparity(x, y) = kUnknown;
    }
  }
  refine(pair, disparity);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      ASSERT_EQ(std::isnan(disparity(x, y)), unknown[static_cast<std::size_t>(y * kWidth + x)]);
      if (x > 30 && x < 140 && !std::isnan(disparity(x, y))) {
        ASSERT_NEAR(disparity(x, y), 9.3, 0.3);
      }
    }
  }
}

TEST(SubpixelRefinement, KnowsTheTexture) {
  const PlanePair pair = render({});
  // Smallest and largest information inside of the image.
  const auto information_of = [](const PlanePair& images, bool random_start) {
    SubpixelRefinement refined = refinement();
    Image<float> disparity(kWidth, kHeight, 9.3F);
    Random random(4);
    for (int y = 0; y < kHeight && random_start; ++y) {
      for (int x = 0; x < kWidth; ++x) disparity(x, y) = static_cast<float>(random.uniform(0, 40));
    }
    refine(images, refined, disparity);
    std::pair<double, double> range{1e9, 0};
    for (int y = 12; y < 78; ++y) {
      for (int x = 50; x < 138; ++x) {
        range.first = std::min<double>(range.first, refined.information()(x, y));
        range.second = std::max<double>(range.second, refined.information()(x, y));
      }
    }
    return range;
  };
  EXPECT_GT(information_of(pair, false).first, 1000) << "px^-2";
  const auto constant = [] { return Image<std::uint8_t>(kWidth, kHeight, std::uint8_t{90}); };
  EXPECT_LT(information_of({constant(), constant()}, false).second, 0.1);
  // Unrelated noise has gradients, but nothing in common.
  Random random(6);
  PlanePair noise;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      noise.left(x, y) = gray(random.normal(128, 10));
      noise.right(x, y) = gray(random.normal(128, 10));
    }
  }
  EXPECT_LT(information_of(noise, true).second, 60);
}

TEST(SubpixelRefinement, MeasuresTheRelief) {
  const Plane plane{.along_x = 0.05, .along_y = 0.2};
  const PlanePair pair = render(plane);
  SubpixelRefinement refined = refinement();
  Image<float> disparity = true_disparity(plane);
  refine(pair, refined, disparity);
  for (int y = 8; y < kHeight - 8; ++y) {
    for (int x = 30; x < kWidth; ++x) EXPECT_LT(refined.relief()(x, y), 0.15 * 0.15) << "a plane has none";
  }
  // A step of 3 px: second differences of at least a pixel count as one.
  disparity = true_disparity(plane);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 80; x < kWidth; ++x) disparity(x, y) += 3;
  }
  refine(pair, refined, disparity);
  const auto relief = refined.relief();
  EXPECT_NEAR(relief(78, 40), 0.75 + 0.25 * 0.75, 0.02) << "three of the four directions cross the edge";
  EXPECT_NEAR(relief(74, 40), 0.25 * 0.75, 0.02) << "at a distance of 6 px only the longer step";
  EXPECT_LT(relief(60, 40), 0.01);
  disparity = Image<float>(kWidth, kHeight, kUnknown);
  disparity(40, 40) = 9.3F;
  refine(pair, refined, disparity);
  EXPECT_NEAR(refined.relief()(40, 40), 0.25 + 0.25 * 0.25, 1e-6) << "half a pixel where no pair is known";
}

TEST(SubpixelRefinement, SamplesTheGradients) {
  // A ramp with noise in both images: var(g) − var(q) is 0, and var(q) that of noise,
  // (σ²/2 + σ²/2)/4, less what the interpolation takes from the right image.
  Random random(2);
  PlanePair pair;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      pair.left(x, y) = gray(20 + x + random.normal(0, 3));
      pair.right(x, y) = gray(29 + x + random.normal(0, 3));
    }
  }
  SubpixelRefinement refined = refinement();
  Image<float> disparity(kWidth, kHeight, 9.0F);
  disparity(4 * 20 + 2, 4 * 10 + 2) = kUnknown;
  refine(pair, refined, disparity);
  const GradientVariances gradients = refined.gradients();
  ASSERT_EQ(gradients.mean.size(), (ImageSize{38, 23}));
  EXPECT_TRUE(std::isnan(gradients.mean(20, 10)) && std::isnan(gradients.difference(20, 10)));
  double mean = 0, difference = 0;
  int count = 0;
  for (int y = 2; y < 21; ++y) {
    for (int x = 5; x < 35; ++x) {
      if (x == 20 && y == 10) continue;
      mean += gradients.mean(x, y);
      difference += gradients.difference(x, y);
      ++count;
    }
  }
  EXPECT_NEAR(difference / count, 9.0 / 4, 0.4);
  EXPECT_NEAR(mean / count, 9.0 / 4, 0.4);
}

TEST(SubpixelRefinement, IsDeterministicOnEveryInstructionSetAndNumberOfThreads) {
  const Plane plane{.along_x = 0.05, .along_y = 0.2};
  const PlanePair pair = render(plane);
  const auto refined = [&](int threads, SimdTarget simd) {
    Image<float> disparity = true_disparity(plane);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) disparity(x, y) = (x * y) % 11 == 0 ? kUnknown : std::round(disparity(x, y));
    }
    SubpixelRefinement r = refinement(threads, simd);
    refine(pair, r, disparity);
    std::vector<float> values;
    for (int y = 0; y < kHeight; ++y) {
      values.insert(values.end(), disparity.row(y), disparity.row(y) + kWidth);
      for (int x = 0; x < kWidth; ++x) values.push_back(r.information()(x, y));
      for (int x = 0; x < kWidth; ++x) values.push_back(r.relief()(x, y));
    }
    for (int y = 0; y < r.gradients().mean.height(); ++y) {
      for (int x = 0; x < r.gradients().mean.width(); ++x) {
        values.push_back(r.gradients().mean(x, y));
        values.push_back(r.gradients().difference(x, y));
      }
    }
    return values;
  };
  const auto expected = refined(1, SimdTarget::automatic);
  const auto same = [&](const std::vector<float>& found) {
    return std::memcmp(found.data(), expected.data(), expected.size() * sizeof(float)) == 0;
  };
  EXPECT_TRUE(same(refined(2, SimdTarget::automatic)));
  for (const SimdTarget simd : available_simd_targets()) EXPECT_TRUE(same(refined(1, simd))) << name_of(simd);
}

}  // namespace
}  // namespace spartan::internal::matching
