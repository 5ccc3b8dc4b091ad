// Panoramas of a live run: the simulated rover with its own pan-tilt unit, and with an emulated one on a serial line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "small_scenario.h"
#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/system/run.h"
#include "spartan/testing/pan_tilt_emulator.h"
#include "spartan/testing/temporary_folder.h"

#ifdef SPARTAN_HAS_SIM
#include "spartan/sim/internal/live_simulation.h"

namespace spartan {
namespace {

using namespace std::chrono_literals;
using sim::internal::LiveSimulation;
using ::testing::HasSubstr;
using testing::PanTiltEmulator;

constexpr double kDegree = std::numbers::pi / 180;

sim::SimulationRequest small_request(const std::string& capture, const std::string& path = "length_m: 0.3",
                                     const std::string& rig = testing::kSmallRig) {
  std::string text = testing::kSmallScenario;
  const std::string before = "path: {length_m: 0.3}\ncapture: {stops_m: [0]}";
  text.replace(text.find(before), before.size(), "path: {" + path + "}\ncapture: {" + capture + "}");
  sim::SimulationRequest request;
  request.scenario = sim::parse_scenario(text, "small").value();
  request.rig = parse_rig_yaml(rig, "small").value();
  request.drive = sim::plan_drive(request.scenario, request.rig, text, "small").value();
  return request;
}

// The cameras of the simulation are where an emulated unit is.
class MovedSimulation : public SampleStream {
 public:
  MovedSimulation(LiveSimulation& simulation, const PanTiltEmulator& emulator)
      : simulation_(simulation), emulator_(emulator) {}
  const StreamInfo& info() const override { return simulation_.info(); }
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override {
    const double step_rad = PanTiltEmulator::kStep_arcsec / 3600 * kDegree;
    simulation_.set_angles({-emulator_.position('P') * step_rad, -emulator_.position('T') * step_rad});
    return simulation_.read(timeout);
  }
  CameraControl* control() override { return simulation_.control(); }
  std::size_t previews(const std::string& pair) const override { return simulation_.previews(pair); }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override {
    return simulation_.preview(pair, index);
  }

 private:
  LiveSimulation& simulation_;
  const PanTiltEmulator& emulator_;
};

class RunPanorama : public ::testing::Test {
 protected:
  RunRequest request() const {
    RunRequest request;
    request.output = folder_.path() + "/run";
    request.record = true;
    request.options.panorama.every_m = 0.1;
    request.options.panorama.pans_deg = {-20, 0, 20};
    return request;
  }
  // The rover rests until the run has ended, after so many begins and ends of panoramas.
  RunHooks hooks(std::size_t last_event) {
    RunHooks hooks;
    hooks.should_stop = [this, last_event] {
      const std::lock_guard lock(mutex_);
      return events_.size() == last_event;
    };
    hooks.panorama = [this](const PanoramaEvent& event) {
      const std::lock_guard lock(mutex_);
      events_.push_back(event);
    };
    return hooks;
  }
  // Those of a pair.
  std::vector<StereoFrame> recorded_frames(const std::string& pair) const {
    std::vector<StereoFrame> frames;
    const auto recording = open_recording(folder_.path() + "/run/live/1");
    EXPECT_TRUE(recording) << recording.error().message();
    for (auto read = (*recording)->read({}); read && read->sample; read = (*recording)->read({})) {
      const auto* frame = std::get_if<StereoFrame>(&*read->sample);
      if (frame != nullptr && frame->pair == pair) frames.push_back(*frame);
    }
    return frames;
  }

  // Of pan and tilt, as the run has used it.
  double stated_error_deg() const {
    const std::string options = read_file(folder_.path() + "/run/config.yaml").value();
    const std::string key = "pan_tilt_deg:";
    return std::stod(options.substr(options.find(key) + key.size()));
  }
  static double rig_error_deg(const Rig& rig) {
    return rig.calibration_errors ? rig.calibration_errors->pan_tilt_deg : CalibrationErrors().pan_tilt_deg;
  }

