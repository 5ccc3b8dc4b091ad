#include "spartan/reconstruction/disparity_merger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/height_field_view.h"
#include "spartan/testing/text_checks.h"

namespace spartan {
namespace {

using Height = std::function<double(double, double)>;

// A third of the resolution of the paper's wide pair, at three pan angles.
const RectifiedStereo kWide{{373, 373}, 400, {186, 186}, 0.2};

struct Stop {
  std::vector<ViewGeometry> geometries;
  std::vector<Image<float>> disparities;
  std::vector<Image<std::uint8_t>> grays;

  void add(const RectifiedStereo& g, const Pose& body_from_left, const Height& height) {
    geometries.push_back({g, body_from_left});
    disparities.push_back(testing::disparity_of(height, g, body_from_left));
    grays.emplace_back(g.size.width, g.size.height, static_cast<std::uint8_t>(50 * disparities.size()));
  }
  std::vector<MergedView> views() const {
    std::vector<MergedView> views;
    for (std::size_t i = 0; i < geometries.size(); ++i)
      views.push_back({geometries[i], disparities[i], {}, grays[i], {}});
    return views;
  }
  MergedRange merge(const MergingOptions& options = {}, int threads = 2) const {
    const auto merger =
        DisparityMerger::create(options, Pose::from_translation({0, 0, 1}), geometries, 0.8, ThreadPool(threads))
            .value();
    return merger.merge(views());
  }
};

Stop three_pans(const Height& height) {
  Stop stop;
  for (const double pan : {0.6, 0.0, -0.6})
    stop.add(kWide, testing::camera_pose_at(1, pan, 0.68, optical_from_forward()), height);
  return stop;
}

// Cells larger than the views' pixels: there are no gaps to interpolate.
MergingOptions coarse() {
  MergingOptions options;
  options.pixels_per_degree = 2;
  return options;
}

int known(const Image<float>& image) {
  int count = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) count += std::isfinite(image(x, y)) ? 1 : 0;
  }
  return count;
}

