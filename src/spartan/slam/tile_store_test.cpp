#include "spartan/slam/tile_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

Tile some_tile(float elevation) {
  Tile tile;
  for (int i = 0; i < 40; ++i) {
    CellSurface& s = tile.at(i % 32, 3 * (i / 7)).surface;
    s.elevation_m = elevation + static_cast<float>(i);
    s.variance_m2 = 1e-5F;
    s.common_variance_m2 = 0.4e-5F;
    s.count = 3;
    s.stop = i;
  }
  tile.at(5, 0).alternative = tile.at(0, 0).surface;
  return tile;
}

Database make(const std::string& path) {
  return *Database::open(path, Database::Mode::create);
}

RC_GTEST_PROP(Tile, SerializationIsLossless, ()) {
  Tile tile;
  for (int i = *rc::gen::inRange(0, 200); i > 0; --i) {
    MapCell& cell = tile.at(*rc::gen::inRange(0, Tile::kSide), *rc::gen::inRange(0, Tile::kSide));
    for (CellSurface* s : {&cell.surface, &cell.alternative}) {
      s->elevation_m = static_cast<float>(*rc::gen::arbitrary<std::int16_t>());
      s->variance_m2 = 0.25F;
      s->count = static_cast<float>(s == &cell.surface ? 1 : *rc::gen::inRange(0, 2));
      if (!s->observed()) *s = {};
      s->shape = s->observed() ? *rc::gen::arbitrary<std::int16_t>() : std::int16_t{0};
    }
  }
  const auto again = tile_from_bytes(to_bytes(tile), "tile");
  RC_ASSERT(again.has_value());
  RC_ASSERT(*again == tile);
}

TEST(Tile, RejectsTruncatedBytesAndOtherVersions) {
  Bytes bytes = to_bytes(some_tile(1));
  Bytes cut(bytes.begin(), bytes.end() - 1);
  EXPECT_THAT(tile_from_bytes(cut, "tile 7").error().message(), HasSubstr("tile 7"));
  bytes[0] = 9;
  EXPECT_THAT(tile_from_bytes(bytes, "tile 7").error().message(), HasSubstr("version 9"));
}

TEST(TileStore, ReadsWhatWasWritten) {
  const TemporaryFolder folder;
  Database db = make(folder.file("map.sqlite"));
  auto store = TileStore::open(db);
  ASSERT_TRUE(store);
  ASSERT_TRUE(store->write({{0, -1, 4}, 1}, some_tile(1)));
  ASSERT_TRUE(store->write({{0, -1, 4}, 2}, some_tile(2)));
  ASSERT_TRUE(store->write({{1, 0, 0}, 1}, some_tile(3)));
  const auto index = store->index();
  ASSERT_TRUE(index);
  ASSERT_EQ(index->size(), 2U) << "only the newest revision is kept";
  EXPECT_EQ((*index)[0].revision, 2);
  EXPECT_EQ(*store->read((*index)[0]), some_tile(2));
  EXPECT_EQ(*store->read((*index)[1]), some_tile(3));
  EXPECT_THAT(store->read({{5, 0, 0}, 1}).error().message(), HasSubstr("tile 0, 0 of submap 5, revision 1 is missing"));

  const Submap submap{3, Pose(Eigen::Quaterniond(0.8, 0, 0, 0.6), {1, 2, 3})};
  Matrix6d covariance = Matrix6d::Identity();
  covariance(0, 5) = 0.25;
  ASSERT_TRUE(store->write(submap));
  ASSERT_TRUE(store->write(MapStop{4, {12345678901}, {submap.world_from_submap, covariance}}));
  ASSERT_TRUE(store->write_property("cell_m", 0.05));
  const auto submaps = store->submaps();
  ASSERT_TRUE(submaps);
  EXPECT_EQ((*submaps)[0].world_from_submap.matrix(), submap.world_from_submap.matrix());
  const auto stops = store->stops();
  ASSERT_TRUE(stops);
  EXPECT_EQ((*stops)[0].stamp.ns, 12345678901);
  EXPECT_EQ((*stops)[0].world_from_body.covariance, covariance);
  EXPECT_EQ(*store->property("cell_m"), 0.05);
  EXPECT_FALSE(store->property("none")->has_value());
}

