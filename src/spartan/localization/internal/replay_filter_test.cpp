#include "spartan/localization/internal/replay_filter.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "spartan/localization/internal/drive_test.h"

namespace spartan::internal {
namespace {

Bytes bytes_of(const FilterMemory& memory) {
  ArchiveWriter out;
  put(out, memory);
  return out.take();
}

Bytes saved(const ReplayFilter& filter) {
  ArchiveWriter out;
  filter.put(out);
  return out.take();
}

// A short drive with all sensors, 4.5 s after the start, the IMU at 20 Hz.
const std::vector<Measurement>& short_drive() {
  static const std::vector<Measurement> all = [] {
    const TestDrive drive;
    auto samples = in_order(test_samples(drive, 7, {}, 31), test_motions(drive, 7, 1, 32));
    samples.emplace_back(PoseConstraint{test_stamp(4.2), Pose(), 1e-3 * Matrix6d::Identity()});
    std::erase_if(samples, [](const Measurement& m) {
      return std::holds_alternative<ImuSample>(m) && stamp_of_measurement(m).ns % 50'000'000 != 0;
    });
    std::stable_sort(samples.begin(), samples.end(), comes_before);
    return samples;
  }();
  return all;
}

ReplayFilter started_filter(const LocalizationOptions& options) {
  ReplayFilter filter(options);
  for (const Measurement& m : short_drive()) {
    if (stamp_of_measurement(m) <= test_stamp(2.5)) filter.add(m);
  }
  filter.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
  return filter;
}

std::vector<Measurement> after_start() {
  std::vector<Measurement> rest;
  for (const Measurement& m : short_drive()) {
    if (stamp_of_measurement(m) > test_stamp(2.5)) rest.push_back(m);
  }
  return rest;
}

const Bytes& in_order_result() {
  static const Bytes bytes = [] {
    ReplayFilter filter = started_filter(test_options());
    for (const Measurement& m : after_start()) filter.add(m);
    return bytes_of(filter.newest().memory());
  }();
  return bytes;
}

RC_GTEST_PROP(ReplayFilter, OrderOfArrivalDoesNotMatterWithinTheBuffer, (std::uint32_t seed)) {
  // Every sample comes late by up to 0.5 s (some by 2 s), at random.
  Random random(seed);
  std::vector<std::pair<double, Measurement>> arrivals;
  for (const Measurement& m : after_start()) {
    const double delay = random.uniform() < 0.02 ? random.uniform(0, 2) : random.uniform(0, 0.5);
    arrivals.emplace_back(stamp_of_measurement(m).seconds() + delay, m);
  }
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  ReplayFilter filter = started_filter(test_options());
  for (const auto& [time, m] : arrivals) RC_ASSERT(!filter.add(m).has_value());
  RC_ASSERT(bytes_of(filter.newest().memory()) == in_order_result());
}

RC_GTEST_PROP(ReplayFilter, ContinuesBitForBitFromASavedMemory, (std::uint32_t seed)) {
  Random random(seed);
  const auto rest = after_start();
  const std::size_t until = random.below(static_cast<std::uint32_t>(rest.size()));
  ReplayFilter filter = started_filter(test_options());
  for (std::size_t i = 0; i < until; ++i) filter.add(rest[i]);
  const Bytes bytes = saved(filter);
  ReplayFilter other(test_options());
  ArchiveReader in(bytes);
  RC_ASSERT(other.get(in));
  RC_ASSERT(in.finish("").has_value());
  RC_ASSERT(saved(other) == bytes);
  // One late sample.
  for (ReplayFilter* each : {&filter, &other}) {
    for (std::size_t i = until; i < rest.size(); ++i) each->add(rest[i]);
    each->add(CompassSample{test_stamp(5.123), 0.01, 0.02});
  }
  RC_ASSERT(saved(other) == saved(filter));
}

TEST(ReplayFilter, RefusesLateAndDuplicateSamples) {
  LocalizationOptions o = test_options();
  o.buffer_s = 1;
  ReplayFilter filter = started_filter(o);
  for (const Measurement& m : after_start()) filter.add(m);
  EXPECT_EQ(filter.add(WheelSample{test_stamp(5.9), 0, 0}), Refusal::too_late);
  EXPECT_EQ(filter.add(CompassSample{test_stamp(7), 0, 0.1}), Refusal::duplicate);
  EXPECT_EQ(filter.add(CompassSample{test_stamp(6.5), 0, 0.1}), std::nullopt);
  ReplayFilter wide = started_filter(test_options());
  EXPECT_EQ(wide.add(WheelSample{test_stamp(2.4), 0, 0}), Refusal::too_late);  // before the start
}

TEST(ReplayFilter, AppliesAConstraintThatIsOlderThanTheBuffer) {
  LocalizationOptions o = test_options();
  o.buffer_s = 0.5;
  ReplayFilter filter = started_filter(o);
  for (const Measurement& m : after_start()) {
    if (stamp_of_measurement(m) < test_stamp(7)) filter.add(m);
  }
  const Stamp frame = filter.newest().memory().vision.clone_stamp;
  ASSERT_GT(seconds_between(frame, test_stamp(6.9)), o.buffer_s);
  const Pose seen = filter.newest().memory().estimate.state.world_from_vision_clone;
  ASSERT_FALSE(filter.add(PoseConstraint{frame, seen, 1e6 * Matrix6d::Identity()}));
  const Bytes bytes = saved(filter);
  ReplayFilter other(o);
  ArchiveReader in(bytes);
  ASSERT_TRUE(other.get(in));
  ASSERT_TRUE(in.finish(""));
  // Both replay it after a sample that arrives even later.
  for (ReplayFilter* each : {&filter, &other}) each->add(CompassSample{test_stamp(6.501), 0.01, 0.02});
  EXPECT_EQ(saved(other), saved(filter));
  EXPECT_EQ(other.newest().memory().monitor(LocalizationSensor::map).used, 2) << "the one of the drive and this one";
}

TEST(ReplayFilter, DiscardsOldEntries) {
  LocalizationOptions o = test_options();
  o.buffer_s = 1;
  ReplayFilter filter = started_filter(o);
  std::size_t largest = 0;
  for (const Measurement& m : after_start()) {
    filter.add(m);
    largest = std::max(largest, saved(filter).size());
  }
  ReplayFilter all = started_filter(test_options());
  for (const Measurement& m : after_start()) all.add(m);
  EXPECT_LT(2 * (largest - bytes_of(FilterMemory{}).size()), saved(all).size() - bytes_of(FilterMemory{}).size());
  EXPECT_EQ(bytes_of(filter.newest().memory()), bytes_of(all.newest().memory()));
}

TEST(ReplayFilter, RefusesADamagedMemory) {
  Bytes bytes = saved(started_filter(test_options()));
  bytes.resize(bytes.size() / 2);
  ReplayFilter filter(test_options());
  ArchiveReader in(bytes);
  const bool sensible = filter.get(in);
  EXPECT_FALSE(sensible && in.finish("").has_value());
}

}  // namespace
}  // namespace spartan::internal
