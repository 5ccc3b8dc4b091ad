#include "spartan/odometry/internal/detection/feature_spread.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

// Strong features are clustered in one corner, weak ones lie everywhere.
std::vector<Feature> clustered_features() {
  std::vector<Feature> features;
  Random random(3);
  for (int i = 0; i < 4000; ++i) {
    Feature f;
    const bool strong = i % 2 == 0;
    f.x = static_cast<float>(random.uniform(0, strong ? 100 : 639));
    f.y = static_cast<float>(random.uniform(0, strong ? 100 : 479));
    f.strength = static_cast<float>(strong ? random.uniform(10, 20) : random.uniform(1, 2));
    features.push_back(f);
  }
  return features;
}

TEST(FeatureSpread, CoversTheImageAndKeepsTheSpacing) {
  const std::vector<Feature> kept = spread_features(clustered_features(), {640, 480}, 300, 5);
  ASSERT_EQ(kept.size(), 300u);
  int quarter[4] = {};
  for (const Feature& f : kept) ++quarter[(f.x > 320 ? 1 : 0) + (f.y > 240 ? 2 : 0)];
  for (const int count : quarter) EXPECT_GT(count, 50);
  for (std::size_t i = 0; i < kept.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_GE(std::hypot(kept[i].x - kept[j].x, kept[i].y - kept[j].y), 5);
}

TEST(FeatureSpread, IsIndependentOfTheInputOrder) {
  std::vector<Feature> features = clustered_features();
  const std::vector<Feature> a = spread_features(features, {640, 480}, 300, 5);
  std::reverse(features.begin(), features.end());
  const std::vector<Feature> b = spread_features(features, {640, 480}, 300, 5);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].x, b[i].x);
}

TEST(FeatureSpread, KeepsAllWhereThereAreFew) {
  std::vector<Feature> features(3);
  features[1].x = 50;
  features[2].y = 50;
  EXPECT_EQ(spread_features(features, {100, 100}, 300, 5).size(), 3u);
  EXPECT_TRUE(spread_features({}, {100, 100}, 300, 5).empty());
}

}  // namespace
}  // namespace spartan::internal
