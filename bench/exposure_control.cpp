// Exposure control in closed loop with the simulator. `make bench-exposure_control`.
//
//   exposure_control [--images FOLDER] [--delay MS] [EVENT...]
//
// A rover drives 4 m at 0.3 m/s over rocky ground with 10 frames per second. The light changes in each event; a frame
// arrives 30 to 45 ms after its exposure, so that a setting applies to the next one. Each event runs with exposure
// control, and with the exposure fixed that was right before the event. Printed: frames until the median of the ground
// stays within 25 % of its level, the overshoot, frames with saturated (more than 5 % of the ground at full scale) and
// dark ground (median below a quarter of the level), changes of the settings in the last 30 frames, and lost frames and
// drift of the odometry up to the last frame that is not lost. --images writes the brightest and the darkest frame of
// each event.
#include "spartan/imaging/exposure_control.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spartan/core/threads.h"
#include "spartan/core/trajectory.h"
#include "spartan/image_io/image_io.h"
#include "spartan/sim/internal/live_simulation.h"
#include "spartan/system/internal/exposure_stage.h"
#include "spartan/system/pipeline.h"

namespace spartan {
namespace {

using sim::internal::LiveSimulation;

// The narrow pair of the standard rover at half resolution.
constexpr const char* kRig = R"(schema: 1
name: half
cameras:
  left: {size_px: [320, 240], model: pinhole, focal_px: [246.3784, 246.3784], centre_px: [159.5, 119.5], axes: forward, translation_m: [0, 0.06, 0.30], roll_pitch_yaw_deg: [0, 31.55, 0]}
  right: {size_px: [320, 240], model: pinhole, focal_px: [246.3784, 246.3784], centre_px: [159.5, 119.5], axes: forward, translation_m: [0, -0.06, 0.30], roll_pitch_yaw_deg: [0, 31.55, 0]}
pairs:
  narrow: {left: left, right: right, nearest_m: 0.3}
)";
constexpr const char* kScenario = R"(schema: 1
name: exposure
samples: 2
rig: half
rocks: {coverage: 0.10}
path: {kind: winding, length_m: 4, swing_deg: 10, wavelength_m: 8, speed_m_s: 0.3, ramp_s: 1}
capture: {frame_step_m: 0.03, frame_period_s: 0.1, stops_m: []}
)";
constexpr double kEvent_s = 4;           // when the light changes
constexpr double kCloud_s = 4;           // how long a cloud lasts
constexpr double kWithin = 1.25;         // settled: median within this ratio of the level
constexpr std::size_t kLastFrames = 30;  // in which the exposure should not change

// Factor on the light from a time on.
struct LightStep {
  double from_s, to_s, factor;
};

struct Event {
  std::string name;
  std::string light;  // of the scenario
  std::vector<LightStep> steps;
  std::optional<ExposureSettings> first;  // else settled before the event
};

std::vector<LightStep> ramp(double to_factor, double seconds) {
  constexpr int kSteps = 40;
  std::vector<LightStep> steps;
  for (int i = 1; i <= kSteps; ++i) {
    const double from_s = kEvent_s + seconds * (i - 1) / kSteps, to_s = kEvent_s + seconds * i / kSteps;
    steps.push_back({from_s, i == kSteps ? 1000 : to_s, std::pow(to_factor, static_cast<double>(i) / kSteps)});
  }
  return steps;
}

std::vector<Event> all_events() {
  const std::string sun, evening = "light: {sun_lux: 9000, sun_elevation_deg: 8, sun_azimuth_deg: 60, sky_lux: 1500}\n";
  const double overcast = 200.0 / 20000;
  return {{"start at 20 ms in the sun", sun, {}, ExposureSettings{20000, 1}},
          {"start at 0.02 ms in the sun", sun, {}, ExposureSettings{20, 1}},
          {"cloud of 4 s, 15 % of the light", sun, {{kEvent_s, kEvent_s + kCloud_s, 0.15}}, {}},
          {"sun to 200 lux at once", sun, {{kEvent_s, 1000, overcast}}, {}},
          {"sun to 200 lux in 4 s", sun, ramp(overcast, 4), {}},
          {"200 lux to sun at once", sun, {{0, kEvent_s, overcast}}, {}},
          {"long shadows, sun at 8 degrees", evening, {}, ExposureSettings{2000, 1}},
          {"night edge: to 2 % in 6 s", evening, ramp(0.02, 6), {}},
          {"night: to 0.01 % in 6 s", evening, ramp(1e-4, 6), {}}};
}

