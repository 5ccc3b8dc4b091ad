// Run stores that something else has changed: an error names the table, whoever reads or writes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <string>
#include <vector>

#include "spartan/system/run_store.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const RunIdentity kStored{"0123", "terrain:\n  every_m: 5\n", "schema: 1\n"};

RunStore::Step full_step(int i) {
  const UncertainPose pose{exp_se3(Vector6d::Constant(0.1 * (i + 1))), 1e-4 * Matrix6d::Identity()};
  RunStore::Step step;
  FrameRecord& frame = step.frame.emplace();
  frame.frame_id = i;
  frame.pair = "narrow";
  frame.stamp.ns = 1'000'000'000LL * (i + 1);
  frame.status = "tracking";
  frame.has_pose = true;
  frame.world_from_body = pose;
  frame.motion.to = frame.stamp;
  frame.times = {{"odometry", 3.0, 3.0}};
  frame.slam = pose;
  LocalizationRecord& localization = frame.localization.emplace();
  localization.world_from_body = localization.odom_from_body = pose;
  localization.sensors = {{"vision", "ok", "", InnovationTest{frame.stamp, 3, 22}}};
  frame.latency_ms = 20;
  step.terrain = TerrainRecord{frame.stamp, "narrow", 91.5, 1234};
  MapRecord& map = step.map.emplace();
  map.stamp = frame.stamp;
  map.world_from_body = map.prior = pose;
  map.status = "decided";
  return step;
}

Status commit_step(RunStore& store, int i) {
  return store.commit({full_step(i)}, RunStore::Checkpoint{{1, 2, 3}, {i + 1, 7}});
}

// The first error that reading everything gives.
Status read_all(RunStore& store) {
  if (const auto frames = store.frames(); !frames) return failure(frames);
  if (const auto maps = store.maps(); !maps) return failure(maps);
  if (const auto terrain = store.terrain(); !terrain) return failure(terrain);
  if (const auto checkpoint = store.checkpoint(); !checkpoint) return failure(checkpoint);
  return {};
}

class DamagedRunStore : public ::testing::Test {
 protected:
  void SetUp() override {
    auto store = RunStore::create(good_, kStored);
    ASSERT_TRUE(store) << store.error().message();
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(commit_step(*store, i));
  }
  // A copy of the good store.
  void renew() const {
    for (const char* more : {"", "-wal", "-shm"}) {
      fs::remove(path_ + more);
      if (fs::exists(good_ + more)) fs::copy_file(good_ + more, path_ + more);
    }
  }
  void damage(const std::string& sql) const {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql << ": " << sqlite3_errmsg(db);
    sqlite3_close(db);
  }

  testing::TemporaryFolder folder_;
  std::string good_ = folder_.path() + "/good.sqlite", path_ = folder_.path() + "/run.sqlite";
};

TEST_F(DamagedRunStore, IsNamedWithItsTable) {
  renew();
  auto good = RunStore::resume(path_, kStored);
  ASSERT_TRUE(good);
  ASSERT_TRUE(read_all(*good));
  const std::string far_ns = "4611686018427387905";
  for (const auto& [sql, message] : std::vector<std::pair<std::string, std::string>>{
           {"UPDATE frames SET covariance = x'00' WHERE seq = 2", "table 'frames': a pose"},
           {"UPDATE frames SET tx = 1e999", "table 'frames': a pose"},
           {"UPDATE frames SET qw = 2", "table 'frames': a pose"},
           {"UPDATE frames SET motion = x'00'", "table 'frames': a pose"},
           {"UPDATE frames SET motion_covariance = NULL", "table 'frames': a pose"},
           {"UPDATE frames SET stamp_ns = " + far_ns, "table 'frames'"},
           {"UPDATE frames SET motion_from_ns = -" + far_ns, "table 'frames'"},
           {"UPDATE slam SET pose = x'00'", "table 'slam': a pose"},
           {"UPDATE slam SET covariance = x'00'", "table 'slam': a pose"},
           {"UPDATE localization SET pose = x'00'", "table 'localization': a pose"},
           {"UPDATE localization SET odom_covariance = x'00'", "table 'localization': a pose"},
           {"UPDATE health SET state = 'fine'", "table 'health'"},
           {"UPDATE health SET seq = 4 - seq", "rows are not in the order of the frames"},
           {"UPDATE innovations SET nis = 1e999", "table 'innovations'"},
           {"UPDATE innovations SET nis = -1", "table 'innovations'"},
           {"UPDATE innovations SET gate = 0", "table 'innovations'"},
           {"UPDATE innovations SET seq = 4 - seq", "rows are not in the order of the frames"},
           {"UPDATE latencies SET wall_ms = -1", "table 'latencies'"},
           {"UPDATE stage_times SET seq = 4 - seq", "rows are not in the order of the frames"},
           {"UPDATE maps SET pose = x'00'", "table 'maps': a pose"},
           {"UPDATE maps SET believed_covariance = x'00'", "table 'maps': a pose"},
           {"UPDATE memory SET stages = x'00'", "table 'memory': the checksum differs"},
           {"UPDATE identity SET value = 'many' WHERE key = 'content'", "table 'identity': 'content'"},
           {"UPDATE identity SET value = '12 ' WHERE key = 'content'", "table 'identity': 'content'"},
           {"DELETE FROM identity WHERE key = 'content'", "table 'identity': 'content'"},
       }) {
    renew();
    damage(sql);
    auto store = RunStore::resume(path_, kStored);
    ASSERT_TRUE(store) << sql << ": " << store.error().message();
    const Status read = read_all(*store);
    ASSERT_FALSE(read) << sql;
    EXPECT_EQ(read.error().code, ErrorCode::store_damaged) << sql;
    EXPECT_THAT(read.error().message(), HasSubstr(message)) << sql;
    EXPECT_THAT(read.error().message(), HasSubstr(path_)) << sql;
  }
}

