#include "spartan/reconstruction/stop_mapper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "spartan/rig/rig.h"
#include "spartan/testing/height_field_view.h"
#include "spartan/testing/synthetic_world.h"
#include "spartan/testing/text_checks.h"

namespace spartan {
namespace {

const RectifiedStereo kStopPair{{320, 320}, 340, {159.5, 159.5}, 0.2};
const RectifiedStereo kNarrow{{240, 180}, 190, {119.5, 89.5}, 0.1};
constexpr double kNearest_m = 0.5;

testing::SyntheticWorldOptions gentle_ground() {
  testing::SyntheticWorldOptions options;
  options.relief_m = 0.02;
  options.relief_size_m = 1.5;
  return options;
}

// A stop in the synthetic world: the wide pair panned to each side, and a view of the narrow pair straight ahead.
struct Views {
  Views() {
    add("narrow", kNarrow, testing::camera_pose_at(0.4, 0, 0.55, optical_from_forward()));
    add("wide", kStopPair, testing::camera_pose_at(1, 0.35, 0.68, optical_from_forward()));
    add("wide", kStopPair, testing::camera_pose_at(1, -0.35, 0.68, optical_from_forward()));
  }
  void add(const std::string& name, const RectifiedStereo& stereo, const Pose& body_from_left) {
    frames.push_back(world.render(stereo, body_from_left, frames.size()));
    RectifiedPair pair;
    pair.pair = name;
    pair.stamp.ns = static_cast<std::int64_t>(pairs.size());
    pair.geometry = stereo;
    pair.body_from_left = body_from_left;
    pairs.push_back(pair);
  }
  RectifiedPair pair(std::size_t i) const {
    RectifiedPair pair = pairs[i];
    pair.left = frames[i].left;
    pair.right = frames[i].right;
    return pair;
  }
  testing::SyntheticWorld world{gentle_ground()};
  std::vector<testing::SyntheticFrame> frames;
  std::vector<RectifiedPair> pairs;
};

const Views& views() {
  static const Views made;
  return made;
}

int known_cells(const LocalMap& map) {
  int count = 0;
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) count += map.count(x, y) > 0 ? 1 : 0;
  }
  return count;
}

TEST(StopMapper, MapsTheGroundAroundAStop) {
  StopMapper mapper = StopMapper::create({}, {}, ThreadPool(2)).value();
  std::vector<int> cells;
  for (std::size_t i = 0; i < views().pairs.size(); ++i) {
    ASSERT_TRUE(mapper.add(views().pair(i), kNearest_m));
    EXPECT_TRUE(mapper.views().back().ground.has_value());
  }
  const MergedRange merged = mapper.merge();
  // Midpoint of the wide pair, which does not rotate about its midpoint: 1 m high, near the mast's axis.
  EXPECT_NEAR(merged.body_from_centre.translation().z(), 1, 1e-9);
  EXPECT_LT(merged.body_from_centre.translation().head<2>().norm(), 0.11);
  const LocalMap map = mapper.map(surface_points(merged), Pose());
  double squares = 0, worst = 0;
  int count = 0;
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) {
      const Eigen::Vector2d at = cell_centre(map.place, x, y);
      if (!(map.count(x, y) > 0) || at.norm() > 3) continue;
      const double error = map.elevation_m(x, y) - views().world.relief(at.x(), at.y());
      squares += error * error;
      worst = std::max(worst, std::abs(error));
      ++count;
    }
  }
  EXPECT_GT(count, 1500);
  EXPECT_LT(std::sqrt(squares / count), 0.015);
  for (std::size_t i = 0; i < views().pairs.size(); ++i) {
    StopMapper alone = StopMapper::create({}, {}, ThreadPool(2)).value();
    ASSERT_TRUE(alone.add(views().pair(i), kNearest_m));
    EXPECT_GT(known_cells(map), 1.3 * known_cells(alone.map(surface_points(alone.merge()), Pose())));
  }
}

TEST(StopMapper, DiscardsTheViewsOfThePreviousStop) {
  StopMapper mapper = StopMapper::create({}, {}, ThreadPool(1)).value();
  ASSERT_TRUE(mapper.add(views().pair(1), kNearest_m));
  mapper.leave();
  EXPECT_TRUE(mapper.views().empty());
  ASSERT_TRUE(mapper.add(views().pair(0), kNearest_m));
  EXPECT_NEAR(mapper.merge().body_from_centre.translation().z(), 0.4, 1e-9) << "only the narrow pair is left";
}

TEST(StopMapper, RejectsImagesOfDifferentSizes) {
  StopMapper mapper = StopMapper::create({}, {}, ThreadPool(1)).value();
  RectifiedPair pair = views().pair(0);
  pair.right = views().pair(1).right;
  const Status refused = mapper.add(pair, kNearest_m);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::frame_rejected);
  EXPECT_TRUE(mapper.views().empty());
}

TEST(StopMapper, RefusesOptionsOutOfBounds) {
  MappingOptions mapping;
  mapping.map.cell_m = 0;
  EXPECT_THAT(testing::error_message(StopMapper::create({}, mapping, ThreadPool(1))),
              ::testing::HasSubstr("mapping options: map.cell_m is 0"));
  DisparityOptions disparity;
  disparity.p1 = 61;
  EXPECT_THAT(testing::error_message(StopMapper::create(disparity, {}, ThreadPool(1))),
              ::testing::HasSubstr("disparity options: p1 is 61"));
}

}  // namespace
}  // namespace spartan
