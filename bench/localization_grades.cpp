// Inertial sensors of several grades, mounted off the body's origin, with a clock of their own, under vibration and
// without a rest: `make bench-localization_grades ARGS="..."`.
//
//   localization_grades [--config FOLDER] [--from RECORDINGS] [--runs RUNS] [--errors NAME,NAME] [--seeds N]
//                       [--first SEED] [--grades tactical,industrial,mems] [--delay-ms D] [--misstated F]
//                       [SCENARIO...]
//
// The true motion and the samples of the sensors are those of the simulator; nothing is rendered. The errors of the
// odometry are those of rendered drives (RECORDINGS/NAME with the run RUNS/NAME), scaled to the covariance that
// RUNS/SCENARIO reported. Trials are paired: all subsets of sensors use the same samples and the same odometry.
#include <fmt/format.h>

#include <stdexcept>

#include "localization_trial.h"
#include "resampled_odometry.h"
#include "standard_recordings.h"
#include "trial_statistics.h"

namespace spartan {
namespace {

/// Of the IMU on the body: 0.3 m from its origin.
const std::vector<double> kPosition_m = {0.2, -0.1, 0.2};

/// Leaves out the frames up to the first one in motion.
void without_rest(TrueDrive& drive) {
  double fastest = 0;
  for (const double t : drive.frames_s) fastest = std::max(fastest, drive.motion->velocity(t).norm());
  std::size_t first = 0;
  while (drive.motion->velocity(drive.frames_s[first]).norm() < 0.5 * fastest) ++first;
  drive.frames_s.erase(drive.frames_s.begin(), drive.frames_s.begin() + static_cast<std::ptrdiff_t>(first));
  drive.poses.erase(drive.poses.begin(), drive.poses.begin() + static_cast<std::ptrdiff_t>(first));
}

/// The true noise; what is stated stays.
void scale_noise(sim::Scenario& scenario, double factor) {
  sim::ImuOptions& imu = scenario.imu;
  for (double* noise : {&imu.gyro_noise_rad_s_sqrt_hz, &imu.gyro_bias_rad_s, &imu.gyro_walk_rad_s2_sqrt_hz,
                        &imu.accel_noise_m_s2_sqrt_hz, &imu.accel_bias_m_s2, &imu.accel_walk_m_s3_sqrt_hz})
    *noise *= factor;
  scenario.compass.sigma_deg *= factor;
  scenario.compass.bias_deg *= factor;
  scenario.inclinometer.sigma_deg *= factor;
  scenario.inclinometer.bias_deg *= factor;
}

struct Setup {
  const TrueDrive& drive;
  LocalizationOptions options;
  double misstated = 1;  ///< true over stated noise of all sensors but vision and wheels
  Seeds seeds;
};

std::vector<TrialResult> trials_of(const Setup& setup, const Subset& subset, const ThreadPool& workers) {
  return run_trials(setup.seeds, workers, [&](std::uint64_t seed) {
    DrawnDrive d = draw(setup.drive, {}, setup.drive.scenario.compass, seed);
    for (CompassSample& s : d.compass) s.sigma_rad /= setup.misstated;
    for (InclinometerSample& s : d.inclinometer) s.sigma_rad /= setup.misstated;
    std::vector<Arrival> all = arrivals(d, subset);
    const Stamp start = sim::internal::stamp_at(setup.drive.frames_s.front());
    std::erase_if(all, [&](const Arrival& a) { return a.at_ns < start.ns; });
    return run_trial(setup.drive, all, setup.options);
  });
}

double largest(const std::vector<TrialResult>& trials, const auto& value) {
  double most = 0;
  for (const TrialResult& t : trials) most = std::max(most, value(t));
  return most;
}

void print_grade(const std::string& name, const Setup& setup, const ThreadPool& workers) {
  const TrueDrive& drive = setup.drive;
  const Band three = band(3, setup.seeds.count);
  fmt::print(
      "\n### {} IMU\n\n| sensors | final error, % | minus vision alone | ATE, mm | minus vision alone | NEES position, "
      "attitude | frames in its band, % | IMU aligned after, s, m | not aligned | IMU not ok, frames | clock, ms | its "
      "sigma, ms |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      name);
  std::vector<TrialResult> alone;
  int worse = 0;
  for (int mask = 0; mask < 16; ++mask) {
    const Subset subset = Subset::of(mask);
    const auto trials = trials_of(setup, subset, workers);
    if (mask == 0) alone = trials;
    std::vector<double> end, end_more, ate, ate_more, position, attitude, clock, clock_sigma;
    double not_aligned = 0;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const TrialResult& t = trials[i];
      end.push_back(t.final_percent);
      end_more.push_back(t.final_percent - alone[i].final_percent);
      ate.push_back(1e3 * t.ate_m);
      ate_more.push_back(1e3 * (t.ate_m - alone[i].ate_m));
      position.push_back(t.frames.back().nees_position);
      attitude.push_back(t.frames.back().nees_attitude);
      clock.push_back(1e3 * t.last.imu_time_offset_s);
      clock_sigma.push_back(1e3 * t.last.imu_time_offset_sigma_s);
      not_aligned += t.imu_aligned_at ? 0 : 1;
    }
    const auto travelled = [&](const TrialResult& t) {
      double sum = 0;
      for (std::size_t i = 1; i <= t.imu_aligned_at.value_or(0); ++i)
        sum += (drive.poses[i].translation() - drive.poses[i - 1].translation()).norm();
      return sum;
    };
    const auto seconds = [&](const TrialResult& t) {
      return drive.frames_s[t.imu_aligned_at.value_or(0)] - drive.frames_s[0];
    };
    const auto not_ok = [&](const TrialResult& t) {
      const auto& states = t.states_s[static_cast<std::size_t>(LocalizationSensor::imu)];
      return static_cast<double>(t.frames.size()) - states[static_cast<std::size_t>(SensorState::ok)];
    };
    const Mean e = mean_of(end_more), a = mean_of(ate_more);
    const bool is_worse = e.mean - e.half_width > 0 || a.mean - a.half_width > 0;
    worse += is_worse ? 1 : 0;
    const double of_position = mean_of(position).mean, of_attitude = mean_of(attitude).mean;
    fmt::print("| {}{} | {:.4f} | {:+.4f} ± {:.4f} | {:.2f} | {:+.2f} ± {:.2f} | {:.2f}{}, {:.2f}{} | {:.0f}, {:.0f} |",
               subset.name(), is_worse ? " (worse)" : "", mean_of(end).mean, e.mean, e.half_width, mean_of(ate).mean,
               a.mean, a.half_width, of_position, three.contains(of_position) ? "" : "*", of_attitude,
               three.contains(of_attitude) ? "" : "*", percent_in_band(trials, three, &FrameError::nees_position),
               percent_in_band(trials, three, &FrameError::nees_attitude));
    if (subset.imu) {
      fmt::print(" {:.1f}, {:.2f} | {:.0f} | {:.1f} | {:.1f} ± {:.1f} | {:.2f} |", largest(trials, seconds),
                 largest(trials, travelled), not_aligned, largest(trials, not_ok), mean_of(clock).mean,
                 mean_of(clock).half_width, mean_of(clock_sigma).mean);
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
  fmt::print("\nworse than vision alone (95 %): {} of 15\n", worse);
}

void print_scenario(const std::string& name, const RecordingArguments& arguments) {
  const auto odometry = resampled_odometry(arguments, name);
  const ThreadPool workers(2);
  for (const std::string& grade : split(arguments.options.at("--grades"))) {
    auto drive = open_true_drive(arguments.options.at("--config"), name);
    if (!drive)
      throw std::runtime_error(fmt::format("{}: no such scenario in {}", name, arguments.options.at("--config")));
    drive->odometry = odometry;
    without_rest(*drive);
    const auto kind = value_named<sim::ImuGrade>(grade);
    if (!kind) throw std::runtime_error(grade + ": is no grade");
    drive->scenario.imu = sim::imu_of_grade(*kind);
    drive->scenario.imu.position_m = kPosition_m;
    drive->scenario.imu.delay_ms = arguments.number("--delay-ms");
    Setup setup{*drive,
                options_for(*drive),
                std::stod(arguments.options.at("--misstated")),
                {arguments.number("--first"), arguments.number("--seeds")}};
    scale_noise(drive->scenario, setup.misstated);
    setup.options.imu.position_m = Eigen::Map<const Eigen::Vector3d>(kPosition_m.data());
    if (grade == split(arguments.options.at("--grades")).front()) {
      const Band three = band(3, setup.seeds.count);
      fmt::print("\n## {}: {:.0f} m, {} frames, {} seeds, stamps of the IMU {} ms late\n\n", name, drive->length_m,
                 drive->poses.size(), setup.seeds.count, arguments.number("--delay-ms"));
      fmt::print(
          "NEES at the end, 95 % band: {:.2f} to {:.2f}; * outside. Aligned, not ok: the largest of all seeds.\n",
          three.low, three.high);
    }
    print_grade(grade, setup, workers);
  }
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--config", "config"},
                                                        {"--runs", "runs"},
                                                        {"--errors", ""},
                                                        {"--seeds", "50"},
                                                        {"--first", "1"},
                                                        {"--grades", "tactical,industrial,mems"},
                                                        {"--misstated", "1"},
                                                        {"--delay-ms", "20"}});
  if (arguments.scenarios.empty()) arguments.scenarios = {"rocky_20pct"};
  for (const std::string& name : arguments.scenarios) print_scenario(name, arguments);
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
