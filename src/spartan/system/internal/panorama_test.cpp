#include "spartan/system/internal/panorama.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <variant>
#include <vector>

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr PanTiltAngles kRest{0.1, 0.6};

bool is_rest(const PanTiltAngles& angles) {
  return angles.pan_rad == kRest.pan_rad && angles.tilt_rad == kRest.tilt_rad;
}

// Is where it is sent after so many readings.
class ScriptedUnit : public PanTiltControl {
 public:
  explicit ScriptedUnit(const PanTiltAngles& begin) : angles_(begin) {}
  Status move_to(const PanTiltAngles& angles) override {
    {
      const std::lock_guard lock(mutex_);
      commands_.push_back(angles);
    }
    if (on_command) on_command(angles);
    const std::lock_guard lock(mutex_);
    int& refusals = is_rest(angles) ? refused_returns : refused_views;
    if (refusals > 0) {
      --refusals;
      return failure(ErrorCode::read_error, "refuses");
    }
    target_ = angles;
    readings_left_ = readings;
    return {};
  }
  Result<PanTiltReading> read() override {
    const std::lock_guard lock(mutex_);
    if (target_ && readings_left_-- <= 0) {
      angles_ = *target_;
      target_.reset();
    }
    return PanTiltReading{angles_, target_.has_value()};
  }
  double sigma_rad() const override { return 0; }
  bool rests() const {
    const std::lock_guard lock(mutex_);
    return !target_ && is_rest(angles_);
  }
  std::vector<PanTiltAngles> commands() const {
    const std::lock_guard lock(mutex_);
    return commands_;
  }

  std::function<void(const PanTiltAngles&)> on_command;
  int readings = 0, refused_returns = 0, refused_views = 0;

 private:
  mutable std::mutex mutex_;
  PanTiltAngles angles_;
  std::optional<PanTiltAngles> target_;
  int readings_left_ = 0;
  std::vector<PanTiltAngles> commands_;
};

// Both pairs are on the unit, which rests at 0.1 and 0.6 rad.
Rig rig_with_all_on_the_unit() {
  Rig rig;
  PanTiltUnit mast;
  mast.name = "mast";
  mast.rest_pan_rad = kRest.pan_rad;
  mast.rest_tilt_rad = kRest.tilt_rad;
  rig.pan_tilt_units = {mast};
  for (const char* name : {"a", "b", "c", "d"}) {
    Camera camera;
    camera.name = name;
    camera.mount = "mast";
    rig.cameras.push_back(camera);
  }
  rig.pairs = {{"narrow", "a", "b", 0, true}, {"wide", "c", "d", 0, false}};
  return rig;
}

StereoFrame frame_at_stop(const std::string& pair, double seconds) {
  StereoFrame frame;
  frame.pair = pair;
  frame.left_stamp = frame.right_stamp = Stamp::from_seconds(seconds);
  return frame;
}

class PanoramaTest : public ::testing::Test {
 protected:
  PanoramaTest() {
    options.settle_s = 0;
    options.pans_deg = {-20, 20};
    hooks.panorama = [this](const PanoramaEvent& event) { ++(event.begins ? begun : ended); };
    hooks.log = Log::to_function([this](LogLevel, std::string_view text) { said += std::string(text) + "\n"; });
  }
  std::unique_ptr<Panorama> create(PanTiltControl& unit) {
    return Panorama::create(rig_with_all_on_the_unit(), "narrow", options, unit, nullptr, hooks).value();
  }
  // The rover has been stationary for long enough.
  static void rest_and_request(Panorama& panorama) {
    panorama.request();
    for (int i = 0; i < 20; ++i) panorama.add(RoverMotion{Stamp::from_seconds(0.1 * i), 0, Vector6d::Zero()});
  }
  static void drive_on(Panorama& panorama) {
    Vector6d velocity = Vector6d::Zero();
    velocity(0) = 0.2;
    for (const double time_s : {2.0, 2.1}) panorama.add(RoverMotion{Stamp::from_seconds(time_s), 0, velocity});
  }
  // Until `done`, and not for ever.
  template <class Done, class Step>
  static void repeat_until(const Done& done, const Step& step) {
    const auto until = std::chrono::steady_clock::now() + 60s;
    for (double time_s = 3; !done() && std::chrono::steady_clock::now() < until; time_s += 0.001) {
      step(time_s);
      std::this_thread::sleep_for(1ms);
    }
  }
  void wait_for_narrow_frames(Panorama& panorama) {
    bool there = false;
    repeat_until([&] { return there; },
                 [&](double time_s) {
                   StereoFrame narrow = frame_at_stop("narrow", time_s);
                   there = panorama.label(narrow);
                 });
  }

  // Frames of the odometry come until the unit begins to move.
  static void begin(Panorama& panorama, const ScriptedUnit& unit) {
    const std::size_t before = unit.commands().size();
    rest_and_request(panorama);
    repeat_until([&] { return unit.commands().size() > before; },
                 [&](double time_s) {
                   StereoFrame narrow = frame_at_stop("narrow", time_s);
                   panorama.label(narrow);
                 });
  }

