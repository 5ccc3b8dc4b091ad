#include "spartan/slam/global_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/slam/internal/synthetic_stop_test.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan {

using namespace internal;

namespace {

using testing::covariance_of;
using testing::Ground;
using testing::points_at;
using testing::pose_at;
using testing::pose_on_ground;
using testing::rocky_ground;
using testing::TemporaryFolder;

LocalMap map_of(const Ground& ground, const Pose& pose, std::uint64_t seed) {
  return MapGenerator::create({}, ThreadPool(1))->generate(points_at(ground, pose, seed), pose);
}

void add(GlobalMap& map, const Ground& ground, const Pose& pose, std::uint64_t seed,
         const Matrix6d& relative = Matrix6d::Zero()) {
  ASSERT_TRUE(
      map.add(map_of(ground, pose, seed), {static_cast<std::int64_t>(seed)}, {pose, Matrix6d::Zero()}, relative));
}

// Serializes a view.
Bytes bytes_of(const MapView& view) {
  ArchiveWriter out;
  const MapBands bands = view.bands({});
  for (const MapBand& band : bands.list) {
    for (int y = 0; y < band.values.height(); ++y)
      out.put_array(band.values.row(y), static_cast<std::size_t>(band.values.width()));
  }
  for (int y = 0; y < view.stop.height(); ++y)
    out.put_array(view.stop.row(y), static_cast<std::size_t>(view.stop.width()));
  return out.take();
}

Bytes all_of(GlobalMap& map) {
  return bytes_of(*map.view(map.extent()));
}

TEST(GlobalMap, ASubmapThatWasMovedIsFollowedByANewOne) {
  const Ground ground = rocky_ground();
  const Pose pose = pose_on_ground(ground, 0, 0, 0);
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  add(map, ground, pose, 1);
  add(map, ground, pose, 2);
  EXPECT_EQ(map.submaps().size(), 1U);
  map.move_submap(0, Pose(exp_so3({0, 0, 0.1}), {0.01, 0, 0}));
  add(map, ground, pose, 3);
  EXPECT_EQ(map.submaps().size(), 2U);
  EXPECT_TRUE(map.submaps().back().lattice_offset(0.05));
}

TEST(GlobalMap, AViewOfOneStopEqualsItsLocalMap) {
  const Ground ground = rocky_ground();
  const Pose pose = pose_on_ground(ground, -17.3, 9.1, 2.2);
  const LocalMap local = map_of(ground, pose, 1);
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  ASSERT_TRUE(map.add(local, {5}, {pose, Matrix6d::Zero()}, Matrix6d::Zero()));
  const MapView view = *map.view(window_of(local.place, local.size()));
  int known = 0;
  for (int r = 0; r < local.size().height; ++r) {
    for (int c = 0; c < local.size().width; ++c) {
      ASSERT_EQ(view.count(c, r), local.count(c, r));
      ASSERT_EQ(view.kind(c, r), local.kind(c, r));
      if (!(local.count(c, r) > 0)) {
        ASSERT_TRUE(std::isnan(view.elevation_m(c, r)));
        ASSERT_EQ(view.stop(c, r), -1);
        continue;
      }
      ++known;
      ASSERT_NEAR(view.elevation_m(c, r), local.elevation_m(c, r), 1e-6);
      ASSERT_NEAR(view.elevation_max_m(c, r), local.elevation_max_m(c, r), 1e-6);
      ASSERT_EQ(view.variance_m2(c, r), std::max(local.variance_m2(c, r), 4e-6F));
      ASSERT_EQ(view.stop(c, r), 0);
    }
  }
  EXPECT_GT(known, 3000);
  EXPECT_EQ(map.stops().at(0).stamp.ns, 5);
  EXPECT_EQ(view.bands({}).list.size(), local.bands().list.size());
}

TEST(GlobalMap, TraversabilityEqualsThatOfTheLocalMap) {
  const Ground ground = rocky_ground();
  const Pose pose = pose_on_ground(ground, -17.3, 9.1, 2.2);
  const LocalMap local = map_of(ground, pose, 1);
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  ASSERT_TRUE(map.add(local, {5}, {pose, Matrix6d::Zero()}, Matrix6d::Zero()));
  const MapView view = *map.view(window_of(local.place, local.size()));
  const Traversability shape = view.shape({}, ThreadPool(2));
  int known = 0, close = 0;
  for (int r = 0; r < local.size().height; ++r) {
    for (int c = 0; c < local.size().width; ++c) {
      ASSERT_EQ(std::isnan(shape.cost(c, r)), std::isnan(local.cost(c, r)));
      if (std::isnan(local.cost(c, r))) continue;
      ++known;
      ASSERT_NEAR(shape.slope_rad(c, r), local.slope_rad(c, r), 1e-4);
      ASSERT_NEAR(shape.step_m(c, r), local.step_m(c, r), 1e-5);
      ASSERT_NEAR(shape.roughness_m(c, r), local.roughness_m(c, r), 1e-4);
      close += std::abs(shape.cost(c, r) - local.cost(c, r)) < 0.1F ? 1 : 0;
    }
  }
  EXPECT_GT(known, 3000);
  EXPECT_GT(close, 0.95 * known) << "the ground surface beneath the stones is fitted again";
}

TEST(GlobalMap, RejectsViewsOfTooManyCells) {
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  EXPECT_EQ(map.view({0, 0, 2000, 4001}).error().code, ErrorCode::usage);
  EXPECT_TRUE(map.view({0, 0, 2000, 1}));
}

TEST(GlobalMap, PiecesAreDisjointAndCoverTheTilesOnly) {
  const Ground ground = rocky_ground();
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  EXPECT_TRUE(map.pieces(64).empty());
  add(map, ground, pose_on_ground(ground, 0, 0, 0), 1);
  add(map, ground, pose_on_ground(ground, 400, -300, 1), 2);
  const LatticeWindow all = map.extent();
  std::int64_t cells = 0;
  for (const int side : {64, 1000}) {
    const std::vector<LatticeWindow> pieces = map.pieces(side);
    EXPECT_LE(pieces.size(), 2 * map.tiles()) << "the gap between the stops is not covered";
    for (const LatticeWindow& p : pieces) {
      EXPECT_TRUE(p.width <= side && p.height <= side);
      EXPECT_EQ(window_around(all, p), all) << "inside of the extent";
      EXPECT_EQ((p.west - all.west) % side, 0);
      EXPECT_EQ((all.north - p.north) % side, 0);
      cells += p.cells();
    }
  }
  EXPECT_LT(cells, all.cells() / 10);
}

TEST(GlobalMap, ElevationBetweenCellsIsBilinear) {
  const Ground plane = [](double x, double y) { return 0.1 * x - 0.2 * y; };
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  const Pose pose = pose_on_ground(plane, 3, 4, 0);
  ASSERT_TRUE(map.add(MapGenerator::create({}, ThreadPool(1))->generate(points_at(plane, pose, 1, 0), pose), {},
                      {pose, {}}, Matrix6d::Zero()));
  const auto sample = map.at(5.013, 4.111);
  ASSERT_TRUE(sample && *sample);
  EXPECT_NEAR((*sample)->elevation_m, 0.1 * 5.013 - 0.2 * 4.111, 0.003);
  EXPECT_EQ((*sample)->kind, GroundClass::ground);
  EXPECT_FALSE(map.at(1, 4)->has_value()) << "nothing is observed behind the rover";
}

TEST(GlobalMap, ThePoseCovarianceInflatesTheVarianceOfSlopes) {
  const Ground plane = [](double x, double) { return 0.5 * x; };
  const Pose pose = pose_at(0, 0, 0, 0.8);
  Matrix6d relative = Matrix6d::Zero();
  relative.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() * 0.01;
  GlobalMap certain = GlobalMap::create({}, 0.05).value();
  GlobalMap uncertain = GlobalMap::create({}, 0.05).value();
  const LocalMap local = MapGenerator::create({}, ThreadPool(1))->generate(points_at(plane, pose, 1, 0), pose);
  ASSERT_TRUE(certain.add(local, {}, {pose, relative}, Matrix6d::Zero()));
  ASSERT_TRUE(uncertain.add(local, {}, {pose, relative}, relative));
  const double more = (*uncertain.at(1.5, 1.5))->variance_m2 - (*certain.at(1.5, 1.5))->variance_m2;
  EXPECT_NEAR(more, 0.01 * (0.25 + 1), 0.001);
}

TEST(GlobalMap, SubmapsFollowTheDriveAndShareTheLattice) {
  const Ground ground = rocky_ground();
  GlobalMapOptions options;
  options.submap_m = 2;
  GlobalMap small = GlobalMap::create(options, 0.05).value();
  GlobalMap one = GlobalMap::create({}, 0.05).value();
  for (int i = 0; i < 4; ++i) {
    const Pose pose = pose_on_ground(ground, 1.5 * i, 0.3 * i, 0.1 * i);
    add(small, ground, pose, static_cast<std::uint64_t>(i + 1));
    add(one, ground, pose, static_cast<std::uint64_t>(i + 1));
  }
  EXPECT_EQ(one.submaps().size(), 1U);
  EXPECT_EQ(small.submaps().size(), 2U);
  const MapView a = *one.view(one.extent()), b = *small.view(one.extent());
  int known = 0, different = 0;
  for (int r = 0; r < a.window.height; ++r) {
    for (int c = 0; c < a.window.width; ++c) {
      ASSERT_EQ(a.count(c, r) > 0, b.count(c, r) > 0);
      if (!(a.count(c, r) > 0)) continue;
      ++known;
      // Cells whose surface was replaced by its alternative may differ, because the order of fusion differs.
      different += std::abs(a.elevation_m(c, r) - b.elevation_m(c, r)) > 1e-5 ? 1 : 0;
    }
  }
  EXPECT_LT(different, known / 50);
}

TEST(GlobalMap, MovingAnAnchorMovesItsCells) {
  const Ground ground = rocky_ground();
  const Pose pose = pose_on_ground(ground, 0, 0, 0);
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  add(map, ground, pose, 1);
  const LatticeWindow window = map.extent();
  const MapView before = *map.view(window);
  const Pose anchor = map.submaps()[0].world_from_submap;
  map.move_submap(0, Pose::from_translation({0.25, -0.1, 0.5}) * anchor);
  const MapView after = *map.view({window.west + 5, window.north - 2, window.width, window.height});
  for (int r = 0; r < window.height; ++r) {
    for (int c = 0; c < window.width; ++c) {
      if (!(before.count(c, r) > 0)) continue;
      ASSERT_NEAR(after.elevation_m(c, r), before.elevation_m(c, r) + 0.5, 1e-5);
    }
  }
  // Rotated and off the lattice: interpolated.
  const Ground plane = [](double x, double y) { return 0.1 * x + 0.05 * y; };
  GlobalMap level = GlobalMap::create({}, 0.05).value();
  ASSERT_TRUE(level.add(MapGenerator::create({}, ThreadPool(1))->generate(points_at(plane, Pose(), 1, 0), Pose()), {},
                        {}, Matrix6d::Zero()));
  const Pose motion = Pose(exp_so3({0.02, 0.03, 0.4}), {0.013, 0.02, 0.1});
  level.move_submap(0, motion * level.submaps()[0].world_from_submap);
  const Eigen::Vector3d from(2, 0.4, plane(2, 0.4)), to = motion * from;
  EXPECT_NEAR((*level.at(to.x(), to.y()))->elevation_m, to.z(), 0.003);
}

TEST(GlobalMap, MergedMapsContainBoth) {
  const Ground ground = rocky_ground();
  const Pose a = pose_on_ground(ground, 0, 0, 0), b = pose_on_ground(ground, 2, 0.5, 0.2);
  GlobalMap first = GlobalMap::create({}, 0.05).value();
  GlobalMap second = GlobalMap::create({}, 0.05).value();
  GlobalMap different = GlobalMap::create({}, 0.05).value();
  add(first, ground, a, 1);
  add(second, ground, b, 2);
  GlobalMapOptions two;
  two.submap_m = 1;
  GlobalMap both = GlobalMap::create(two, 0.05).value();
  add(both, ground, a, 1);
  add(both, ground, b, 2);
  ASSERT_TRUE(first.merge(second));
  EXPECT_EQ(first.stops().size(), 2U);
  EXPECT_EQ(first.stops()[1].id, 1);
  EXPECT_EQ(bytes_of(*first.view(both.extent())), all_of(both));
  ASSERT_TRUE(first.merge(second)) << "its stop is known already";
  EXPECT_EQ(first.stops().size(), 2U);
  EXPECT_EQ(bytes_of(*first.view(both.extent())), all_of(both));
  const auto partly = second.merge(first);
  ASSERT_FALSE(partly);
  EXPECT_EQ(partly.error().code, ErrorCode::usage);
  GlobalMap coarse = GlobalMap::create({}, 0.1).value();
  EXPECT_FALSE(first.merge(coarse));
}

TEST(GlobalMap, ResultsDoNotDependOnTheMemoryLimit) {
  const Ground ground = rocky_ground();
  const TemporaryFolder folder;
  Bytes views[2], stored[2];
  std::size_t most_in_memory[2]{};
  for (const int tiny : {0, 1}) {
    GlobalMapOptions options;
    options.memory_mb = tiny == 1 ? 1 : 256;
    options.submap_m = 3;
    const std::string path = folder.file(tiny == 1 ? "tiny" : "large");
    Database db = *Database::open(path, Database::Mode::create);
    TileStore store = *TileStore::open(db);
    GlobalMap map = GlobalMap::create(options, 0.05).value();
    map.page_to(&store);
    for (int i = 0; i < 6; ++i) {
      add(map, ground, pose_on_ground(ground, 1.5 * i, 0, 0.2 * i), static_cast<std::uint64_t>(i + 1));
      ASSERT_TRUE(db.execute("BEGIN IMMEDIATE"));
      ASSERT_TRUE(map.flush());
      ASSERT_TRUE(db.execute("COMMIT"));
      most_in_memory[tiny] = std::max(most_in_memory[tiny], map.tiles_in_memory());
    }
    views[tiny] = all_of(map);
    ArchiveWriter out;
    const auto index = store.index();
    for (const TileStore::Entry& entry : *index) {
      out.put(entry.revision);
      const Bytes tile = to_bytes(*store.read(entry));
      out.put_array(tile.data(), tile.size());
    }
    stored[tiny] = out.take();
  }
  EXPECT_LE(most_in_memory[1], 15U);
  EXPECT_GT(most_in_memory[0], 30U);
  EXPECT_EQ(views[0], views[1]);
  EXPECT_EQ(stored[0], stored[1]);
}

TEST(GlobalMap, SavingAndLoadingDoesNotChangeTheResult) {
  const Ground ground = rocky_ground();
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  const Pose a = pose_on_ground(ground, 0, 0, 0), b = pose_on_ground(ground, 1.5, 0, 0.1);
  GlobalMap uninterrupted = GlobalMap::create({}, 0.05).value();
  add(uninterrupted, ground, a, 1);
  ASSERT_TRUE(MapFile::save(uninterrupted, path));
  add(uninterrupted, ground, b, 2);
  {
    auto file = MapFile::open(path, {}, Database::Mode::open);
    ASSERT_TRUE(file) << file.error().message();
    add(file->map(), ground, b, 2);
    ASSERT_TRUE(file->commit());
  }
  auto again = MapFile::open(path, {}, Database::Mode::read_only);
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(again->map().stops().size(), 2U);
  EXPECT_EQ(all_of(again->map()), all_of(uninterrupted));

  EXPECT_EQ(MapFile::open(folder.file("none"), {}, Database::Mode::open).error().code, ErrorCode::input);
  EXPECT_EQ(MapFile::open(folder.write("text", "no map"), {}, Database::Mode::open).error().code,
            ErrorCode::store_damaged);
  Database db = *Database::open(path, Database::Mode::open);
  ASSERT_TRUE(db.execute("PRAGMA user_version = 99"));
  EXPECT_EQ(MapFile::open(path, {}, Database::Mode::open).error().code, ErrorCode::configuration);
}

TEST(GlobalMap, RejectsAStoreOfAnotherCellSize) {
  const TemporaryFolder folder;
  Database db = *Database::open(folder.file("map.sqlite"), Database::Mode::create);
  TileStore store = *TileStore::open(db);
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  map.page_to(&store);
  add(map, rocky_ground(), Pose(), 1);
  ASSERT_TRUE(map.flush());
  EXPECT_EQ(GlobalMap::from_store({}, 0.1, store).error().code, ErrorCode::configuration);
}

// Maps of single cells with random elevations.
RC_GTEST_PROP(GlobalMap, ObservationsNeverRaiseAVarianceAndUnobservedCellsAreNeverFree, ()) {
  GlobalMapOptions options;
  options.submap_m = 1e4;
  GlobalMap map = GlobalMap::create(options, 0.05).value();
  Image<float> before(8, 8, INFINITY);
  for (int i = *rc::gen::inRange(1, 6); i > 0; --i) {
    LocalMap local;
    local.place = {0, 0.4, 0.05};
    for (Image<float>* layer : {&local.elevation_m, &local.elevation_min_m, &local.elevation_max_m, &local.variance_m2,
                                &local.count, &local.occupancy_logodds})
      *layer = Image<float>(8, 8, 0.0F);
    local.kind = Image<GroundClass>(8, 8);
    for (int k = 0; k < 8; ++k) {
      const int x = *rc::gen::inRange(0, 8), y = *rc::gen::inRange(0, 8);
      local.elevation_m(x, y) = local.elevation_min_m(x, y) = local.elevation_max_m(x, y) =
          0.01F * static_cast<float>(*rc::gen::inRange(-9, 9));
      local.variance_m2(x, y) = 1e-5F * static_cast<float>(*rc::gen::inRange(1, 99));
      local.count(x, y) = 2;
      local.kind(x, y) = GroundClass::ground;
      local.occupancy_logodds(x, y) = -1;
    }
    RC_ASSERT(map.add(local, {}, {}, covariance_of(0.01, 0.01)).has_value());
    const MapView view = *map.view({0, 8, 8, 8});
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) {
        RC_ASSERT((view.count(x, y) > 0) == (view.kind(x, y) != GroundClass::unknown));
        RC_ASSERT(view.count(x, y) > 0 || before(x, y) == INFINITY);
        if (!(view.count(x, y) > 0)) continue;
        RC_ASSERT(view.variance_m2(x, y) <= before(x, y));
        before(x, y) = view.variance_m2(x, y);
      }
    }
  }
}

