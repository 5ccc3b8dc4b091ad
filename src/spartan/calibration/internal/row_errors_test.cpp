#include "spartan/calibration/internal/row_errors.h"

#include <gtest/gtest.h>

#include <cmath>

namespace spartan::internal {
namespace {

TEST(RowErrors, MeanAndPercentileOfAbsoluteValuesSignedMedian) {
  std::vector<double> errors;
  for (int i = 1; i <= 100; ++i) errors.push_back(i <= 60 ? -0.01 * i : 0.01 * i);
  const RowErrors rows = row_errors(errors);
  EXPECT_NEAR(rows.mean_px, 0.505, 1e-12);
  EXPECT_NEAR(rows.p95_px, 0.96, 1e-12);
  EXPECT_NEAR(rows.median_px, -0.10, 0.011);
  errors.push_back(std::nan(""));
  EXPECT_EQ(row_errors(errors).p95_px, rows.p95_px) << "NaN is ignored";
  EXPECT_TRUE(std::isnan(row_errors({}).mean_px));
}

TEST(RowErrors, MapsMediansOverTheImage) {
  std::vector<PixelMatch> matches;
  std::vector<double> errors;
  const auto add = [&](double x, double y, double error) {
    matches.push_back({{x, y}, {x, y}});
    errors.push_back(error);
  };
  for (const double error : {1.0, 2.0, 9.0}) add(5, 5, error);         // first cell
  for (const double error : {-3.0, -3.0, -3.0}) add(799, 599, error);  // last cell
  for (const double error : {7.0, 7.0}) add(400, 300, error);          // too few matches
  const auto map = map_row_errors(matches, errors, {800, 600});
  ASSERT_EQ(map.size(), 2u);
  EXPECT_EQ(map[0].median_px, 2);
  EXPECT_EQ(map[0].matches, 3);
  EXPECT_EQ(map[0].centre_px, Eigen::Vector2d(50, 50));
  EXPECT_EQ(map[1].median_px, -3);
  EXPECT_EQ(map[1].centre_px, Eigen::Vector2d(750, 550));
  EXPECT_TRUE(map_row_errors(matches, errors, {}).empty());
}

}  // namespace
}  // namespace spartan::internal
