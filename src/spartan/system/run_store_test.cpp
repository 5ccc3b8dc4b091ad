#include "spartan/system/run_store.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "spartan/numerics/random.h"
#include "spartan/storage/database.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

const RunIdentity kIdentity{"0123", "terrain:\n  every_m: 5\n", "schema: 1\n"};

FrameRecord some_frame(int i) {
  Random random(static_cast<std::uint64_t>(i));
  FrameRecord frame;
  frame.frame_id = 100 + i;
  frame.pair = "narrow";
  frame.stamp.ns = 1'000'000'000LL * i + 7;
  frame.status = "tracking";
  frame.has_pose = true;
  Vector6d tangent;
  for (int k = 0; k < 6; ++k) tangent[k] = random.uniform(-2, 2);
  frame.world_from_body = {exp_se3(tangent), 1e-4 * Matrix6d::Identity()};
  frame.motion.from.ns = frame.stamp.ns - 1'000'000'000LL;
  frame.motion.to = frame.stamp;
  frame.motion.previous_from_current = exp_se3(0.1 * tangent);
  frame.motion.inliers = 40 + i;
  frame.motion.rms_px = random.uniform();
  frame.times = {{"imaging", 1.5, 2.5}, {"odometry", 3.0, 3.0}};
  if (i == 3) return frame;  // without localization
  frame.slam = UncertainPose{exp_se3(0.3 * tangent), 4e-4 * Matrix6d::Identity()};
  LocalizationRecord& localization = frame.localization.emplace();
  localization.world_from_body = {exp_se3(0.5 * tangent), 2e-4 * Matrix6d::Identity()};
  localization.odom_from_body = {exp_se3(0.4 * tangent), 3e-4 * Matrix6d::Identity()};
  if (i > 0) localization.slip = 0.01 * i;
  if (i > 0) localization.slip_sigma = 0.02;
  localization.sensors = {{"vision", "ok", ""}, {"imu", "excluded", "frozen since then"}};
  if (i > 0) localization.sensors[0].test = InnovationTest{frame.stamp, 3.5 + i, 22.5};
  if (i > 0) frame.latency_ms = 20.25 + i;
  return frame;
}

MapRecord some_map(int i) {
  MapRecord map;
  map.stamp = some_frame(i).stamp;
  map.position_id = 40 + i;
  map.views = 4;
  map.world_from_body = some_frame(i).world_from_body;
  map.prior = {exp_se3(Vector6d::Constant(0.01)), 5e-4 * Matrix6d::Identity()};
  map.status = "decided";
  map.overlap = 0.4;
  map.known_cells = 7000;
  map.obstacles = 12;
  return map;
}

Status commit(RunStore&& store, const RunStore::Step& step,
              const std::optional<RunStore::Checkpoint>& checkpoint = std::nullopt) {
  return store.commit({step}, checkpoint);
}

Status commit(RunStore& store, const RunStore::Step& step,
              const std::optional<RunStore::Checkpoint>& checkpoint = std::nullopt) {
  return store.commit({step}, checkpoint);
}

