#include "spartan/eval/trajectory_metrics.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>
#include <sstream>

#include "spartan/numerics/random.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

Stamp frame_time(int i) {
  return Stamp{i * 100'000'000LL};
}

// A winding drive with steps of different length, and an estimate of it with accumulating noise.
struct Drive {
  Trajectory truth, estimate;
};
Drive noisy_drive(std::uint64_t seed, int frames, double step_m = 0.7) {
  Random random(seed);
  Drive drive;
  Pose truth(exp_so3({0.1, -0.2, 2.0}), {5, -3, 1});
  Pose estimate(exp_so3({0, 0, 0.4}), {0, 0, 0});
  for (int i = 0; i < frames; ++i) {
    drive.truth.push_back({frame_time(i), truth});
    drive.estimate.push_back({Stamp{frame_time(i).ns + random.below(2'000'000)}, estimate});
    Vector6d motion, error;
    motion << step_m * random.uniform(0.3, 1.7), 0, 0.02 * random.normal(), 0.01 * random.normal(),
        0.01 * random.normal(), 0.1 * std::sin(0.1 * i);
    for (int k = 0; k < 6; ++k) error[k] = 0.01 * random.normal();
    truth = truth * exp_se3(motion);
    estimate = estimate * exp_se3(1.03 * motion + error);
  }
  return drive;
}

TrajectoryMetrics compare(const Drive& drive, const TrajectoryMetricsOptions& options) {
  const auto metrics = compare_trajectories(drive.estimate, drive.truth, options);
  EXPECT_TRUE(metrics) << metrics.error().message();
  return metrics.value_or(TrajectoryMetrics{});
}

TEST(ErrorStatistics, OfShortLists) {
  const ErrorStatistics odd = statistics_of({5, 1, 3});
  EXPECT_DOUBLE_EQ(odd.mean, 3);
  EXPECT_DOUBLE_EQ(odd.median, 3);
  EXPECT_DOUBLE_EQ(odd.max, 5);
  EXPECT_DOUBLE_EQ(odd.rmse, std::sqrt(35.0 / 3.0));
  EXPECT_DOUBLE_EQ(statistics_of({4, 1, 2, 9}).median, 3);
  EXPECT_THROW(statistics_of({}), std::invalid_argument);
}

// Straight for 20 m in steps of 1 m; the estimate is 2 % too long and turns 0.1° about z per metre.
Drive straight_drive() {
  Drive drive;
  const double turn = 0.1 * std::numbers::pi / 180;
  for (int i = 0; i <= 20; ++i) {
    drive.truth.push_back({frame_time(i), Pose(exp_so3({0, 0, 0.5}), Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()) *
                                                                         Eigen::Vector3d(i, 0, 0))});
    drive.estimate.push_back({frame_time(i), Pose(exp_so3({0, 0, turn * i}), {1.02 * i, 0, 0})});
  }
  return drive;
}

TEST(TrajectoryMetrics, AgreesWithTheClosedFormOnAStraightDrive) {
  TrajectoryMetricsOptions options;
  options.alignment = Alignment::first;
  options.segment_lengths_m = {5, 20, 21};
  const TrajectoryMetrics m = compare(straight_drive(), options);
  EXPECT_EQ(m.frames, 21U);
  EXPECT_NEAR(m.path_length_m, 20, 1e-12);
  EXPECT_NEAR(m.ate_m.max, 0.4, 1e-12);
  EXPECT_NEAR(m.ate_m.mean, 0.2, 1e-12);
  EXPECT_NEAR(m.ate_m.median, 0.2, 1e-12);
  EXPECT_NEAR(m.ate_m.rmse, 0.02 * std::sqrt(2870.0 / 21.0), 1e-12) << "Σ i² for 0 … 20 is 2870";
  EXPECT_NEAR(*m.drift_percent, 2.0, 1e-10);
  EXPECT_NEAR(m.rpe_rotation_deg->max, 0.1, 1e-9);
  ASSERT_EQ(m.segments->size(), 3U);
  EXPECT_EQ(m.segments->at(0).count, 16);
  EXPECT_NEAR(*m.segments->at(0).rotation_deg_per_m, 0.1, 1e-9);
  EXPECT_EQ(m.segments->at(1).count, 1) << "a segment may end exactly at the last frame";
  EXPECT_NEAR(*m.segments->at(1).translation_percent, 2.0, 1e-10);
  EXPECT_EQ(m.segments->at(2).count, 0);
  EXPECT_EQ(m.segments->at(2).translation_percent, std::nullopt);
  EXPECT_TRUE(m.missing.empty());
}