sim::SimulationRequest request_of(const Event& event, double delay_ms) {
  const std::string text = kScenario + event.light + fmt::format("arrival: {{delay_ms: {}}}\n", delay_ms);
  sim::SimulationRequest request;
  request.scenario = sim::parse_scenario(text, "exposure").value();
  for (const LightStep& step : event.steps) {
    request.scenario.camera_faults.push_back(
        {sim::CameraFaultKind::brightness_step, "", step.from_s, step.to_s, step.factor});
  }
  request.rig = parse_rig_yaml(kRig, "half").value();
  request.drive = sim::plan_drive(request.scenario, request.rig, text, "exposure").value();
  return request;
}

struct FrameState {
  double time_s = 0;
  GroundBrightness ground;
  ExposureSettings taken;
  bool lost = false;
};

struct Drive {
  std::vector<FrameState> frames;
  double drift_percent = 0;
  StereoFrame brightest, darkest;
};

// Without control the exposure stays as it is when the event begins.
Drive drive(const Event& event, double delay_ms, bool controlled) {
  sim::SimulationRequest request = request_of(event, delay_ms);
  const ThreadPool workers(2);
  LiveSimulation live(std::move(request), 0, workers);
  const Rig& rig = live.info().rig;
  RunOptions options;
  options.odometry_only = true;
  Pipeline pipeline = Pipeline::create(rig, options, workers).value();
  auto stage = internal::ExposureStage::create(rig, options.exposure, "", live, Log()).value();
  const GroundMeter meter = GroundMeter::create(rig, rig.pairs[0], "").value();
  if (event.first) static_cast<void>(live.set_exposure("narrow", *event.first));
  Drive result;
  Pose first_body, last_body, first_true, last_true;
  double path_m = 0, brightest = -1, darkest = 2;
  const auto next = [&] { return live.read(std::chrono::nanoseconds(0)); };
  for (auto read = next(); read && read->sample; read = next()) {
    const auto* frame = std::get_if<StereoFrame>(&*read->sample);
    if (frame == nullptr) continue;
    const double time_s = live.request().drive.frames()[static_cast<std::size_t>(frame->frame_id)].time_s;
    FrameState state{time_s, meter.measure(*frame, pipeline.up_in_body()), {frame->exposure_us, frame->gain}};
    const bool holds = !controlled && (event.first || state.time_s > kEvent_s - 0.2);
    if (!holds) stage.update(*frame, pipeline.up_in_body(), pipeline.body_velocity());
    const auto done = pipeline.add(*frame);
    state.lost = !done || !*done || (*done)->motion.status == TrackingStatus::lost;
    if (!state.lost) {
      const Pose truth = live.frames().motion().world_from_body(time_s);
      if (result.frames.empty()) first_body = (*done)->world_from_body.pose, first_true = truth;
      if (!result.frames.empty()) path_m += (truth.translation() - last_true.translation()).norm();
      last_body = (*done)->world_from_body.pose;
      last_true = truth;
    }
    if (state.ground.median > brightest) {
      brightest = state.ground.median;
      result.brightest = *frame;
    }
    if (state.ground.median < darkest) {
      darkest = state.ground.median;
      result.darkest = *frame;
    }
    result.frames.push_back(state);
  }
  const Pose error = (first_true.inverse() * last_true).inverse() * (first_body.inverse() * last_body);
  result.drift_percent = 100 * error.translation().norm() / path_m;
  return result;
}

struct Score {
  int settled_after = -1;  // frames after the light stops changing; -1: never
  double overshoot_percent = 0;
  int saturated = 0, dark = 0, late_changes = 0, lost = 0;
};