TEST(RunStore, ReadsCommittedRecordsBitForBit) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  {
    auto store = RunStore::create(path, kIdentity);
    ASSERT_TRUE(store) << store.error().message();
    for (int i = 0; i < 5; ++i) {
      const std::optional<TerrainRecord> terrain =
          i == 2 ? std::optional(TerrainRecord{some_frame(i).stamp, "narrow", 91.5, 1234}) : std::nullopt;
      const std::optional<MapRecord> map = i == 1 ? std::optional(some_map(i)) : std::nullopt;
      const Bytes state{1, 2, static_cast<std::uint8_t>(i)};
      ASSERT_TRUE(commit(*store, {some_frame(i), terrain, map, {}}, RunStore::Checkpoint{state, {10 * i, 0}}));
    }
    ASSERT_TRUE(commit(*store, {{}, {}, some_map(4), {{"maps", 7.0, 6.0}}},
                       RunStore::Checkpoint{{1, 2, 4}, {40, 0}, {12.5, 20}}))
        << "the last stop";
  }
  auto store = RunStore::resume(path, kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  const auto frames = store->frames();
  ASSERT_TRUE(frames);
  ASSERT_EQ(frames->size(), 5U);
  for (int i = 0; i < 5; ++i) {
    const FrameRecord expected = some_frame(i), &read = (*frames)[static_cast<std::size_t>(i)];
    EXPECT_EQ(read.frame_id, expected.frame_id);
    EXPECT_EQ(read.stamp, expected.stamp);
    EXPECT_EQ(read.status, expected.status);
    EXPECT_EQ(read.world_from_body.pose.matrix(), expected.world_from_body.pose.matrix());
    EXPECT_EQ(read.world_from_body.covariance, expected.world_from_body.covariance);
    EXPECT_EQ(read.motion.previous_from_current.matrix(), expected.motion.previous_from_current.matrix());
    EXPECT_EQ(read.motion.inliers, expected.motion.inliers);
    EXPECT_EQ(read.motion.rms_px, expected.motion.rms_px);
    ASSERT_EQ(read.times.size(), i == 4 ? 3U : 2U) << "with the times of the last stop";
    EXPECT_EQ(read.times[1].stage, "odometry");
    EXPECT_EQ(read.times[0].cpu_ms, 2.5);
    ASSERT_EQ(read.localization.has_value(), expected.localization.has_value());
    if (!read.localization) continue;
    ASSERT_TRUE(read.slam);
    EXPECT_EQ(read.slam->pose.matrix(), expected.slam->pose.matrix());
    EXPECT_EQ(read.slam->covariance, expected.slam->covariance);
    const LocalizationRecord &localized = *read.localization, &expected_localization = *expected.localization;
    EXPECT_EQ(localized.world_from_body.pose.matrix(), expected_localization.world_from_body.pose.matrix());
    EXPECT_EQ(localized.world_from_body.covariance, expected_localization.world_from_body.covariance);
    EXPECT_EQ(localized.odom_from_body.pose.matrix(), expected_localization.odom_from_body.pose.matrix());
    EXPECT_EQ(localized.odom_from_body.covariance, expected_localization.odom_from_body.covariance);
    EXPECT_EQ(localized.slip, expected_localization.slip);
    EXPECT_EQ(localized.slip_sigma, expected_localization.slip_sigma);
    ASSERT_EQ(localized.sensors.size(), 2U);
    EXPECT_EQ(localized.sensors[1].name, "imu");
    EXPECT_EQ(localized.sensors[1].state, "excluded");
    EXPECT_EQ(localized.sensors[1].reason, "frozen since then");
    EXPECT_FALSE(localized.sensors[1].test);
    EXPECT_EQ(read.latency_ms, expected.latency_ms);
    ASSERT_EQ(localized.sensors[0].test.has_value(), i > 0);
    if (i == 0) continue;
    EXPECT_EQ(localized.sensors[0].test->stamp, expected.stamp);
    EXPECT_EQ(localized.sensors[0].test->nis, 3.5 + i);
    EXPECT_EQ(localized.sensors[0].test->gate, 22.5);
  }
  EXPECT_EQ(frames->back().times.back().stage, "maps");
  EXPECT_EQ(frames->back().times.back().wall_ms, 7.0);
  const auto maps = store->maps();
  ASSERT_TRUE(maps);
  ASSERT_EQ(maps->size(), 2U);
  EXPECT_EQ(maps->front().position_id, 41);
  EXPECT_EQ(maps->front().views, 4);
  EXPECT_EQ(maps->front().known_cells, 7000);
  EXPECT_EQ(maps->front().obstacles, 12);
  EXPECT_EQ(maps->back().world_from_body.pose.matrix(), some_map(4).world_from_body.pose.matrix());
  EXPECT_EQ(maps->back().prior.pose.matrix(), some_map(4).prior.pose.matrix());
  EXPECT_EQ(maps->back().prior.covariance, some_map(4).prior.covariance);
  EXPECT_EQ(maps->back().status, "decided");
  EXPECT_EQ(maps->back().overlap, 0.4);
  EXPECT_EQ(maps->back().world_from_body.covariance, some_map(4).world_from_body.covariance);
  const auto checkpoint = store->checkpoint();
  ASSERT_TRUE(checkpoint && *checkpoint);
  EXPECT_EQ((*checkpoint)->pipeline_state, (Bytes{1, 2, 4})) << "only the latest is retained";
  EXPECT_EQ((*checkpoint)->source.samples_taken, 40);
  EXPECT_EQ((*checkpoint)->elapsed.wall_s, 12.5);
  EXPECT_EQ((*checkpoint)->elapsed.cpu_s, 20);
  const auto terrain = store->terrain();
  ASSERT_TRUE(terrain);
  ASSERT_EQ(terrain->size(), 1U);
  EXPECT_EQ(terrain->front().points, 1234);
}

