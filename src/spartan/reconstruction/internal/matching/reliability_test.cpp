#include "spartan/reconstruction/internal/matching/reliability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "spartan/numerics/simd_target.h"

namespace spartan::internal::matching {
namespace {

struct Result {
  int outlier_percent;
  double sigma_px;
  bool kept, reliable;
};

class Reliability : public ::testing::TestWithParam<SimdTarget> {
 protected:
  // Of pixels of one information and relief and the right distances 0, 1, 2 ….
  static std::vector<Result> assessed(float information, int count, int most_percent = 100, float relief = 0,
                                      bool has_texture = true) {
    Image<float> informations(count + 64, 1, information), reliefs(count + 64, 1, relief);
    Image<float> disparity(count, 1, 7.0F), sigma(count, 1);
    Image<std::uint8_t> distance(count, 1), percent(count, 1), reliable(count, 1, std::uint8_t{has_texture});
    for (int x = 0; x < count; ++x) distance(x, 0) = static_cast<std::uint8_t>(x);
    assess({informations.view().crop(0, 0, count, 1), reliefs.view().crop(0, 0, count, 1), distance, most_percent},
           refinement_kernels_for(simd_target_index(GetParam())), ThreadPool(1), {disparity, sigma, percent, reliable});
    std::vector<Result> results;
    results.reserve(static_cast<std::size_t>(count));
    for (int x = 0; x < count; ++x) {
      results.push_back(
          {percent(x, 0), static_cast<double>(sigma(x, 0)), !std::isnan(disparity(x, 0)), reliable(x, 0) == 1});
    }
    return results;
  }
};

TEST_P(Reliability, IsTheLogisticFunctionOfInformationReliefAndRightDistance) {
  for (const double information : {2.5, 8.0, 40.0, 300.0, 5000.0}) {
    for (const double relief : {0.0, 0.02, 0.3, 1.25}) {
      const auto results = assessed(static_cast<float>(information), 17, 100, static_cast<float>(relief));
      for (const int distance : {0, 1, 3, 16}) {
        const double logit = 2.502 + 0.474 * std::log2(1.0 + distance) - 0.525 * std::log2(information) +
                             0.396 * std::log2(relief + 0.01);
        EXPECT_NEAR(results[static_cast<std::size_t>(distance)].outlier_percent, 100 / (1 + std::exp(-logit)), 4)
            << information << ", " << relief << ", " << distance;
      }
    }
  }
}

TEST_P(Reliability, OutliersAreLessLikelyWithInformationAndMoreWithDistance) {
  for (float information = 1e-6F; information < 1e8F; information *= 1.07F) {
    const auto results = assessed(information, 17), more = assessed(information * 1.07F, 17);
    for (std::size_t i = 0; i < results.size(); ++i) {
      EXPECT_GE(results[i].outlier_percent, more[i].outlier_percent);
      if (i > 0) {
        EXPECT_GE(results[i].outlier_percent, results[i - 1].outlier_percent);
      }
    }
  }
}

TEST_P(Reliability, SigmaFollowsFromInformationAndRelief) {
  for (const double information : {2.5, 40.0, 300.0, 5000.0}) {
    for (const double relief : {0.0, 0.02, 1.25}) {
      const double unbounded = std::pow(37.5 / information, 2) + 1.97 * 1.97 * relief + 0.017 * 0.017;
      EXPECT_NEAR(assessed(static_cast<float>(information), 1, 100, static_cast<float>(relief))[0].sigma_px,
                  std::sqrt(1 / (1 / unbounded + 1 / (0.523 * 0.523))), 1e-6);
    }
  }
}

TEST_P(Reliability, SigmaHasAFloorAndALargestValue) {
  EXPECT_NEAR(assessed(1e9F, 1)[0].sigma_px, 0.017, 1e-4);
  EXPECT_NEAR(assessed(1e-3F, 1)[0].sigma_px, 0.523, 1e-4);
}

TEST_P(Reliability, DiscardsWhatIsTooUnlikely) {
  EXPECT_TRUE(assessed(1000, 1, 70)[0].kept);
  EXPECT_FALSE(assessed(2, 1, 70, 0.3F)[0].kept);
  EXPECT_TRUE(assessed(2, 1, 100, 0.3F)[0].kept);
}

TEST_P(Reliability, APixelIsReliableWithTextureAndASmallProbability) {
  EXPECT_TRUE(assessed(1e6F, 1)[0].reliable);
  EXPECT_FALSE(assessed(1e6F, 1, 100, 0, false)[0].reliable);
  EXPECT_FALSE(assessed(8, 1, 100, 0.1F)[0].reliable);
}

TEST(UnknownReliability, IsUnknown) {
  Image<float> disparity(2, 1, 7.0F), sigma(2, 1, 0.1F);
  Image<std::uint8_t> percent(2, 1, std::uint8_t{3});
  disparity(1, 0) = std::numeric_limits<float>::quiet_NaN();
  clear_unknown(ThreadPool(1), {disparity, sigma, percent, {}});
  EXPECT_EQ(sigma(0, 0), 0.1F);
  EXPECT_EQ(percent(0, 0), 3);
  EXPECT_TRUE(std::isnan(sigma(1, 0)));
  EXPECT_EQ(percent(1, 0), 100);
}

INSTANTIATE_TEST_SUITE_P(Simd, Reliability, ::testing::ValuesIn(available_simd_targets()),
                         [](const auto& test) { return std::string(name_of(test.param)); });

}  // namespace
}  // namespace spartan::internal::matching