TEST_F(DamagedRunStore, RowsOfFramesThatAreNotThereAreLeftOut) {
  renew();
  damage("DELETE FROM frames WHERE seq = 2");
  auto store = RunStore::open_read_only(path_);
  ASSERT_TRUE(store);
  const auto frames = store->frames();
  ASSERT_TRUE(frames) << frames.error().message();
  ASSERT_EQ(frames->size(), 2U);
  EXPECT_EQ(frames->back().frame_id, 2);
  EXPECT_EQ(frames->back().times.size(), 1U) << "its own";
  EXPECT_EQ(frames->back().localization->sensors.size(), 1U);
}

TEST_F(DamagedRunStore, OlderVersionsHadNoInnovationsAndLatencies) {
  renew();
  damage("DROP TABLE innovations");
  damage("DROP TABLE latencies");
  {
    auto store = RunStore::open_read_only(path_);
    ASSERT_TRUE(store) << store.error().message();
    const auto frames = store->frames();
    ASSERT_TRUE(frames) << frames.error().message();
    EXPECT_FALSE(frames->back().latency_ms);
    EXPECT_FALSE(frames->back().localization->sensors[0].test);
  }
  auto store = RunStore::resume(path_, kStored);
  ASSERT_TRUE(store) << store.error().message();
  const Status written = commit_step(*store, 3);
  ASSERT_TRUE(written) << written.error().message();
  EXPECT_EQ(store->frames()->back().latency_ms, 20);
}

TEST_F(DamagedRunStore, IsNotResumedAsAnotherRun) {
  for (const auto& [sql, code, message] : std::vector<std::tuple<std::string, ErrorCode, std::string>>{
           {"PRAGMA application_id = 1", ErrorCode::input, "is not the database of a run"},
           {"PRAGMA user_version = 99", ErrorCode::configuration, "has schema version 99"},
           {"DELETE FROM identity WHERE key = 'rig'", ErrorCode::configuration, "another rig"},
           {"DELETE FROM identity WHERE key = 'options'", ErrorCode::configuration, "other options"},
           {"UPDATE identity SET value = ': [' WHERE key = 'options'", ErrorCode::configuration, "other options"},
           {"DROP TABLE health", ErrorCode::store_damaged, "table 'health' is missing"},
       }) {
    renew();
    damage(sql);
    const auto store = RunStore::resume(path_, kStored);
    ASSERT_FALSE(store) << sql;
    EXPECT_EQ(store.error().code, code) << sql;
    EXPECT_THAT(store.error().message(), HasSubstr(message)) << sql;
  }
}

TEST_F(DamagedRunStore, ATableThatIsRemovedWhileItIsOpenEndsReadingAndWriting) {
  for (const std::string table :
       {"frames", "stage_times", "localization", "slam", "health", "terrain", "maps", "memory", "identity"}) {
    renew();
    auto store = RunStore::resume(path_, kStored);
    ASSERT_TRUE(store) << store.error().message();
    damage("DROP TABLE " + table);
    EXPECT_FALSE(read_all(*store)) << table;
    const Status written = commit_step(*store, 3);
    ASSERT_FALSE(written) << table;
    EXPECT_THAT(written.error().message(), HasSubstr(table));
    EXPECT_FALSE(RunStore::resume(path_, kStored)) << table;
  }
}

}  // namespace
}  // namespace spartan