// Older programs have not stored it.
TEST(RunStore, ReadsRecordsFromANumberOn) {
  const testing::TemporaryFolder folder;
  auto store = RunStore::create(folder.path() + "/run.sqlite", kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  for (int i = 0; i < 6; ++i) {
    const TerrainRecord terrain{some_frame(i).stamp, "narrow", 91.5, 1234};
    ASSERT_TRUE(commit(*store, {some_frame(i), terrain, some_map(i), {}}));
  }
  const auto all = store->frames();
  ASSERT_TRUE(all);
  for (const int from : {0, 1, 3, 5, 6, 9}) {
    std::vector<FrameRecord> frames;
    ASSERT_TRUE(store->read_frames(from, [&](FrameRecord&& frame) { frames.push_back(std::move(frame)); }));
    const std::size_t expected = from < 6 ? static_cast<std::size_t>(6 - from) : 0;
    ASSERT_EQ(frames.size(), expected) << from;
    ASSERT_EQ(store->terrain(from)->size(), expected) << from;
    ASSERT_EQ(store->maps(from)->size(), expected) << from;
    for (std::size_t i = 0; i < expected; ++i) {
      const FrameRecord &read = frames[i], &whole = (*all)[static_cast<std::size_t>(from) + i];
      EXPECT_EQ(read.stamp, whole.stamp);
      EXPECT_EQ(read.times.size(), whole.times.size());
      EXPECT_EQ(read.latency_ms, whole.latency_ms);
      ASSERT_EQ(read.localization.has_value(), whole.localization.has_value());
      if (!read.localization) continue;
      ASSERT_EQ(read.localization->sensors.size(), 2U);
      EXPECT_EQ(read.localization->sensors[1].reason, whole.localization->sensors[1].reason);
      EXPECT_EQ(read.localization->sensors[0].test.has_value(), whole.localization->sensors[0].test.has_value());
      EXPECT_EQ((*store->terrain(from))[i].stamp, read.stamp);
      EXPECT_EQ((*store->maps(from))[i].stamp, read.stamp);
    }
  }
}

TEST(RunStore, IsResumedWithoutTheElapsedTime) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  ASSERT_TRUE(commit(RunStore::create(path, kIdentity).value(), {some_frame(0), {}, {}, {}},
                     RunStore::Checkpoint{{1}, {1, 0}, {3, 4}}));
  ASSERT_TRUE(Database::open(path, Database::Mode::open)->execute("DROP TABLE elapsed"));
  auto store = RunStore::resume(path, kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  EXPECT_EQ((*store->checkpoint())->elapsed.wall_s, 0);
  ASSERT_TRUE(commit(*store, {some_frame(1), {}, {}, {}}, RunStore::Checkpoint{{1}, {2, 0}, {5, 6}}));
  EXPECT_EQ((*store->checkpoint())->elapsed.wall_s, 5);
}

// What was committed after the latest checkpoint can be read, but is made again by a resumed run.
TEST(RunStore, ResumesFromTheLatestCheckpoint) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  const auto terrain = [](int i) { return TerrainRecord{some_frame(i).stamp, "narrow", 90.0 + i, i}; };
  {
    auto store = RunStore::create(path, kIdentity);
    ASSERT_TRUE(store) << store.error().message();
    ASSERT_TRUE(commit(*store, {some_frame(0), terrain(0), {}, {}}));
    EXPECT_FALSE(store->checkpoint().value().has_value());
    ASSERT_TRUE(commit(*store, {some_frame(1), {}, some_map(0), {}}, RunStore::Checkpoint{{1}, {10, 0}}));
    ASSERT_TRUE(commit(*store, {some_frame(2), terrain(2), some_map(1), {}}));
    ASSERT_TRUE(commit(*store, {some_frame(3), {}, {}, {}}));
    auto reader = RunStore::open_read_only(path);
    ASSERT_TRUE(reader) << reader.error().message();
    EXPECT_EQ(reader->frames()->size(), 4U);
    EXPECT_EQ(reader->maps()->size(), 2U);
  }
  auto store = RunStore::resume(path, kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  const auto frames = store->frames();
  ASSERT_TRUE(frames);
  ASSERT_EQ(frames->size(), 2U);
  EXPECT_EQ(frames->back().times.size(), 2U);
  EXPECT_EQ(store->terrain()->size(), 1U);
  EXPECT_EQ(store->maps()->size(), 1U);
  EXPECT_EQ((*store->checkpoint())->source.samples_taken, 10);
  ASSERT_TRUE(commit(*store, {some_frame(2), terrain(2), some_map(1), {}}));
  EXPECT_EQ(store->frames()->back().times.size(), 2U);
  EXPECT_EQ(store->frames()->back().localization->sensors.size(), 2U);
}

TEST(RunStore, KeepsTheInputsOfTheLocalizationAndTheSmoothedPoses) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  const UncertainPose pose = some_frame(1).world_from_body;
  {
    auto store = RunStore::create(path, kIdentity);
    ASSERT_TRUE(store) << store.error().message();
    ASSERT_TRUE(commit(*store, {some_frame(0), {}, {}, {}, {1, 2}}, RunStore::Checkpoint{{1}, {1, 0}}));
    ASSERT_TRUE(commit(*store, {some_frame(1), {}, {}, {}, {3}}, RunStore::Checkpoint{{1}, {2, 0}}));
    ASSERT_TRUE(store->commit_smoothed({std::nullopt, pose}));
    ASSERT_TRUE(commit(*store, {{}, {}, some_map(0), {}, {4, 5, 6}}, RunStore::Checkpoint{{1}, {3, 0}}));
  }
  const auto check = [&](RunStore& store) {
    EXPECT_EQ(store.localization_inputs().value(), (std::vector<Bytes>{{1, 2}, {3}, {4, 5, 6}}));
    const auto frames = store.frames();
    ASSERT_TRUE(frames);
    EXPECT_FALSE(frames->front().smoothed);
    ASSERT_TRUE(frames->back().smoothed);
    EXPECT_EQ(frames->back().smoothed->pose.matrix(), pose.pose.matrix());
    EXPECT_EQ(frames->back().smoothed->covariance, pose.covariance);
  };
  auto reader = RunStore::open_read_only(path);
  ASSERT_TRUE(reader) << reader.error().message();
  check(*reader);
  auto store = RunStore::resume(path, kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  check(*store);
  // A run that goes on is not smoothed until its end; inputs after the checkpoint are removed with their frames.
  ASSERT_TRUE(commit(*store, {some_frame(2), {}, {}, {}, {7}}));
  EXPECT_FALSE(store->frames()->at(1).smoothed);
  EXPECT_EQ(store->localization_inputs()->size(), 4U);
  store = RunStore::resume(path, kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  EXPECT_EQ(store->localization_inputs()->size(), 3U);
}

TEST(RunStore, StartsAgainWithoutACheckpoint) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  ASSERT_TRUE(commit(RunStore::create(path, kIdentity).value(), {some_frame(0), {}, some_map(0), {}}));
  auto store = RunStore::resume(path, kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  EXPECT_TRUE(store->frames()->empty());
  EXPECT_TRUE(store->maps()->empty());
  EXPECT_FALSE(store->checkpoint().value().has_value());
  ASSERT_TRUE(commit(*store, {some_frame(0), {}, some_map(0), {}}));
}

// Version 2 had a checkpoint in every transaction and no table of counts.
TEST(RunStore, ResumesAStoreOfVersion2AtItsLatestFrame) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  ASSERT_TRUE(commit(RunStore::create(path, kIdentity).value(), {some_frame(0), {}, {}, {}},
                     RunStore::Checkpoint{{1}, {1, 0}}));
  ASSERT_TRUE(Database::open(path, Database::Mode::open)->execute("DROP TABLE counts; PRAGMA user_version=2"));
  EXPECT_EQ(RunStore::open_read_only(path)->frames()->size(), 1U);
  auto store = RunStore::resume(path, kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  EXPECT_EQ(store->frames()->size(), 1U);
  ASSERT_TRUE(commit(*store, {some_frame(1), {}, {}, {}}));
}

// Counts the steps of SQLite's virtual machine in all finished statements of databases that are opened during its
// lifetime.
class StepCounter {
 public:
  StepCounter() {
    steps_ = 0;
    sqlite3_auto_extension(reinterpret_cast<void (*)()>(&install));
  }
  StepCounter(const StepCounter&) = delete;
  StepCounter& operator=(const StepCounter&) = delete;
  ~StepCounter() { sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(&install)); }
  std::int64_t steps() const { return steps_; }

 private:
  static int install(sqlite3* db, const char**, const void*) {
    const auto count = [](unsigned, void*, void* statement, void*) {
      steps_ += sqlite3_stmt_status(static_cast<sqlite3_stmt*>(statement), SQLITE_STMTSTATUS_VM_STEP, 1);
      return 0;
    };
    return sqlite3_trace_v2(db, SQLITE_TRACE_PROFILE, count, nullptr);
  }
  static inline std::int64_t steps_ = 0;
};

// Writes five frames and doubles them `doublings` times.
void fill(const std::string& path, int doublings) {
  {
    auto store = RunStore::create(path, kIdentity);
    ASSERT_TRUE(store) << store.error().message();
    for (int i = 0; i < 5; ++i) {
      ASSERT_TRUE(commit(*store, {some_frame(i), {}, {}, {}}, RunStore::Checkpoint{{1}, {i, 0}}));
    }
  }
  auto db = Database::open(path, Database::Mode::open);
  ASSERT_TRUE(db);
  ASSERT_TRUE(db->execute("BEGIN"));
  for (int i = 0; i < doublings; ++i) {
    for (const std::string table :
         {"frames", "stage_times", "latencies", "localization", "slam", "health", "innovations"}) {
      const Status doubled = db->execute(
          fmt::format("CREATE TEMP TABLE more AS SELECT * FROM {0} ORDER BY rowid; UPDATE more SET seq = seq + {1}; "
                      "INSERT INTO {0} SELECT * FROM more ORDER BY rowid; DROP TABLE more",
                      table, 5 << i));
      ASSERT_TRUE(doubled) << doubled.error().message();
    }
  }
  ASSERT_TRUE(db->execute("COMMIT"));
}

TEST(RunStore, ReadTimeIsLinearInTheNumberOfFrames) {
  const testing::TemporaryFolder folder;
  const auto steps_of = [&](int doublings) -> std::int64_t {
    const std::string path = folder.path() + "/" + std::to_string(doublings) + ".sqlite";
    fill(path, doublings);
    const std::size_t count = std::size_t{5} << doublings;
    const StepCounter counter;
    auto store = RunStore::open_read_only(path);
    EXPECT_TRUE(store);
    const auto frames = store->frames();
    EXPECT_TRUE(frames) << count << " frames: " << frames.error().message();
    if (!frames) return -1;
    EXPECT_EQ(frames->size(), count);
    for (std::size_t i = 0; i < count; i += 1003) {
      const FrameRecord expected = some_frame(static_cast<int>(i % 5)), &read = (*frames)[i];
      EXPECT_EQ(read.frame_id, expected.frame_id);
      EXPECT_EQ(read.times.size(), 2U);
      EXPECT_EQ(read.slam.has_value(), expected.slam.has_value());
      EXPECT_EQ(read.localization.has_value(), expected.localization.has_value());
      EXPECT_EQ(read.localization ? read.localization->sensors.size() : 2U, 2U);
    }
    return counter.steps();
  };
  const std::int64_t few = steps_of(9), many = steps_of(12);  // 2560 and 20480 frames
  ASSERT_GT(few, 0);
  ASSERT_GT(many, 0);
  EXPECT_LT(static_cast<double>(many), 8.5 * static_cast<double>(few));
}

TEST(RunStore, RejectsResumingAnotherRun) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  ASSERT_TRUE(RunStore::create(path, kIdentity));
  for (int changed = 0; changed < 3; ++changed) {
    RunIdentity other = kIdentity;
    (changed == 0 ? other.input : changed == 1 ? other.options : other.rig) += "x";
    const auto resumed = RunStore::resume(path, other);
    ASSERT_FALSE(resumed);
    EXPECT_EQ(resumed.error().code, ErrorCode::configuration);
    EXPECT_NE(resumed.error().message().find(path), std::string::npos);
  }
  EXPECT_TRUE(RunStore::resume(path, kIdentity));
  RunIdentity commented = kIdentity;
  commented.options = "# another description\n" + commented.options;
  EXPECT_TRUE(RunStore::resume(path, commented)) << "the same values";
}