Score score_of(const Event& event, const Drive& drive) {
  const double level = 0.01 * ExposureOptions().level_percent;
  // Of the last change of the light within the drive.
  double event_s = event.first ? 0 : kEvent_s;
  for (const LightStep& step : event.steps) event_s = std::max(event_s, step.to_s < 100 ? step.to_s : step.from_s);
  Score score;
  std::size_t begin = 0, last_outside = 0;
  while (begin < drive.frames.size() && drive.frames[begin].time_s < event_s) ++begin;
  bool outside = false;
  double first_sign = 0;
  for (std::size_t i = 0; i < drive.frames.size(); ++i) {
    const FrameState& frame = drive.frames[i];
    score.saturated += frame.ground.saturated > internal::ExposureStatistics::kSaturated;
    score.dark += frame.ground.median < internal::ExposureStatistics::kDark * level;
    score.lost += frame.lost;
    const bool changed = i > 0 && (frame.taken.exposure_us != drive.frames[i - 1].taken.exposure_us ||
                                   frame.taken.gain != drive.frames[i - 1].taken.gain);
    if (i + kLastFrames >= drive.frames.size()) score.late_changes += changed;
    if (i < begin) continue;
    const double off = std::log(frame.ground.median / level);
    if (std::abs(off) > std::log(kWithin)) {
      outside = true;
      last_outside = i;
    }
    if (first_sign == 0 && std::abs(off) > std::log(kWithin)) first_sign = off > 0 ? 1 : -1;
    if (off * first_sign < 0)
      score.overshoot_percent = std::max(score.overshoot_percent, 100 * (std::exp(std::abs(off)) - 1));
  }
  if (!outside) score.settled_after = 0;
  if (outside && last_outside + 1 < drive.frames.size())
    score.settled_after = static_cast<int>(last_outside + 1 - begin);
  return score;
}

void save(const StereoFrame& frame, const std::string& path) {
  if (!write_png(path, frame.left.as<std::uint8_t>())) fmt::print(stderr, "cannot write {}\n", path);
}

void print_row(const Event& event, bool controlled, const Drive& driven) {
  const Score score = score_of(event, driven);
  const FrameState& last = driven.frames.back();
  fmt::print("| {} | {} | {} | {:.0f} | {} | {} | {} | {} of {} | {:.2f} | {:.2f} ms, {:.1f} |\n", event.name,
             controlled ? "controlled" : "fixed",
             score.settled_after < 0 ? "never" : std::to_string(score.settled_after), score.overshoot_percent,
             score.saturated, score.dark, score.late_changes, score.lost, driven.frames.size(), driven.drift_percent,
             1e-3 * last.taken.exposure_us, last.taken.gain);
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  std::string images;
  double delay_ms = 30;
  std::vector<std::string> wanted;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--images" && i + 1 < argc) {
      images = argv[++i];
    } else if (word == "--delay" && i + 1 < argc) {
      delay_ms = std::atof(argv[++i]);
    } else {
      wanted.push_back(word);
    }
  }
  fmt::print(
      "| event | exposure | settled after, frames | overshoot, % | saturated frames | dark frames | changes in the "
      "last "
      "{} frames | lost frames | drift, % | last exposure and gain |\n|---|---|---|---|---|---|---|---|---|---|\n",
      kLastFrames);
  int number = 0;
  for (const Event& event : all_events()) {
    ++number;
    const bool named = std::any_of(wanted.begin(), wanted.end(),
                                   [&](const std::string& w) { return event.name.find(w) != std::string::npos; });
    if (!wanted.empty() && !named) continue;
    for (const bool controlled : {false, true}) {
      const Drive driven = drive(event, delay_ms, controlled);
      print_row(event, controlled, driven);
      if (images.empty()) continue;
      const std::string stem = fmt::format("{}/{}_{}", images, number, controlled ? "controlled" : "fixed");
      save(driven.brightest, stem + "_brightest.png");
      save(driven.darkest, stem + "_darkest.png");
    }
  }
  return 0;
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run(argc, argv);
}