  testing::TemporaryFolder folder_;
  std::mutex mutex_;
  std::vector<PanoramaEvent> events_;
};

// The first by itself, the second on command.
TEST_F(RunPanorama, IsTakenWhileTheRoverIsStationary) {
  LiveSimulation simulation(small_request("stops_m: [0], pan_period_s: 100"), 3, ThreadPool(1));
  ASSERT_TRUE(simulation.set_exposure("wide", {20000, 1}));
  RunHooks hooks = this->hooks(4);
  bool asked = false;
  hooks.command = [&]() -> std::optional<RunCommand> {
    const std::lock_guard lock(mutex_);
    if (events_.size() != 2 || asked) return std::nullopt;
    asked = true;
    return RunCommand::panorama;
  };
  const auto outcome = run_live(simulation, request(), hooks);
  ASSERT_TRUE(outcome) << outcome.error().message();
  ASSERT_EQ(events_.size(), 4u) << "two panoramas";
  for (const std::size_t i : {0u, 2u}) {
    EXPECT_TRUE(events_[i].begins);
    EXPECT_FALSE(events_[i + 1].begins);
    EXPECT_EQ(events_[i + 1].views, 3);
    EXPECT_EQ(events_[i + 1].position_id, events_[i].position_id);
  }
  EXPECT_GT(events_[2].position_id, events_[0].position_id);
  const auto views = recorded_frames("wide");
  ASSERT_EQ(views.size(), 6u);
  EXPECT_LT(views[0].exposure_us, 10000) << "controlled before the first view";
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(views[i].pan_rad, (20.0 * static_cast<double>(i % 3) - 20) * kDegree, 1e-9);
    EXPECT_NEAR(views[i].tilt_rad, 65 * kDegree, 1e-6) << "the rest angle";
    EXPECT_EQ(views[i].position_id, events_[i < 3 ? 0 : 2].position_id);
  }
}

std::string small_rig_on_the_mast() {
  std::string rig = testing::kSmallRig;
  for (const std::string y : {"0.06", "-0.06"}) {
    const std::string on_body = "axes: forward, translation_m: [0, " + y + ", 0.3], roll_pitch_yaw_deg: [0, 60, 0]";
    rig.replace(rig.find(on_body), on_body.size(), "mount: mast, axes: forward, translation_m: [0, " + y + ", 0.1]");
  }
  return rig;
}

TEST_F(RunPanorama, BecomesAMapWhereTheOdometryIsOnTheUnitToo) {
  LiveSimulation simulation(small_request("stops_m: [0], pan_period_s: 0.1, frame_period_s: 1",
                                          "kind: standing, stationary_s: 100", small_rig_on_the_mast()),
                            3, ThreadPool(1));
  RunRequest request = this->request();
  request.options.panorama.every_m = 10;
  request.options.stop_delay_frames = 0;
  request.options.panorama.settle_s = 0.05;
  RunHooks hooks = this->hooks(100);
  std::int64_t id_of_map = -1;
  int views_of_map = 0;
  const auto until = std::chrono::steady_clock::now() + 60s;
  hooks.map = [&](const MappedStop& map, bool) {
    id_of_map = map.position_id;
    views_of_map = map.views;
  };
  hooks.should_stop = [&] { return views_of_map > 0 || std::chrono::steady_clock::now() > until; };
  const auto outcome = run_live(simulation, request, hooks);
  ASSERT_TRUE(outcome) << outcome.error().message();
  ASSERT_EQ(events_.size(), 2u);
  EXPECT_EQ(events_[1].views, 3);
  EXPECT_EQ(id_of_map, events_[0].position_id);
  EXPECT_EQ(views_of_map, 4) << "and a frame of the odometry";
  const auto frames = recorded_frames("narrow");
  const auto is_at_stop = [&](const StereoFrame& f) { return f.position_id == id_of_map; };
  EXPECT_TRUE(std::any_of(frames.begin(), frames.end(), is_at_stop)) << "so that the recording has the map, too";
  EXPECT_EQ(frames.back().position_id, -1);
}

// The unit loses its power in the middle, and the line is noisy.
TEST_F(RunPanorama, ByAnEmulatedUnitOnASerialLine) {
  LiveSimulation simulation(small_request("stops_m: [0], pan_period_s: 100"), 2, ThreadPool(1));
  PanTiltEmulator emulator(3000);
  MovedSimulation stream(simulation, emulator);
  RunRequest request = this->request();
  request.options.panorama.every_m = 10;
  request.options.panorama.tilts_deg = {45};
  request.pan_tilt = "flir:" + emulator.device();
  RunHooks hooks = this->hooks(2);
  hooks.panorama = [&, record = hooks.panorama](const PanoramaEvent& event) {
    record(event);
    if (event.begins) emulator.lose_power(300ms);
    emulator.send_garbage(5);
  };
  const auto outcome = run_live(stream, request, hooks);
  ASSERT_TRUE(outcome) << outcome.error().message();
  ASSERT_EQ(events_.size(), 2u);
  EXPECT_EQ(events_[1].views, 3);
  const auto views = recorded_frames("wide");
  ASSERT_EQ(views.size(), 3u);
  const double step_rad = PanTiltEmulator::kStep_arcsec / 3600 * kDegree;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(views[i].pan_rad, (20.0 * static_cast<double>(i) - 20) * kDegree, step_rad);
    EXPECT_NEAR(views[i].tilt_rad, 45 * kDegree, step_rad);
  }
  // What its steps leave of an angle enters the variance of the maps, beside the error of its calibration.
  EXPECT_NEAR(stated_error_deg(),
              std::hypot(rig_error_deg(simulation.info().rig), step_rad / kDegree / std::sqrt(12.0)), 1e-9);
}