TEST(GlobalMap, ACellThatIsNotFiniteDoesNotEnterIt) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Ground ground = rocky_ground();
  const Pose pose = pose_on_ground(ground, 0, 0, 0);
  LocalMap local = map_of(ground, pose, 1);
  const GridCell no_class = cell_at(local.place, 2.02, 0.02), no_variance = cell_at(local.place, 2.02, 0.52);
  ASSERT_GT(local.count(no_class.column, no_class.row), 0);
  ASSERT_GT(local.count(no_variance.column, no_variance.row), 0);
  local.occupancy_logodds(no_class.column, no_class.row) = nan;
  local.variance_m2(no_variance.column, no_variance.row) = nan;
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  ASSERT_TRUE(map.add(local, {5}, {pose, Matrix6d::Zero()}, Matrix6d::Zero()));
  const MapView view = *map.view(window_of(local.place, local.size()));
  EXPECT_EQ(view.occupancy_logodds(no_class.column, no_class.row), 0);
  EXPECT_EQ(view.kind(no_class.column, no_class.row), GroundClass::unknown);
  EXPECT_EQ(view.count(no_variance.column, no_variance.row), 0);
}

TEST(GlobalMap, RefusesOptionsOutOfBounds) {
  GlobalMapOptions options;
  options.gate_sigmas = 0;
  EXPECT_THAT(testing::error_message(GlobalMap::create(options, 0.05)),
              ::testing::HasSubstr("global map options: gate_sigmas is 0"));
  EXPECT_EQ(testing::error_message(GlobalMap::create({}, 0)), "the cell size is 0 m and must be positive");
}

}  // namespace
}  // namespace spartan