TEST(TrajectoryMetrics, Sim3RemovesTheScale) {
  TrajectoryMetricsOptions options;
  options.alignment = Alignment::sim3;
  const TrajectoryMetrics m = compare(straight_drive(), options);
  EXPECT_NEAR(m.truth_from_estimate.scale, 1 / 1.02, 1e-12);
  EXPECT_NEAR(m.ate_m.max, 0, 1e-12);
  EXPECT_NEAR(*m.drift_percent, 2.0, 1e-10) << "drift is that of the estimate before alignment";
}

TEST(TrajectoryMetrics, AlignmentRemovesTheWorldFrame) {
  const Drive drive = noisy_drive(5, 120);
  Drive moved = drive;
  const Pose other(exp_so3({0.3, 0.5, -2}), {100, 20, -7});
  for (auto& entry : moved.estimate) entry.pose = other * entry.pose;
  for (const Alignment alignment : {Alignment::first, Alignment::se3, Alignment::sim3}) {
    TrajectoryMetricsOptions options;
    options.alignment = alignment;
    const TrajectoryMetrics a = compare(drive, options), b = compare(moved, options);
    EXPECT_NEAR(a.ate_m.rmse, b.ate_m.rmse, 1e-9);
    EXPECT_NEAR(*a.drift_percent, *b.drift_percent, 1e-9);
    EXPECT_NEAR(a.rpe_translation_m->max, b.rpe_translation_m->max, 1e-9);
    EXPECT_NEAR(*a.segments->at(3).rotation_deg_per_m, *b.segments->at(3).rotation_deg_per_m, 1e-9);
  }
}

// The method of the KITTI development kit, as a plain loop: from the first frame to the one at the length, E = D⁻¹ D'.
SegmentErrors brute_force_segments(const Drive& drive, double length, int step) {
  SegmentErrors result{length, 0, 0.0, 0.0};
  const auto n = static_cast<int>(drive.truth.size());
  for (int first = 0; first < n; first += step) {
    double path_m = 0;
    int last = first;
    while (path_m < length && last + 1 < n) {
      const Eigen::Matrix4d a = drive.truth[static_cast<std::size_t>(last)].pose.matrix();
      const Eigen::Matrix4d b = drive.truth[static_cast<std::size_t>(last) + 1].pose.matrix();
      path_m += (b.col(3) - a.col(3)).norm();
      ++last;
    }
    if (path_m < length) continue;
    const auto matrix = [](const Trajectory& t, int i) { return t[static_cast<std::size_t>(i)].pose.matrix(); };
    const Eigen::Matrix4d true_motion = matrix(drive.truth, first).inverse() * matrix(drive.truth, last);
    const Eigen::Matrix4d motion = matrix(drive.estimate, first).inverse() * matrix(drive.estimate, last);
    const Eigen::Matrix4d error = motion.inverse() * true_motion;
    const double cosine = std::clamp(0.5 * (error.topLeftCorner<3, 3>().trace() - 1), -1.0, 1.0);
    *result.translation_percent += 100 * error.topRightCorner<3, 1>().norm() / length;
    *result.rotation_deg_per_m += std::acos(cosine) * 180 / std::numbers::pi / length;
    ++result.count;
  }
  *result.translation_percent /= result.count;
  *result.rotation_deg_per_m /= result.count;
  return result;
}

TEST(TrajectoryMetrics, SegmentsAgreeWithBruteForce) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Drive drive = noisy_drive(seed, 1600);
    TrajectoryMetricsOptions every;
    every.alignment = Alignment::none;
    const TrajectoryMetricsOptions kitti = with_kitti_segments(every);
    for (const auto& options : {every, kitti}) {
      const TrajectoryMetrics m = compare(drive, options);
      ASSERT_EQ(m.segments->size(), options.segment_lengths_m.size());
      for (const SegmentErrors& segment : *m.segments) {
        const SegmentErrors expected = brute_force_segments(drive, segment.length_m, options.segment_step);
        ASSERT_GT(expected.count, 0);
        EXPECT_EQ(segment.count, expected.count) << segment.length_m;
        EXPECT_NEAR(*segment.translation_percent, *expected.translation_percent, 1e-9);
        EXPECT_NEAR(*segment.rotation_deg_per_m, *expected.rotation_deg_per_m, 1e-7);
      }
    }
  }
}