// Until a panorama is asked for, the rover takes the views that its scenario plans.
TEST_F(RunPanorama, CommandsThatDoNotComeChangeNothing) {
  std::vector<std::string> frames;
  for (const bool with_commands : {false, true}) {
    LiveSimulation simulation(small_request("stops_m: [0]"), 0, ThreadPool(1));
    RunRequest request = this->request();
    request.options.panorama.every_m = 0;
    request.options.exposure.enabled = false;  // when a setting has effect depends on the time
    request.output += with_commands ? "_with" : "_without";
    RunHooks hooks;
    if (with_commands) hooks.command = [] { return std::optional<RunCommand>(); };
    const auto outcome = run_live(simulation, request, hooks);
    ASSERT_TRUE(outcome) << outcome.error().message();
    frames.push_back(read_file(request.output + "/live/1/frames.csv").value());
  }
  EXPECT_THAT(frames[0], HasSubstr("wide"));
  EXPECT_EQ(frames[0], frames[1]);
}

// The cameras of the simulation are on a unit that is less exact.
class RoughSimulation : public StreamDecorator, public PanTiltControl {
 public:
  explicit RoughSimulation(LiveSimulation& simulation) : StreamDecorator(simulation), unit_(simulation) {}
  PanTiltControl* pan_tilt() override { return this; }
  Status move_to(const PanTiltAngles& angles) override { return unit_.move_to(angles); }
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override { return behind().read(timeout); }
  Result<PanTiltReading> read() override { return unit_.read(); }
  double sigma_rad() const override { return 0.2 * kDegree; }

 private:
  PanTiltControl& unit_;
};

TEST_F(RunPanorama, TheErrorOfTheStreamsOwnUnitEntersTheMaps) {
  LiveSimulation simulation(small_request("stops_m: [0]"), 0, ThreadPool(1));
  RoughSimulation stream(simulation);
  RunRequest request = this->request();
  request.max_frames = 1;
  const auto outcome = run_live(stream, request, RunHooks());
  ASSERT_TRUE(outcome) << outcome.error().message();
  EXPECT_NEAR(stated_error_deg(), std::hypot(rig_error_deg(simulation.info().rig), 0.2), 1e-9);
}

TEST_F(RunPanorama, NeedsAUnit) {
  LiveSimulation simulation(small_request("stops_m: [0]"), 0, ThreadPool(1));
  const PanTiltEmulator emulator;
  MovedSimulation without_unit(simulation, emulator);
  const auto outcome = run_live(without_unit, request(), RunHooks());
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, ErrorCode::usage);
  EXPECT_THAT(outcome.error().message(), HasSubstr("--pan-tilt"));
  RunRequest wrong = request();
  wrong.pan_tilt = "flir:/nowhere";
  EXPECT_FALSE(run_live(simulation, wrong, RunHooks()));
}

}  // namespace
}  // namespace spartan
#endif
