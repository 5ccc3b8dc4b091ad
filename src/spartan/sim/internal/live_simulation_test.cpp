#include "spartan/sim/internal/live_simulation.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace spartan::sim::internal {
namespace {

using std::chrono::milliseconds;

constexpr const char* kRig = R"(schema: 1
name: small
pan_tilt_units:
  mast: {translation_m: [0, 0, 0.8], rest_angles_deg: [0, 65]}
cameras:
  wl: {size_px: [48, 48], model: pinhole, focal_px: [65, 65], centre_px: [23.5, 23.5], mount: mast, axes: forward, translation_m: [0, 0.1, 0]}
  wr: {size_px: [48, 48], model: pinhole, focal_px: [65, 65], centre_px: [23.5, 23.5], mount: mast, axes: forward, translation_m: [0, -0.1, 0]}
  nl: {size_px: [48, 36], model: pinhole, focal_px: [50, 50], centre_px: [23.5, 17.5], axes: forward, translation_m: [0, 0.06, 0.3], roll_pitch_yaw_deg: [0, 60, 0]}
  nr: {size_px: [48, 36], model: pinhole, focal_px: [50, 50], centre_px: [23.5, 17.5], axes: forward, translation_m: [0, -0.06, 0.3], roll_pitch_yaw_deg: [0, 60, 0]}
pairs:
  wide: {left: wl, right: wr, nearest_m: 0.6, for_odometry: false}
  narrow: {left: nl, right: nr, nearest_m: 0.25}
)";

constexpr const char* kScenario = R"(schema: 1
name: small
samples: 1
rig: small
capture: {stops_m: [0]}
)";

SimulationRequest request_of(const std::string& more = "") {
  const std::string length = more.find("path:") == std::string::npos ? "path: {length_m: 0.2}\n" : "";
  const std::string text = kScenario + length + more;
  SimulationRequest request;
  request.scenario = parse_scenario(text, "scenario").value();
  request.rig = parse_rig_yaml(kRig, "rig").value();
  request.drive = plan_drive(request.scenario, request.rig, text, "scenario").value();
  return request;
}

std::vector<Sample> all_of(SampleStream& stream) {
  std::vector<Sample> samples;
  for (;;) {
    auto read = stream.read(milliseconds(0));
    EXPECT_TRUE(read);
    if (!read || read->state == StreamRead::State::end) return samples;
    if (read->sample) samples.push_back(std::move(*read->sample));
  }
}

// Without the last sample of the stream that is no frame.
std::vector<StereoFrame> frames_of(const std::vector<Sample>& samples, const std::string& pair) {
  std::vector<StereoFrame> frames;
  for (const Sample& sample : samples) {
    const auto* frame = std::get_if<StereoFrame>(&sample);
    if (frame != nullptr && frame->pair == pair) frames.push_back(*frame);
  }
  return frames;
}

double mean_of(const FrameImage& image) {
  const auto pixels = image.as<std::uint8_t>();
  double sum = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) sum += pixels(x, y);
  }
  return sum / (static_cast<double>(image.width()) * image.height());
}

bool same(const FrameImage& a, const FrameImage& b) {
  const auto x = a.as<std::uint8_t>(), y = b.as<std::uint8_t>();
  for (int row = 0; row < a.height(); ++row) {
    for (int column = 0; column < a.width(); ++column) {
      if (x(column, row) != y(column, row)) return false;
    }
  }
  return true;
}

