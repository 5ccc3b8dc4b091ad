#include "spartan/system/internal/run_recorder.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;

RunResult frame_result(int i) {
  RunResult result;
  FrameRecord& frame = result.step.frame.emplace();
  frame.frame_id = i;
  frame.pair = "narrow";
  frame.stamp.ns = 1'000'000'000LL * (i + 1);
  frame.status = "tracking";
  frame.has_pose = true;
  return result;
}

RunResult terrain_result(int i) {
  RunResult result = frame_result(i);
  TerrainView& view = result.terrain.emplace();
  view.pair = "narrow";
  view.stamp = result.step.frame->stamp;
  view.geometry = {{8, 6}, 8, {3.5, 2.5}, 0.1};
  view.left = Image<std::uint8_t>(8, 6, 100);
  view.disparity = Image<float>(8, 6, 2.0F);
  view.sigma = Image<float>(8, 6, 0.2F);
  return result;
}

RunResult map_result(int i) {
  RunResult result = frame_result(i);
  MappedStop& stop = result.stop.emplace();
  stop.stamp = result.step.frame->stamp;
  LocalMap& map = stop.merged.local;
  for (Image<float>* const layer :
       {&map.elevation_m, &map.elevation_min_m, &map.elevation_max_m, &map.variance_m2, &map.count, &map.ground_m,
        &map.slope_rad, &map.roughness_m, &map.step_m, &map.occupancy_logodds, &map.cost})
    *layer = Image<float>(4, 4, 0.0F);
  map.kind = Image<GroundClass>(4, 4, GroundClass::ground);
  return result;
}

class RunRecorderTest : public ::testing::Test {
 protected:
  std::unique_ptr<RunRecorder> open(const CommitOptions& commit, Pace pace = Pace::recorded) {
    RunOptions options;
    options.commit = commit;
    auto store = RunStore::create(run_.store(), {"input", "options", "rig"});
    EXPECT_TRUE(store) << store.error().message();
    EXPECT_TRUE(make_folder(run_.terrain()));
    EXPECT_TRUE(make_folder(run_.maps()));
    return RunRecorder::create(std::move(*store), run_, options, pace).value();
  }
  // What another process sees.
  std::size_t committed_frames() { return RunStore::open_read_only(run_.store())->frames()->size(); }

  testing::TemporaryFolder folder_;
  RunFolder run_{folder_.path()};
};

TEST_F(RunRecorderTest, CommitsManyFramesInOneTransaction) {
  CommitOptions rarely;
  rarely.every_s = 3600;
  const auto recorder = open(rarely);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(recorder->add(frame_result(i)));
  std::this_thread::sleep_for(100ms);
  EXPECT_EQ(committed_frames(), 0U);
  ASSERT_TRUE(recorder->flush());
  EXPECT_EQ(committed_frames(), 20U);
  EXPECT_EQ(recorder->statistics().commits.size(), 1U);
  ASSERT_TRUE(recorder->flush()) << "nothing is left";
  EXPECT_EQ(recorder->statistics().commits.size(), 1U);
}