TEST(TrajectoryMetrics, MetricsThatNeedTrueRotationsAreMissing) {
  Drive drive = noisy_drive(4, 60);
  for (auto& entry : drive.truth) entry.pose = Pose::from_translation(entry.pose.translation());
  TrajectoryMetricsOptions options;
  const TrajectoryMetrics m = compare(drive, options);
  EXPECT_FALSE(m.drift_percent);
  EXPECT_FALSE(m.segments);
  EXPECT_FALSE(m.rpe_rotation_deg);
  ASSERT_TRUE(m.rpe_translation_m);
  EXPECT_LT(m.rpe_translation_m->max, 0.2) << "displacements of 0.7 m, compared as vectors of the true world frame";
  std::map<std::string, std::string> reasons;
  for (const MissingMetric& missing : m.missing) reasons[missing.name] = missing.reason;
  EXPECT_EQ(reasons.size(), 4U);
  for (const char* name : {"drift_percent", "segments", "rpe.rotation_deg", "ate_first_rmse_m"}) {
    EXPECT_THAT(reasons[name], HasSubstr("no rotation")) << name;
  }
  options.alignment = Alignment::first;
  const auto refused = compare_trajectories(drive.estimate, drive.truth, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
}

TEST(TrajectoryMetrics, AcceptsStationaryTruthAndSingleFrames) {
  Drive drive = noisy_drive(6, 5, 0.0);
  for (auto& entry : drive.truth) entry.pose = drive.truth.front().pose;
  const TrajectoryMetrics stationary = compare(drive, {});
  EXPECT_EQ(stationary.path_length_m, 0);
  EXPECT_FALSE(stationary.drift_percent);
  EXPECT_EQ(stationary.segments->front().count, 0);
  // Noise of a truth at rest: a path of 4 mm.
  for (std::size_t i = 0; i < drive.truth.size(); ++i)
    drive.truth[i].pose = drive.truth[i].pose * Pose::from_translation({1e-3 * static_cast<double>(i % 2), 0, 0});
  EXPECT_FALSE(compare(drive, {}).drift_percent);
  drive.truth.resize(1);
  drive.estimate.resize(1);
  const TrajectoryMetrics one = compare(drive, {});
  EXPECT_EQ(one.frames, 1U);
  EXPECT_NEAR(one.ate_m.max, 0, 1e-12);
  EXPECT_FALSE(one.rpe_translation_m);
  EXPECT_EQ(one.missing.size(), 3U);
}

TEST(TrajectoryMetrics, RejectsInvalidOptions) {
  const Drive drive = noisy_drive(7, 10);
  TrajectoryMetricsOptions length, step, delta;
  length.segment_lengths_m = {5, 0};
  step.segment_step = 0;
  delta.rpe_delta_frames = 0;
  for (const auto& options : {length, step, delta}) {
    const auto metrics = compare_trajectories(drive.estimate, drive.truth, options);
    ASSERT_FALSE(metrics);
    EXPECT_EQ(metrics.error().code, ErrorCode::usage);
  }
}

// A Python with evo: SPARTAN_EVO_PYTHON, the project's own environment, or the system's.
std::string python_with_evo(const std::string& source_folder) {
  std::vector<std::string> candidates;
  if (const char* set = std::getenv("SPARTAN_EVO_PYTHON")) candidates.emplace_back(set);
  candidates.push_back(source_folder + "/.venv/bin/python");
  candidates.emplace_back("python3");
  for (const std::string& python : candidates) {
    if (std::system(("'" + python + "' -c 'import evo' >/dev/null 2>&1").c_str()) == 0) return python;
  }
  return {};
}

std::map<std::string, double> run_evo(const std::string& command) {
  std::map<std::string, double> values;
  FILE* const pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return values;
  std::array<char, 256> line{};
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) {
    std::istringstream words(line.data());
    std::string name;
    double value = 0;
    if (words >> name >> value) values[name] = value;
  }
  ::pclose(pipe);
  return values;
}