TEST(LiveSimulation, DeliversWhatARecordingHas) {
  LiveSimulation live(request_of(), 0, ThreadPool(1));
  const std::vector<Sample> samples = all_of(live);
  const SimulationRequest request = request_of();
  FrameSimulator recorded(request, ThreadPool(1));
  std::map<std::string, Stamp> last;
  std::size_t frames = 0;
  for (const Sample& sample : samples) {
    const auto before = last.find(source_of(sample));
    if (before != last.end()) {
      EXPECT_LT(before->second, stamp_of(sample)) << source_of(sample);
    }
    last[source_of(sample)] = stamp_of(sample);
    const auto* frame = std::get_if<StereoFrame>(&sample);
    if (frame == nullptr) continue;
    ++frames;
    const auto i = static_cast<std::size_t>(frame->frame_id);
    const StereoFrame expected = recorded.render(i, recorded.fault_at(i)).frame;
    EXPECT_EQ(frame->left_stamp, expected.left_stamp);
    EXPECT_EQ(frame->exposure_us, expected.exposure_us);
    EXPECT_TRUE(same(frame->left, expected.left)) << i;
    EXPECT_TRUE(same(frame->right, expected.right)) << i;
  }
  EXPECT_EQ(frames, request.drive.frames().size());
  EXPECT_TRUE(live.info().has_imu);
  EXPECT_EQ(last.size(), 6u) << "two pairs, four motion sensors";
}

TEST(LiveSimulation, ImagesArriveLaterThanTheSamplesOfOtherSensors) {
  LiveSimulation live(request_of("arrival: {delay_ms: 50, jitter_ms: 10}\n"), 0, ThreadPool(1));
  Stamp newest;
  double shortest_s = 1;
  for (const Sample& sample : all_of(live)) {
    if (std::holds_alternative<ImuSample>(sample)) newest = stamp_of(sample);
    const auto* frame = std::get_if<StereoFrame>(&sample);
    if (frame != nullptr && newest.ns > 0)
      shortest_s = std::min(shortest_s, seconds_between(frame->left_stamp, newest));
  }
  EXPECT_GT(shortest_s, 0.035) << "the IMU has samples every 10 ms";
}

TEST(LiveSimulation, ASettingAppliesToTheNextImageOfItsPair) {
  LiveSimulation live(request_of("path: {length_m: 0.5}\n"), 0, ThreadPool(1));
  std::vector<StereoFrame> frames;
  for (;;) {
    const auto read = live.read(milliseconds(0));
    ASSERT_TRUE(read);
    if (read->state == StreamRead::State::end) break;
    const auto* frame = std::get_if<StereoFrame>(&*read->sample);
    if (frame == nullptr || frame->pair != "narrow") continue;
    frames.push_back(*frame);
    if (frames.size() == 2) {
      ASSERT_TRUE(live.set_exposure("narrow", {0.25 * frame->exposure_us, frame->gain}));
    }
  }
  ASSERT_GT(frames.size(), 4u);
  EXPECT_NEAR(frames[3].exposure_us, 0.25 * frames[1].exposure_us, 1e-6);
  EXPECT_EQ(frames.back().exposure_us, frames[3].exposure_us);
  EXPECT_NEAR(mean_of(frames[3].left) / mean_of(frames[1].left), 0.25, 0.1);
  EXPECT_NEAR(mean_of(frames[3].right) / mean_of(frames[1].right), 0.25, 0.1);
}

TEST(LiveSimulation, RefusesImpossibleSettings) {
  LiveSimulation live(request_of(), 0, ThreadPool(1));
  EXPECT_FALSE(live.set_exposure("nowhere", {1000, 1}));
  EXPECT_FALSE(live.set_exposure("narrow", {0, 1}));
  EXPECT_FALSE(live.set_exposure("narrow", {1000, 0.5}));
  EXPECT_FALSE(live.set_exposure("narrow", {std::nan(""), 1}));
}