TEST(RunStore, DistinguishesARunFromAnEmptyFile) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  EXPECT_FALSE(RunStore::contains_run(path).value());
  std::FILE* const file = std::fopen(path.c_str(), "w");
  std::fclose(file);
  EXPECT_FALSE(RunStore::contains_run(path).value());
  ASSERT_TRUE(RunStore::create(path, kIdentity));
  EXPECT_TRUE(RunStore::contains_run(path).value());
}

TEST(RunStore, RejectsFilesThatAreNoStore) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  EXPECT_EQ(RunStore::open_read_only(path).error().code, ErrorCode::input);
  std::FILE* const file = std::fopen(path.c_str(), "w");
  std::fputs("not a database, although the name says so; long enough for a header to be read", file);
  std::fclose(file);
  const auto opened = RunStore::open_read_only(path);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::store_damaged);
}

// After a process is killed, the store contains all committed frames.
TEST(RunStore, RetainsCommittedFramesWhenKilled) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/run.sqlite";
  const pid_t child = ::fork();
  if (child == 0) {
    auto store = RunStore::create(path, kIdentity);
    for (int i = 0; store && i < 7; ++i) {
      if (!commit(*store, {some_frame(i), {}, {}, {}}, RunStore::Checkpoint{Bytes(100'000, 1), {i, 0}})) ::_exit(1);
    }
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  auto store = RunStore::resume(path, kIdentity);
  ASSERT_TRUE(store) << store.error().message();
  EXPECT_EQ(store->frames()->size(), 7U);
  EXPECT_EQ((*store->checkpoint())->source.samples_taken, 6);
}

}  // namespace
}  // namespace spartan