TEST(TrajectoryMetrics, AgreesWithEvo) {
  const char* const source = std::getenv("SPARTAN_SOURCE_DIR");
  if (source == nullptr) GTEST_SKIP() << "SPARTAN_SOURCE_DIR is not set";
  const std::string python = python_with_evo(source);
  if (python.empty())
    GTEST_SKIP() << "evo is not installed (pip install evo; SPARTAN_EVO_PYTHON names the Python that has it)";
  const testing::TemporaryFolder folder;
  Drive drive = noisy_drive(11, 150);
  drive.estimate.erase(drive.estimate.begin() + 40, drive.estimate.begin() + 45);  // frames without a pose
  const std::string estimate = folder.write("estimate.tum", to_tum(drive.estimate));
  const std::string truth = folder.write("truth.tum", to_tum(drive.truth));
  for (const Alignment alignment : {Alignment::none, Alignment::first, Alignment::se3, Alignment::sim3}) {
    for (const int delta : {1, 5}) {
      TrajectoryMetricsOptions options;
      options.alignment = alignment;
      options.rpe_delta_frames = delta;
      const TrajectoryMetrics m = compare(drive, options);
      auto evo = run_evo(fmt::format("'{}' '{}/src/spartan/eval/evo_oracle.py' {} {} {} 0.02 {}", python, source,
                                     estimate, truth, name_of(alignment), delta));
      SCOPED_TRACE(::testing::Message() << name_of(alignment) << ", delta " << delta);
      ASSERT_EQ(evo.size(), 14U);
      EXPECT_EQ(static_cast<double>(m.frames), evo["frames"]);
      EXPECT_NEAR(m.path_length_m, evo["path_length_m"], 1e-6);
      const auto expect_same = [&](const std::string& name, const ErrorStatistics& s) {
        EXPECT_NEAR(s.rmse, evo[name + ".rmse"], 1e-6) << name;
        EXPECT_NEAR(s.mean, evo[name + ".mean"], 1e-6) << name;
        EXPECT_NEAR(s.median, evo[name + ".median"], 1e-6) << name;
        EXPECT_NEAR(s.max, evo[name + ".max"], 1e-6) << name;
      };
      expect_same("ate_m", m.ate_m);
      expect_same("rpe_translation_m", *m.rpe_translation_m);
      expect_same("rpe_rotation_deg", *m.rpe_rotation_deg);
    }
  }
}

// A winding drive of a body with x forward.
Trajectory winding_drive() {
  Trajectory drive;
  Pose pose;
  for (int i = 0; i < 100; ++i) {
    drive.push_back({Stamp::from_seconds(0.1 * i), pose});
    pose = pose * Pose(exp_so3({0, 0.01 * std::sin(0.1 * i), 0.05 * std::cos(0.07 * i)}), {0.5, 0, 0.01});
  }
  return drive;
}

TEST(AxesRotation, IsFoundForAnyMountAndAlignment) {
  const Trajectory body = winding_drive();
  const Pose mount(exp_so3({0.9, -1.1, 0.7}), {0.1, 0.2, 0.3});
  Trajectory camera = body;
  for (StampedPose& entry : camera) entry.pose = mount.inverse() * entry.pose * mount;
  for (const Alignment alignment : {Alignment::none, Alignment::se3, Alignment::sim3}) {
    TrajectoryMetricsOptions options;
    options.alignment = alignment;
    const auto other = compare_trajectories(body, camera, options);
    ASSERT_TRUE(other && other->axes_rotation_deg);
    EXPECT_GT(*other->axes_rotation_deg, 45);
    EXPECT_FALSE(compare_trajectories(body, body, options)->axes_rotation_deg);
  }
}

TEST(AxesRotation, IsNotClaimedOfABadEstimate) {
  const Trajectory truth = winding_drive();
  Trajectory estimate = truth;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].pose =
        Pose::from_translation({0.3 * std::sin(0.9 * static_cast<double>(i * i)), 0.1, 0}) * estimate[i].pose;
  }
  for (std::size_t i = 50; i < estimate.size(); ++i) estimate[i].pose = estimate[50].pose;  // lost
  EXPECT_FALSE(compare_trajectories(estimate, truth, {})->axes_rotation_deg);
}

}  // namespace
}  // namespace spartan