// Version 1 of a tile has no common variance.
TEST(TileStore, ReadsTilesOfVersion1) {
  ArchiveWriter out;
  out.put(std::uint32_t{1});
  out.put(std::uint32_t{1});
  out.put(std::uint16_t{33});
  out.put(false);
  for (const float value : {1.5F, 0.25F, 1.4F, 1.6F, 7.0F, -2.0F}) out.put(value);
  out.put(std::int32_t{3});
  out.put(std::int16_t{0});
  out.put(std::uint16_t{2});
  const auto tile = tile_from_bytes(out.take(), "tile");
  ASSERT_TRUE(tile) << tile.error().message();
  const CellSurface& surface = tile->at(1, 1).surface;
  EXPECT_EQ(surface.elevation_m, 1.5F);
  EXPECT_EQ(surface.variance_m2, 0.25F);
  EXPECT_EQ(surface.common_variance_m2, 0);
  EXPECT_EQ(surface.highest_m, 1.6F);
  EXPECT_EQ(surface.votes, 2);
}

TEST(TileStore, ReportsDamageWithFileAndTile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  Database db = make(path);
  auto store = TileStore::open(db);
  ASSERT_TRUE(store->write({{0, 2, 3}, 1}, some_tile(1)));
  ASSERT_TRUE(db.execute("UPDATE map_tiles SET cells = zeroblob(length(cells))"));
  const auto tile = store->read({{0, 2, 3}, 1});
  ASSERT_FALSE(tile);
  EXPECT_EQ(tile.error().code, ErrorCode::store_damaged);
  EXPECT_THAT(tile.error().message(), HasSubstr(path));
  EXPECT_THAT(tile.error().message(), HasSubstr("tile 2, 3 of submap 0, revision 1 is damaged"));
  // The right bytes under a wrong key are damage as well.
  ASSERT_TRUE(store->write({{0, 2, 3}, 2}, some_tile(1)));
  ASSERT_TRUE(db.execute("UPDATE map_tiles SET ix = 7"));
  EXPECT_THAT(store->read({{0, 7, 3}, 2}).error().message(), HasSubstr("checksum"));
}

TEST(TileStore, AKilledWriterLeavesTheLastCommittedState) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    Database db = make(path);
    auto store = TileStore::open(db);
    static_cast<void>(db.execute("BEGIN IMMEDIATE"));
    static_cast<void>(store->write({{0, 0, 0}, 1}, some_tile(1)));
    static_cast<void>(db.execute("COMMIT; BEGIN IMMEDIATE"));
    static_cast<void>(store->write({{0, 0, 0}, 2}, some_tile(2)));
    static_cast<void>(store->write({{0, 1, 0}, 1}, some_tile(3)));
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  Database db = *Database::open(path, Database::Mode::open);
  auto store = TileStore::open(db);
  const auto index = store->index();
  ASSERT_EQ(index->size(), 1U);
  EXPECT_EQ(*store->read((*index)[0]), some_tile(1));
}

int version_of(Database& db) {
  auto statement = db.prepare("PRAGMA user_version");
  static_cast<void>(statement->step());
  return static_cast<int>(statement->integer(0));
}

TEST(Migration, RunsMissingStepsInOrder) {
  const TemporaryFolder folder;
  Database db = make(folder.file("map.sqlite"));
  const std::vector<MapMigration> steps{
      {1, "CREATE TABLE a (x INTEGER)"}, {2, "INSERT INTO a VALUES (1)"}, {3, "UPDATE a SET x = x + 1"}};
  ASSERT_TRUE(migrate(db, {steps[0]}));
  EXPECT_EQ(version_of(db), 1);
  ASSERT_TRUE(migrate(db, steps));
  ASSERT_TRUE(migrate(db, steps)) << "no step is run twice";
  EXPECT_EQ(version_of(db), 3);
  auto select = db.prepare("SELECT x FROM a");
  ASSERT_TRUE(*select->step());
  EXPECT_EQ(select->integer(0), 2);
  EXPECT_THAT(migrate(db, {steps[0]}).error().message(),
              HasSubstr("has version 3, this program supports up to version 1"));
}

TEST(Migration, AFailingStepChangesNothing) {
  const TemporaryFolder folder;
  Database db = make(folder.file("map.sqlite"));
  EXPECT_FALSE(migrate(db, {{1, "CREATE TABLE a (x INTEGER); INSERT INTO nothing VALUES (1)"}}));
  EXPECT_EQ(version_of(db), 0);
  EXPECT_TRUE(db.execute("CREATE TABLE a (x INTEGER)")) << "the table of the failed step was rolled back";
}

}  // namespace
}  // namespace spartan
