// Live runs over a stream that never comes again, as that of cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "run_on_small_drive.h"
#include "spartan/storage/database.h"
#include "spartan/system/run.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

// Plays a recording, some seconds earlier or later than it was.
class Unrepeatable : public StreamDecorator {
 public:
  Unrepeatable(SampleStream& replay, double later_s = 0)
      : StreamDecorator(replay), later_ns_(Stamp::from_seconds(later_s).ns) {}
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override {
    auto read = behind().read(timeout);
    if (read && read->sample) move_stamps(*read->sample, later_ns_);
    return read;
  }
  bool is_repeatable() const override { return false; }
  void start_after(Stamp /*stamp*/) override {}

 private:
  std::int64_t later_ns_;
};

class UnrepeatableStream : public testing::RunOnSmallDrive {
 protected:
  std::unique_ptr<SampleStream> replay() const {
    LiveOptions options;
    options.speed = 10;
    return open_live_stream("replay:" + drive(), {}, options).value();
  }
  RunRequest request() const {
    RunRequest request;
    request.input = "replay:" + drive();
    request.output = path("run");
    request.options.longest_wait_s = 0;  // on any computer
    return request;
  }
  // At the state from which the run can be resumed.
  std::int64_t frames_of_state() const {
    auto db = Database::open(path("run/run.sqlite"), Database::Mode::read_only);
    if (!db) return 0;
    auto count = db->prepare("SELECT frames FROM counts");
    if (!count || !*count->step()) return 0;
    return count->integer(0);
  }
};

// A state after the first frame, and the next one only after 1000 s: what comes between could not be processed again.
TEST_F(UnrepeatableStream, WithoutARecordingEachCommitHasAState) {
  for (const bool record : {false, true}) {
    const auto source = replay();
    Unrepeatable stream(*source);
    RunRequest wanted = request();
    wanted.output = path("run");
    wanted.replace = record;
    wanted.record = record;
    wanted.options.commit.every_s = 0;
    wanted.options.commit.state_every_s = 1000;
    RunHooks hooks;
    std::int64_t frames = 0, of_state = 0;
    hooks.frame = [&](const FrameRecord&) {
      if (++frames != 10) return;
      const auto until = std::chrono::steady_clock::now() + (record ? 1s : 20s);
      do {
        std::this_thread::sleep_for(10ms);
        of_state = frames_of_state();
      } while (of_state < 5 && std::chrono::steady_clock::now() < until);
    };
    const auto outcome = run_live(stream, wanted, hooks);
    ASSERT_TRUE(outcome) << outcome.error().message();
    EXPECT_EQ(of_state >= 5, !record) << of_state;
  }
}

TEST_F(UnrepeatableStream, AClockThatWentBackDoesNotEndTheRun) {
  RunRequest wanted = request();
  wanted.record = true;
  wanted.max_frames = 6;
  {
    const auto source = replay();
    Unrepeatable stream(*source);
    ASSERT_TRUE(run_live(stream, wanted, RunHooks()));
  }
  wanted.max_frames = 0;
  wanted.resume = true;
  const auto source = replay();
  Unrepeatable earlier(*source, -3600);
  std::vector<std::string> said;
  RunHooks hooks;
  hooks.log = Log::to_function([&](LogLevel, std::string_view text) { said.emplace_back(text); });
  const auto outcome = run_live(earlier, wanted, hooks);
  ASSERT_TRUE(outcome) << outcome.error().message();
  EXPECT_THAT(said, ::testing::Contains(HasSubstr("stamps are moved")));
  const auto frames = RunStore::open_read_only(path("run/run.sqlite"))->frames().value();
  EXPECT_GE(frames.size(), 20u) << "6 frames or some more that were recorded, and 14 of the stream that begins again";
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GT(frames[i].stamp, frames[i - 1].stamp);
  const std::string log = testing::content_of(path("run/log.txt"));
  EXPECT_THAT(log, HasSubstr("stamps are moved")) << "what streams say is in the log of the run as well";
}

// The other pair of the rig has cameras, which deliver nothing yet.
class WithASilentPair : public Unrepeatable {
 public:
  explicit WithASilentPair(SampleStream& replay) : Unrepeatable(replay), info_(replay.info()) {
    const StereoPair front = info_.rig.pairs.front();
    for (const std::string& name : {front.left, front.right}) {
      Camera camera = *info_.rig.find_camera(name);
      camera.name = "mast_" + name;
      camera.driver = CameraDriver{};
      camera.driver->source = "aravis:" + name;
      info_.rig.cameras.push_back(camera);
    }
    info_.rig.pairs.push_back({"mast", "mast_" + front.left, "mast_" + front.right, front.nearest_m, false});
  }
  const StreamInfo& info() const override { return info_; }
  std::size_t previews(const std::string& pair) const override {
    return pair == "mast" ? 0 : Unrepeatable::previews(pair);
  }

 private:
  StreamInfo info_;
};

TEST_F(UnrepeatableStream, MapsAreOfStopsAlsoWhereTheirCamerasDoNotAnswerYet) {
  const auto source = replay();
  WithASilentPair stream(*source);
  RunRequest wanted = request();
  wanted.max_frames = 3;
  const auto outcome = run_live(stream, wanted, RunHooks());
  ASSERT_TRUE(outcome) << outcome.error().message();
  EXPECT_EQ(load_options<RunOptions>(path("run/config.yaml")).value().maps_from, MapSource::stops);
}

}  // namespace
}  // namespace spartan