TEST(LiveSimulation, TheMastLooksWhereItIsToldToAndWaitsForTriggers) {
  LiveSimulation live(request_of(), 0, ThreadPool(1)), planned(request_of(), 0, ThreadPool(1));
  live.set_angles({0.3, 1.0});
  ASSERT_TRUE(live.trigger("wide"));
  ASSERT_TRUE(live.trigger("wide"));
  EXPECT_FALSE(live.trigger("nowhere"));
  const auto told = frames_of(all_of(live), "wide"), as_planned = frames_of(all_of(planned), "wide");
  ASSERT_EQ(told.size(), 2u);
  EXPECT_NE(told[0].frame_id, told[1].frame_id);
  for (const StereoFrame& frame : told) {
    EXPECT_EQ(frame.pan_rad, 0.3);
    EXPECT_EQ(frame.tilt_rad, 1.0);
    for (const StereoFrame& other : as_planned) {
      EXPECT_FALSE(same(frame.left, other.left));
      EXPECT_NE(frame.frame_id, other.frame_id);
    }
  }
}

TEST(LiveSimulation, HasNoPanTiltUnitWhereNoCameraIsOnOne) {
  SimulationRequest request = request_of();
  EXPECT_NE(LiveSimulation(request, 0, ThreadPool(1)).pan_tilt(), nullptr);
  std::erase_if(request.rig.pairs, [](const StereoPair& pair) { return pair.name == "wide"; });
  EXPECT_EQ(LiveSimulation(request, 0, ThreadPool(1)).pan_tilt(), nullptr);
}

TEST(LiveSimulation, ThePanTiltUnitTakesItsTime) {
  LiveSimulation live(request_of(), 0, ThreadPool(1));
  const auto rest = live.read();
  ASSERT_TRUE(rest);
  EXPECT_FALSE(rest->moves);
  EXPECT_FALSE(live.move_to({4, 0}));
  EXPECT_FALSE(live.move_to({0, 2}));
  ASSERT_TRUE(live.move_to({1, rest->angles.tilt_rad}));
  EXPECT_TRUE(live.read()->moves);
  std::optional<Stamp> first;
  double settled_s = 0;
  for (;;) {
    const auto read = live.read(milliseconds(0));
    ASSERT_TRUE(read);
    if (read->state == StreamRead::State::end) break;
    if (!first) first = stamp_of(*read->sample);
    const auto unit = live.read();
    if (settled_s == 0 && !unit->moves) settled_s = seconds_between(*first, stamp_of(*read->sample));
  }
  EXPECT_NEAR(settled_s, 1 / LiveSimulation::kPanTiltRate_rad_s, 0.1);
  EXPECT_EQ(live.read()->angles.pan_rad, 1);
}

TEST(LiveSimulation, RunsAtItsPace) {
  using Clock = std::chrono::steady_clock;
  LiveSimulation live(request_of("imu: {rate_hz: 50}\n"), 4, ThreadPool(1));
  const auto begin = Clock::now();
  std::size_t early = 0;
  std::optional<Stamp> first;
  Stamp newest;
  for (;;) {
    const auto read = live.read(milliseconds(20));
    ASSERT_TRUE(read);
    if (read->state == StreamRead::State::end) break;
    if (!read->sample) continue;
    newest = stamp_of(*read->sample);
    if (!first) first = newest;
    const std::chrono::duration<double> passed = Clock::now() - begin;
    early += passed.count() < seconds_between(*first, newest) / 4 - 0.001;
  }
  EXPECT_EQ(early, 0u) << "no sample comes before its time";
}

TEST(LiveSimulation, CanBeginLater) {
  LiveSimulation whole(request_of(), 0, ThreadPool(1)), rest(request_of(), 0, ThreadPool(1));
  const std::vector<Sample> samples = all_of(whole);
  const Stamp middle = stamp_of(samples[samples.size() / 2]);
  rest.start_after(middle);
  std::size_t later = 0;
  for (const Sample& sample : samples) later += stamp_of(sample) > middle;
  const std::vector<Sample> remaining = all_of(rest);
  EXPECT_EQ(remaining.size(), later);
  for (const Sample& sample : remaining) EXPECT_GT(stamp_of(sample), middle);
}

}  // namespace
}  // namespace spartan::sim::internal