TEST_F(RunRecorderTest, CommitsAfterItsTimeWithoutAnotherResult) {
  CommitOptions soon;
  soon.every_s = 0.05;
  const auto recorder = open(soon);
  ASSERT_TRUE(recorder->add(frame_result(0)));
  for (int i = 0; i < 200 && committed_frames() == 0; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(committed_frames(), 1U);
}

TEST_F(RunRecorderTest, CommitsAtOnceWhereAResultAsksForIt) {
  CommitOptions rarely;
  rarely.every_s = 3600;
  const auto recorder = open(rarely);
  ASSERT_TRUE(recorder->add(frame_result(0)));
  RunResult now = frame_result(1);
  now.commit_now = true;
  ASSERT_TRUE(recorder->add(std::move(now)));
  for (int i = 0; i < 200 && committed_frames() == 0; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(committed_frames(), 2U) << "with what came before";
}

TEST_F(RunRecorderTest, CheckpointsReportTheChangesOfTheMapAsStored) {
  const auto recorder = open({});
  EXPECT_EQ(recorder->maps_stored(), 0U);
  RunResult result = frame_result(0);
  result.checkpoint = RunStore::Checkpoint{{1, 2, 3}, {5, 6}};
  result.maps.number = 7;
  ASSERT_TRUE(recorder->add(std::move(result)));
  ASSERT_TRUE(recorder->flush());
  EXPECT_EQ(recorder->maps_stored(), 7U);
  EXPECT_EQ((*recorder->store().checkpoint())->pipeline_state, (Bytes{1, 2, 3}));
}

TEST_F(RunRecorderTest, WritesTheFilesOfATerrainViewAndItsRecord) {
  const auto recorder = open({});
  ASSERT_TRUE(recorder->add(terrain_result(0)));
  ASSERT_TRUE(recorder->flush());
  const auto terrain = recorder->store().terrain();
  ASSERT_TRUE(terrain);
  ASSERT_EQ(terrain->size(), 1U);
  EXPECT_EQ(terrain->front().density_percent, 100);
  EXPECT_TRUE(read_file(run_.terrain() + "/1000000000.pfm"));
  const auto frames = recorder->store().frames();
  ASSERT_FALSE(frames->front().times.empty());
  EXPECT_EQ(frames->front().times.back().stage, "terrain");
}

// Live, the disk may be slower than the rover; recorded results are never discarded.
TEST_F(RunRecorderTest, DiscardsOnlyFilesAndOnlyLive) {
  constexpr int kResults = 60;
  for (const Pace pace : {Pace::live, Pace::recorded}) {
    const testing::TemporaryFolder folder;
    run_ = RunFolder{folder.path()};
    const auto recorder = open({}, pace);
    for (int i = 0; i < kResults; ++i) ASSERT_TRUE(recorder->add(terrain_result(i)));
    ASSERT_TRUE(recorder->flush());
    EXPECT_EQ(recorder->store().frames()->size(), static_cast<std::size_t>(kResults));
    const auto written = static_cast<std::int64_t>(recorder->store().terrain()->size());
    EXPECT_EQ(written + recorder->statistics().files_discarded, kResults);
    EXPECT_TRUE(pace == Pace::live || written == kResults) << written;
  }
}

// No file can be written to while it lives.
class FullDisk {
 public:
  FullDisk() {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit none{0, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &none);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

TEST_F(RunRecorderTest, LiveResultsWaitForADiskThatIsFull) {
  CommitOptions soon;
  soon.every_s = 0.01;
  const auto recorder = open(soon, Pace::live);
  ASSERT_TRUE(recorder->add(frame_result(0)));
  ASSERT_TRUE(recorder->flush());
  {
    const FullDisk full;
    for (int i = 1; i < 30; ++i) {
      RunResult result = i == 20 ? terrain_result(i) : frame_result(i);
      if (i == 15) {
        result.checkpoint = RunStore::Checkpoint{{4, 5}, {5, 6}};
        result.maps.number = 9;
      }
      ASSERT_TRUE(recorder->add(std::move(result))) << "the rover goes on";
      std::this_thread::sleep_for(2ms);
    }
    for (int i = 0; i < 200 && !recorder->disk_error(); ++i) std::this_thread::sleep_for(10ms);
    ASSERT_TRUE(recorder->disk_error());
    EXPECT_EQ(recorder->maps_stored(), 0U);
  }
  // The next try comes by itself.
  for (int i = 0; i < 1000 && recorder->disk_error(); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_FALSE(recorder->disk_error());
  ASSERT_TRUE(recorder->add(frame_result(30)));
  ASSERT_TRUE(recorder->flush());
  EXPECT_EQ(committed_frames(), 31U);
  EXPECT_EQ(recorder->maps_stored(), 9U);
  EXPECT_EQ((*recorder->store().checkpoint())->pipeline_state, (Bytes{4, 5}));
  EXPECT_EQ(recorder->statistics().files_discarded, 1) << "those of a terrain view";
}

TEST_F(RunRecorderTest, AtTheEndAFullDiskIsAnError) {
  const auto recorder = open({}, Pace::live);
  ASSERT_TRUE(recorder->add(frame_result(0)));
  const FullDisk full;
  const Status flushed = recorder->flush();
  ASSERT_FALSE(flushed);
  EXPECT_EQ(flushed.error().code, ErrorCode::output);
}

TEST_F(RunRecorderTest, ReportsAnErrorOfTheDisk) {
  const auto recorder = open({});
  ASSERT_TRUE(recorder->add(frame_result(0)));
  ASSERT_TRUE(recorder->flush());
  std::filesystem::remove_all(run_.terrain());
  ASSERT_TRUE(recorder->add(terrain_result(1)));
  const Status flushed = recorder->flush();
  ASSERT_FALSE(flushed);
  EXPECT_EQ(flushed.error().code, ErrorCode::output);
  EXPECT_FALSE(recorder->add(frame_result(2))) << "no result after it is written";
  EXPECT_EQ(committed_frames(), 1U);
}

// A recording that hangs.
TEST_F(RunRecorderTest, FramesDoNotWaitForTheRecording) {
  CommitOptions commit;
  commit.every_s = 0.01;
  const auto recorder = open(commit, Pace::live);
  std::atomic<bool> hangs = true;
  RunResult result = frame_result(0);
  result.checkpoint = RunStore::Checkpoint{{1, 2, 3}, {5, 6}};
  result.maps.number = 3;
  result.can_commit_checkpoint = [&] { return !hangs; };
  ASSERT_TRUE(recorder->add(std::move(result)));
  ASSERT_TRUE(recorder->add(terrain_result(1)));
  ASSERT_TRUE(recorder->add(frame_result(2)));
  for (int i = 0; i < 2000 && committed_frames() < 3; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(committed_frames(), 3u);
  EXPECT_STREQ(recorder->waiting_for().stage(), "recording") << "for the watchdog";
  EXPECT_TRUE(recorder->checkpoint_waits());
  EXPECT_EQ(recorder->maps_stored(), 0U);
  hangs = false;
  for (int i = 0; i < 2000 && recorder->checkpoint_waits(); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(recorder->waiting_for().stage(), nullptr);
  EXPECT_EQ(recorder->maps_stored(), 3U);
  EXPECT_TRUE(recorder->flush());
  EXPECT_EQ(committed_frames(), 3u);
  const auto resumed = RunStore::resume(run_.store(), {"input", "options", "rig"});
  ASSERT_TRUE(resumed);
  EXPECT_EQ(committed_frames(), 1u) << "those after the checkpoint will come again";
  EXPECT_EQ(RunStore::open_read_only(run_.store())->terrain()->size(), 0u);
}

TEST_F(RunRecorderTest, ALaterCheckpointWaitsForTheOneBefore) {
  const auto recorder = open({}, Pace::live);
  std::atomic<bool> hangs = true;
  for (std::uint8_t i = 0; i < 2; ++i) {
    RunResult result = frame_result(i);
    result.checkpoint = RunStore::Checkpoint{{i}, {5, 6}};
    result.maps.number = i + 1U;
    result.can_commit_checkpoint = [&] { return !hangs; };
    ASSERT_TRUE(recorder->add(std::move(result)));
  }
  EXPECT_EQ(recorder->maps_stored(), 0U);
  hangs = false;
  EXPECT_TRUE(recorder->flush());
  EXPECT_EQ(recorder->maps_stored(), 2U);
  EXPECT_EQ((*recorder->store().checkpoint())->pipeline_state, (Bytes{1}));
}

// Live, files are discarded while too many wait; nobody may wait for them.
TEST_F(RunRecorderTest, ReportsWhetherTheFilesOfAMapAreWritten) {
  const auto recorder = open({}, Pace::live);
  std::vector<std::string> reports;
  std::mutex mutex;
  recorder->report_maps_to([&](const MappedStop& stop, bool has_files) {
    const std::lock_guard lock(mutex);
    const bool there = std::filesystem::exists(run_.local_map(stop.stamp) + ".tif");
    reports.push_back(has_files == there ? "as reported" : "not as reported");
    if (!has_files) reports.push_back("discarded");
  });
  std::filesystem::remove_all(run_.maps());
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(recorder->add(map_result(i)));
    ASSERT_TRUE(recorder->flush());
    ASSERT_TRUE(make_folder(run_.maps()));
  }
  EXPECT_EQ(reports, (std::vector<std::string>{"as reported", "discarded", "as reported"}));
}

}  // namespace
}  // namespace spartan::internal