// Which cells are truncated follows from where the views look, not from where disparities are known.
TEST(DisparityMerger, CellsAtTheUpperBorderOfTheViewsAreTruncated) {
  Stop stop = three_pans([](double, double) { return 0.0; });
  const MergedRange whole = stop.merge();
  int truncated = 0, cells = 0;
  for (int y = 0; y < whole.range_m.height(); ++y) {
    for (int x = 0; x < whole.range_m.width(); ++x) {
      if (!std::isfinite(whole.range_m(x, y))) continue;
      ++cells;
      truncated += whole.truncated(x, y) != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(truncated, 0);
  EXPECT_LT(truncated, cells / 20);
  // Nothing is matched in the upper half of the middle view: what is left there is not at the border.
  for (int v = 0; v < kWide.size.height / 2; ++v) {
    for (int u = 0; u < kWide.size.width; ++u) stop.disparities[1](u, v) = std::numeric_limits<float>::quiet_NaN();
  }
  const MergedRange holes = stop.merge();
  for (int y = 0; y < holes.range_m.height(); ++y) {
    for (int x = 0; x < holes.range_m.width(); ++x) {
      if (std::isfinite(holes.range_m(x, y))) {
        EXPECT_EQ(holes.truncated(x, y), whole.truncated(x, y)) << x << ' ' << y;
      }
    }
  }
}

TEST(DisparityMerger, RangesMatchTheGroundAndCoverMoreThanAnyView) {
  const Stop stop = three_pans([](double x, double y) { return 0.05 * std::sin(2 * x) * std::cos(1.5 * y); });
  const MergedRange merged = stop.merge();
  double worst = 0;
  for (int y = 0; y < merged.range_m.height(); ++y) {
    for (int x = 0; x < merged.range_m.width(); ++x) {
      if (!std::isfinite(merged.range_m(x, y))) continue;
      const Eigen::Vector3d p =
          Eigen::Vector3d(0, 0, 1) + static_cast<double>(merged.range_m(x, y)) * merged.camera.direction(x, y);
      worst = std::max(worst, std::abs(p.z() - 0.05 * std::sin(2 * p.x()) * std::cos(1.5 * p.y())));
    }
  }
  EXPECT_LT(worst, 0.012) << "half a pixel of the virtual camera, on undulating ground";
  std::vector<int> alone;
  for (std::size_t i = 0; i < 3; ++i) {
    int count = 0;
    for (int y = 0; y < merged.views.height(); ++y) {
      for (int x = 0; x < merged.views.width(); ++x) count += (merged.views(x, y) >> i & 1) != 0 ? 1 : 0;
    }
    alone.push_back(count);
  }
  for (const int count : alone) EXPECT_GT(known(merged.range_m), 2 * count);
}

// Where two views agree, the variance is half of that of one view.
TEST(DisparityMerger, ViewsThatAgreeReduceTheVariance) {
  const Stop stop = three_pans([](double, double) { return 0; });
  const MergedRange merged = stop.merge(coarse());
  int both = 0;
  for (int y = 0; y < merged.views.height() / 2; ++y) {  // the lower half has gaps
    for (int x = 1; x < merged.views.width(); ++x) {
      if (merged.views(x, y) != 3 || merged.views(x - 1, y) != 1) continue;
      EXPECT_NEAR(merged.sigma_m(x, y) / merged.sigma_m(x - 1, y), std::sqrt(0.5), 0.08);
      EXPECT_NEAR(merged.gray(x, y), 75, 3) << "mean of two views with 50 and 100";
      ++both;
    }
  }
  EXPECT_GT(both, 30);
  int y = 0;
  const int x = merged.views.width() / 2;
  while (merged.views(x, y) != 2) ++y;
  EXPECT_NEAR(merged.sigma_m(x, y + 2), std::pow(merged.range_m(x, y + 2), 2) * 0.3 / 80,
              0.15 * merged.sigma_m(x, y + 2))
      << "z² σ / (f b)";
}

// Each of three views four times: the same surfaces with a quarter of the variance.
TEST(DisparityMerger, MergesAnyNumberOfViews) {
  Stop twelve;
  for (int i = 0; i < 4; ++i) {
    const Stop three = three_pans([](double, double) { return 0; });
    for (std::size_t k = 0; k < 3; ++k) {
      twelve.geometries.push_back(three.geometries[k]);
      twelve.disparities.push_back(three.disparities[k].clone());
      twelve.grays.push_back(three.grays[k].clone());
    }
  }
  const MergedRange few = three_pans([](double, double) { return 0; }).merge(coarse()), many = twelve.merge(coarse());
  ASSERT_EQ(few.range_m.size(), many.range_m.size());
  EXPECT_EQ(known(few.range_m), known(many.range_m));
  for (int y = 0; y < few.range_m.height(); ++y) {
    for (int x = 0; x < few.range_m.width(); ++x) {
      if (!std::isfinite(few.range_m(x, y))) continue;
      ASSERT_NEAR(many.range_m(x, y), few.range_m(x, y), 1e-5F * few.range_m(x, y));
      ASSERT_NEAR(many.sigma_m(x, y), few.sigma_m(x, y) / 2, 1e-4F * few.sigma_m(x, y));
      ASSERT_NEAR(many.gray(x, y), few.gray(x, y), 1);
      ASSERT_NE(many.views(x, y), 0);
    }
  }
}

TEST(DisparityMerger, ViewsBeyondTheEighthShareTheBitsOfTheFirst) {
  const Stop pans = three_pans([](double, double) { return 0; });
  Stop ten;
  for (int i = 0; i < 10; ++i) {
    const std::size_t k = i < 8 ? 0 : 2;
    ten.geometries.push_back(pans.geometries[k]);
    ten.disparities.push_back(pans.disparities[k].clone());
    ten.grays.push_back(pans.grays[k].clone());
  }
  const MergedRange merged = ten.merge(coarse());
  int left = 0, right = 0, both = 0;
  for (int y = 0; y < merged.views.height(); ++y) {
    for (int x = 0; x < merged.views.width(); ++x) {
      left += merged.views(x, y) == 0xFF && x < merged.views.width() / 3 ? 1 : 0;
      right += merged.views(x, y) == 3 ? 1 : 0;
      both += merged.views(x, y) != 0 && merged.views(x, y) != 0xFF && merged.views(x, y) != 3 ? 1 : 0;
    }
  }
  EXPECT_GT(left, 100) << "views 0 to 7";
  EXPECT_GT(right, 100) << "views 8 and 9 have the bits 0 and 1";
  EXPECT_EQ(both, 0);
}

// A false surface that only the middle view sees: two other views, or one, see free space through it.
TEST(DisparityMerger, DiscardsASurfaceThatMoreViewsSeeThrough) {
  MergingOptions options = coarse();
  options.projection = PanoramicCamera::Projection::cylinder;  // has more cells at the feet
  Stop stop;
  for (const double pan : {0.3, 0.0, -0.3})
    stop.add(kWide, testing::camera_pose_at(1, pan, 0.68, optical_from_forward()), [](double, double) { return 0; });
  const MergedRange clean = stop.merge(options);
  for (int y = 180; y < 200; ++y) {
    for (int x = 0; x < 373; ++x) stop.disparities[1](x, y) *= 1.25F;
  }
  const MergedRange ghost = stop.merge(options);
  int dropped = 0, kept = 0, wrong = 0;
  for (int y = 0; y < clean.range_m.height() / 2; ++y) {
    for (int x = 0; x < clean.range_m.width(); ++x) {
      const bool nearer = ghost.range_m(x, y) < clean.range_m(x, y) - 0.05F;
      if (clean.views(x, y) == 7) {
        wrong += nearer ? 1 : 0;
        dropped += ghost.views(x, y) == 5 ? 1 : 0;
      } else if (clean.views(x, y) == 3 || clean.views(x, y) == 6) {
        kept += nearer ? 1 : 0;
      }
    }
  }
  EXPECT_GT(dropped, 100);
  EXPECT_LT(wrong, dropped / 20) << "only at the borders of views";
  EXPECT_GT(kept, 50) << "a tie keeps the nearer surface";
}

TEST(DisparityMerger, KeepsTheNearerSurfaceWhereNoViewSeesThroughIt) {
  const Height rock = [](double x, double y) { return std::hypot(x - 1.6, y) < 0.25 ? 0.3 : 0.0; };
  const Stop stop = three_pans(rock);
  const MergedRange merged = stop.merge();
  const auto pixel = merged.camera.project({1.5, 0, 0.2 - 1});
  const float range = merged.range_m(static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
  const Eigen::Vector3d p =
      Eigen::Vector3d(0, 0, 1) + static_cast<double>(range) * merged.camera.direction(pixel->x(), pixel->y());
  EXPECT_NEAR(std::hypot(p.x() - 1.6, p.y()), 0.25, 0.03);
  // Cells at the rock's edge have the range of the rock or of the ground behind it, never one in between.
  const MergedRange large_cells = stop.merge(coarse());
  for (int y = 0; y < large_cells.range_m.height(); ++y) {
    for (int x = 0; x < large_cells.range_m.width(); ++x) {
      if (!std::isfinite(large_cells.range_m(x, y))) continue;
      const Eigen::Vector3d q = Eigen::Vector3d(0, 0, 1) +
                                static_cast<double>(large_cells.range_m(x, y)) * large_cells.camera.direction(x, y);
      EXPECT_FALSE(q.z() > 0.07 && std::hypot(q.x() - 1.6, q.y()) > 0.33) << q.transpose();
    }
  }
}

TEST(DisparityMerger, ClassesComeFromTheViewWithTheMostPixels) {
  Stop stop = three_pans([](double, double) { return 0; });
  std::vector<MergedView> views = stop.views();
  Image<std::uint8_t> all_ground(373, 373, 1), all_rock(373, 373, 2);
  views[0].classes = all_ground;
  views[1].classes = all_rock;
  views[2].classes = all_ground;
  const auto merger =
      DisparityMerger::create({}, Pose::from_translation({0, 0, 1}), stop.geometries, 0.8, ThreadPool(1)).value();
  const MergedRange merged = merger.merge(views);
  for (int y = 0; y < merged.views.height(); ++y) {
    for (int x = 0; x < merged.views.width(); ++x) {
      if (merged.views(x, y) == 1 || merged.views(x, y) == 4) {
        EXPECT_EQ(merged.classes(x, y), 1);
      } else if (merged.views(x, y) == 2) {
        EXPECT_EQ(merged.classes(x, y), 2);
      } else if (merged.views(x, y) == 0) {
        EXPECT_EQ(merged.classes(x, y), 0);
      }
    }
  }
}

TEST(DisparityMerger, IsDeterministicForAnyNumberOfThreadsAndSkipsEmptyViews) {
  Stop stop = three_pans([](double x, double y) { return 0.1 * std::sin(3 * x + y); });
  const MergedRange one = stop.merge({}, 1), two = stop.merge({}, 2);
  for (int y = 0; y < one.range_m.height(); ++y) {
    for (int x = 0; x < one.range_m.width(); ++x) {
      EXPECT_EQ(std::bit_cast<std::uint32_t>(one.range_m(x, y)), std::bit_cast<std::uint32_t>(two.range_m(x, y)));
    }
  }
  std::vector<MergedView> views = stop.views();
  views[1].disparity = {};
  const auto merger =
      DisparityMerger::create({}, Pose::from_translation({0, 0, 1}), stop.geometries, 0.8, ThreadPool(1)).value();
  const MergedRange without = merger.merge(views);
  EXPECT_LT(known(without.range_m), known(one.range_m));
  for (int y = 0; y < without.views.height(); ++y) {
    for (int x = 0; x < without.views.width(); ++x) EXPECT_EQ(without.views(x, y) & 2, 0);
  }
}

TEST(DisparityMerger, RefusesOptionsOutOfBounds) {
  MergingOptions options;
  options.max_range_m = 0;
  EXPECT_THAT(testing::error_message(DisparityMerger::create(options, Pose(), {}, 0.8, ThreadPool(1))),
              ::testing::HasSubstr("merging options: max_range_m is 0"));
}

}  // namespace
}  // namespace spartan