  PanoramaOptions options;
  RunHooks hooks;
  std::atomic<int> begun = 0, ended = 0;
  std::string said;
};

TEST_F(PanoramaTest, TheOdometryOnTheUnitHasFramesBetweenPanoramas) {
  ScriptedUnit unit({0, 0});
  const auto panorama = create(unit);
  wait_for_narrow_frames(*panorama);
  EXPECT_TRUE(unit.rests()) << "first of all it goes there";
  StereoFrame before = frame_at_stop("narrow", 0);
  EXPECT_TRUE(panorama->label(before));
  EXPECT_DOUBLE_EQ(before.pan_rad, 0.1);
  EXPECT_DOUBLE_EQ(before.tilt_rad, 0.6);
  rest_and_request(*panorama);
  int views = 0, at_stop = 0, wrong = 0;
  std::int64_t id_of_views = -1, id_of_stop = -1;
  repeat_until([&] { return ended > 0; },
               [&](double time_s) {
                 StereoFrame wide = frame_at_stop("wide", time_s), narrow = frame_at_stop("narrow", time_s);
                 if (panorama->label(wide)) ++views, id_of_views = wide.position_id;
                 const bool moved_before = unit.commands().size() > 1;
                 if (!panorama->label(narrow) || narrow.position_id < 0) return;
                 ++(moved_before ? wrong : at_stop);
                 id_of_stop = narrow.position_id;
               });
  EXPECT_EQ(views, 2);
  EXPECT_EQ(wrong, 0) << "frames of a camera that turns, as if it did not";
  EXPECT_GT(at_stop, 0) << "views without a frame of the odometry become no map";
  EXPECT_EQ(id_of_stop, id_of_views);
  StereoFrame after = frame_at_stop("narrow", 100);
  EXPECT_TRUE(panorama->label(after));
  EXPECT_DOUBLE_EQ(after.pan_rad, 0.1);
  EXPECT_EQ(after.position_id, -1);
}

// Six refusals are more than the attempts of one motion.
TEST_F(PanoramaTest, TheReturnToRestIsAwaitedAndTriedAgain) {
  ScriptedUnit unit({0, 0});
  unit.readings = 3;
  unit.refused_returns = 1;
  unit.on_command = [&](const PanTiltAngles& angles) { unit.refused_returns += is_rest(angles) ? 0 : 3; };
  const auto panorama = create(unit);
  int wrong = 0, frames = 0;
  const auto step = [&](double time_s) {
    StereoFrame wide = frame_at_stop("wide", time_s), narrow = frame_at_stop("narrow", time_s);
    panorama->label(wide);
    const bool before = unit.rests(), labelled = panorama->label(narrow), after = unit.rests();
    frames += labelled ? 1 : 0;
    wrong += labelled && !before && !after ? 1 : 0;
  };
  repeat_until([&] { return frames > 0; }, step);
  rest_and_request(*panorama);
  repeat_until([&] { return ended > 0; }, step);
  EXPECT_EQ(ended, 1);
  EXPECT_TRUE(unit.rests());
  EXPECT_EQ(wrong, 0) << "frames with the rest angles while the unit was elsewhere";
  EXPECT_THAT(said, HasSubstr("the odometry waits until the pan-tilt unit has returned to rest"));
  frames = 0;
  repeat_until([&] { return frames > 0; }, step);
  EXPECT_GT(frames, 0) << "the odometry goes on";
}

TEST_F(PanoramaTest, ACancelledOneCommandsNothingButTheReturn) {
  for (const bool silent : {false, true}) {
    ScriptedUnit unit(kRest);
    unit.refused_views = silent ? 100 : 0;
    options.tilts_deg = {10, 20};
    std::unique_ptr<Panorama> panorama;
    unit.on_command = [&](const PanTiltAngles& angles) {
      if (!is_rest(angles)) drive_on(*panorama);
    };
    ended = 0;
    panorama = create(unit);
    begin(*panorama, unit);
    repeat_until([&] { return ended > 0; }, [](double) {});
    const auto commands = unit.commands();
    ASSERT_EQ(commands.size(), 2u);
    EXPECT_FALSE(is_rest(commands[0]));
    EXPECT_TRUE(is_rest(commands[1]));
  }
}

// The newest unused frame at rest, and two at the first angles of a panorama.
TEST_F(PanoramaTest, TheExposureIsSetBeforeTheFirstView) {
  ScriptedUnit unit({0, 0});
  const auto panorama = create(unit);
  wait_for_narrow_frames(*panorama);
  int at_rest = 0, at_first = 0, at_second = 0, views = 0;
  const auto step = [&](double time_s) {
    panorama->meter([&](const StereoFrame& frame) {
      EXPECT_EQ(frame.pair, "wide");
      EXPECT_EQ(views, 0) << "not after the first view";
      ++(frame.position_id < 0 ? at_rest : frame.pan_rad < 0 ? at_first : at_second);
    });
    StereoFrame wide = frame_at_stop("wide", time_s);
    views += panorama->label(wide) ? 1 : 0;
  };
  repeat_until([&] { return at_rest > 3; }, step);
  begin(*panorama, unit);
  repeat_until([&] { return views == 2; }, step);
  EXPECT_EQ(views, 2);
  EXPECT_EQ(at_first, Panorama::kMetered);
  EXPECT_EQ(at_second, 0);
}

// As those of a simulation, which has moved the unit by its own plan.
TEST_F(PanoramaTest, FramesStayAsTheyAreUntilTheFirstOne) {
  ScriptedUnit unit(kRest);
  const auto panorama = create(unit);
  StereoFrame planned = frame_at_stop("wide", 0);
  planned.position_id = 7;
  planned.pan_rad = 0.3;
  EXPECT_TRUE(panorama->label(planned));
  EXPECT_EQ(planned.position_id, 7);
  EXPECT_EQ(planned.pan_rad, 0.3);
  EXPECT_TRUE(unit.commands().empty());
  begin(*panorama, unit);
  StereoFrame narrow = frame_at_stop("narrow", 3);
  EXPECT_FALSE(panorama->label(narrow));
}

// The images of a frame that has one only cannot be matched, so it begins no stop.
TEST_F(PanoramaTest, TheUnitWaitsForAFrameOfTheOdometryOnIt) {
  options.frame_timeout_s = 0.1;
  ScriptedUnit unit(kRest);
  const auto panorama = create(unit);
  rest_and_request(*panorama);
  int labelled = 0;
  repeat_until([&] { return ended > 0; },
               [&](double time_s) {
                 StereoFrame narrow = frame_at_stop("narrow", time_s);
                 narrow.left = FrameImage::own(Image<std::uint8_t>(4, 4), PixelFormat());
                 labelled += panorama->label(narrow) && begun > 0 && ended == 0 ? 1 : 0;
               });
  EXPECT_EQ(ended, 1);
  EXPECT_GT(labelled, 0) << "the odometry uses it";
  for (const PanTiltAngles& angles : unit.commands()) EXPECT_TRUE(is_rest(angles));
  EXPECT_THAT(said, HasSubstr("no panorama: pair 'narrow', which it begins with, has no frame"));
}

TEST_F(PanoramaTest, SaysWhyItDoesNotBegin) {
  ScriptedUnit unit(kRest);
  const auto panorama = create(unit);
  panorama->request();
  for (int i = 0; i < 150; ++i) {
    const Stamp stamp = Stamp::from_seconds(0.1 * i);
    panorama->add(RoverMotion{stamp, 0, Vector6d::Zero()});
    panorama->add(ImuSample{stamp, {0, 0, i % 2 == 0 ? 0.06 : -0.06}, {0, 0, 9.8}});
  }
  EXPECT_EQ(said, "a panorama has waited for 10 s for the rover to be stationary: the gyroscope shows that it moves\n");
  EXPECT_EQ(begun, 0);
}

// Delivers one frame again and again, of which the right image is missing.
class HalfFrames : public SampleStream {
 public:
  explicit HalfFrames(const std::string& pair) {
    missing_.pair = pair;
    missing_.fault = FrameFault::right_missing;
    missing_.partial = frame_at_stop(pair, 0);
    missing_.partial->left = FrameImage::own(Image<std::uint8_t>(4, 4), PixelFormat());
  }
  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds) override {
    return StreamRead{StreamRead::State::sample, missing_, std::chrono::steady_clock::now()};
  }
  std::size_t previews(const std::string&) const override { return 0; }
  Result<StereoFrame> preview(const std::string&, std::size_t) override { return failure(ErrorCode::input, "none"); }

 private:
  StreamInfo info_;
  MissingFrame missing_;
};

TEST_F(PanoramaTest, AFrameOfOneImageHasTheAnglesToo) {
  ScriptedUnit unit({0, 0});
  const auto panorama = create(unit);
  wait_for_narrow_frames(*panorama);
  const auto partial_of = [&](const std::string& pair) {
    HalfFrames half(pair);
    PanoramaStream stream(half, *panorama);
    return std::get<MissingFrame>(*stream.read({})->sample).partial;
  };
  const auto narrow = partial_of("narrow");
  ASSERT_TRUE(narrow);
  EXPECT_EQ(narrow->pan_rad, kRest.pan_rad);
  EXPECT_FALSE(partial_of("wide")) << "no view";
  unit.readings = 1'000'000;
  begin(*panorama, unit);
  EXPECT_FALSE(partial_of("narrow")) << "the unit moves";
}

TEST(Panorama, NeedsAPairBesidesTheOdometrys) {
  ScriptedUnit unit(kRest);
  Rig rig = rig_with_all_on_the_unit();
  rig.pairs.pop_back();
  const auto panorama = Panorama::create(rig, "narrow", {}, unit, nullptr, {});
  ASSERT_FALSE(panorama);
  EXPECT_EQ(panorama.error().code, ErrorCode::configuration);
}

}  // namespace
}  // namespace spartan::internal
