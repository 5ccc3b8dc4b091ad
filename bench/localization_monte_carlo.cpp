// Monte Carlo test of the localization: `make bench-localization_monte_carlo`.
//
//   localization_monte_carlo [--seeds N] [--first SEED] [--threads N] [--tables subsets|faults|wild] [--config FOLDER]
//                            [--from RECORDINGS] [--runs RUNS] [--errors NAME,NAME] [SCENARIO...]
//
// The true motion comes from the simulator; for each seed the sensor errors are drawn anew, and the odometry errors
// are those of rendered drives NAME, from a random place on (resampled_odometry.h). Nothing is rendered. Trials are
// paired: all subsets of sensors use the same drive, the same samples and the same odometry. Default: rocky_20pct,
// crater_rim, loop.
#include <fmt/format.h>

#include <cstdio>
#include <numeric>
#include <stdexcept>

#include "localization_trial.h"
#include "resampled_odometry.h"
#include "standard_recordings.h"
#include "trial_statistics.h"

namespace spartan {
namespace {

template <class Value>
std::vector<double> each(const std::vector<TrialResult>& trials, const Value& value) {
  std::vector<double> values;
  values.reserve(trials.size());
  for (const TrialResult& t : trials) values.push_back(value(t));
  return values;
}

using MeasurementSource = std::function<std::vector<Arrival>(const TrueDrive&, std::uint64_t seed, const Subset&)>;

std::vector<TrialResult> run_trials(const TrueDrive& drive, const Subset& subset, const Seeds& seeds,
                                    const MeasurementSource& arrivals_of, const ThreadPool& workers,
                                    const std::optional<Watch>& watch = {}) {
  return run_trials(seeds, workers, [&](std::uint64_t seed) {
    return run_trial(drive, arrivals_of(drive, seed, subset), options_for(drive), watch);
  });
}

std::vector<Arrival> nominal(const TrueDrive& drive, std::uint64_t seed, const Subset& subset) {
  return arrivals(draw(drive, {}, drive.scenario.compass, seed), subset);
}

void print_subsets(const TrueDrive& drive, const Seeds& seeds, const ThreadPool& workers) {
  const Band three = band(3, seeds.count), six = band(6, seeds.count);
  fmt::print("\n## {}: {:.0f} m, {} frames, {} seeds\n\n", drive.scenario.name, drive.length_m, drive.poses.size(),
             seeds.count);
  fmt::print(
      "NEES bands (95 %): position, attitude {:.2f} to {:.2f}; pose {:.2f} to {:.2f}. In brackets: frames inside the "
      "band.\n\n",
      three.low, three.high, six.low, six.high);
  fmt::print(
      "| sensors | final error, % | minus vision alone | ATE, mm | minus vision alone | NEES position | attitude | "
      "pose |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  std::vector<TrialResult> alone;
  int worse = 0, outside = 0;
  for (int mask = 0; mask < 16; ++mask) {
    const Subset subset = Subset::of(mask);
    const auto trials = run_trials(drive, subset, seeds, nominal, workers);
    if (mask == 0) alone = trials;
    std::vector<double> by_end, by_ate;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      by_end.push_back(trials[i].final_percent - alone[i].final_percent);
      by_ate.push_back(1e3 * (trials[i].ate_m - alone[i].ate_m));
    }
    const Mean end = mean_of(by_end), ate = mean_of(by_ate);
    const auto nees = [&](double FrameError::*which) {
      return mean_of(each(trials, [&](const TrialResult& t) { return t.frames.back().*which; })).mean;
    };
    const double position = nees(&FrameError::nees_position), attitude = nees(&FrameError::nees_attitude),
                 pose = nees(&FrameError::nees_pose);
    worse += end.mean - end.half_width > 0 || ate.mean - ate.half_width > 0 ? 1 : 0;
    outside += three.contains(position) && three.contains(attitude) && six.contains(pose) ? 0 : 1;
    fmt::print(
        "| {} | {:.4f} | {:+.4f} ± {:.4f} | {:.2f} | {:+.2f} ± {:.2f} | {:.2f} ({:.0f} %) | {:.2f} ({:.0f} %) | "
        "{:.2f} ({:.0f} %) |\n",
        subset.name(), mean_of(each(trials, [](const auto& t) { return t.final_percent; })).mean, end.mean,
        end.half_width, 1e3 * mean_of(each(trials, [](const auto& t) { return t.ate_m; })).mean, ate.mean,
        ate.half_width, position, percent_in_band(trials, three, &FrameError::nees_position), attitude,
        percent_in_band(trials, three, &FrameError::nees_attitude), pose,
        percent_in_band(trials, six, &FrameError::nees_pose));
    std::fflush(stdout);
  }
  fmt::print("\nworse than vision alone (95 %): {} of 15; NEES at the end outside a band: {} of 16\n", worse, outside);
}

struct FaultCase {
  std::string name;
  LocalizationSensor sensor;
  double from_s, to_s;
  MeasurementSource measurements;
};

std::vector<Arrival> without_vision(const TrueDrive& drive, std::uint64_t seed, const Subset& subset, double from_s,
                                    double to_s) {
  DrawnDrive d = draw(drive, {}, drive.scenario.compass, seed);
  for (RelativeMotion& m : d.motions) {
    const auto dark = [&](Stamp s) {
      return s >= sim::internal::stamp_at(from_s) && s < sim::internal::stamp_at(to_s);
    };
    m.measured = !dark(m.from) && !dark(m.to);
  }
  return arrivals(d, subset);
}

// Wheels that roll five times the distance travelled.
std::vector<Arrival> slipping(const TrueDrive& drive, std::uint64_t seed, const Subset& subset, double from_s,
                              double to_s) {
  DrawnDrive d = draw(drive, {}, drive.scenario.compass, seed);
  double left = 0, right = 0;
  WheelSample last = d.wheels.front();
  for (WheelSample& w : d.wheels) {
    const WheelSample now = w;
    const double factor = w.stamp >= sim::internal::stamp_at(from_s) && w.stamp < sim::internal::stamp_at(to_s) ? 5 : 1;
    left += factor * (now.left_m - last.left_m);
    right += factor * (now.right_m - last.right_m);
    w.left_m = left;
    w.right_m = right;
    last = now;
  }
  return arrivals(d, subset);
}

std::vector<Arrival> with_nans(const TrueDrive& drive, std::uint64_t seed, const Subset& subset) {
  auto all = nominal(drive, seed, subset);
  Random random(seed, 401);
  for (Arrival& a : all) {
    if (random.uniform() >= 0.05) continue;
    const double nan = std::nan("");
    if (auto* imu = std::get_if<ImuSample>(&a.measurement)) imu->accel_m_s2.y() = nan;
    if (auto* wheels = std::get_if<WheelSample>(&a.measurement)) wheels->left_m = nan;
    if (auto* compass = std::get_if<CompassSample>(&a.measurement)) compass->heading_rad = nan;
    if (auto* tilt = std::get_if<InclinometerSample>(&a.measurement)) tilt->pitch_rad = nan;
    if (auto* motion = std::get_if<RelativeMotion>(&a.measurement)) motion->covariance(2, 2) = nan;
  }
  return all;
}

// During the interval every other sample arrives 0.3 s late, after newer ones, and one in fifty has a time stamp 20 s
// too old.
std::vector<Arrival> with_reordered_stamps(const TrueDrive& drive, std::uint64_t seed, const Subset& subset,
                                           double from_s, double to_s) {
  auto all = nominal(drive, seed, subset);
  Random random(seed, 402);
  for (std::size_t i = 0; i < all.size(); ++i) {
    Arrival& a = all[i];
    if (a.at_ns < sim::internal::stamp_at(from_s).ns || a.at_ns >= sim::internal::stamp_at(to_s).ns) continue;
    if (std::holds_alternative<RelativeMotion>(a.measurement)) continue;
    if (random.uniform() < 0.02) {
      std::visit(
          [](auto& m) {
            if constexpr (requires { m.stamp; }) m.stamp.ns -= 20'000'000'000;
          },
          a.measurement);
    } else if (i % 2 == 0) {
      a.at_ns += 300'000'000;
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Arrival& a, const Arrival& b) { return a.at_ns < b.at_ns; });
  return all;
}

/// Applies a change to each sample of one kind in [from_s, to_s).
template <class Sample, class Change>
MeasurementSource changed(double from_s, double to_s, const Change& change) {
  return [=](const TrueDrive& drive, std::uint64_t seed, const Subset& subset) {
    auto all = nominal(drive, seed, subset);
    Random random(seed, 404);
    for (Arrival& a : all) {
      auto* sample = std::get_if<Sample>(&a.measurement);
      const double t = seconds_between(sim::internal::stamp_at(0), Stamp{a.at_ns});
      if (sample != nullptr && t >= from_s && t < to_s) change(*sample, t - from_s, random);
    }
    return all;
  };
}

// Stamps of all samples but vision scatter by 20 ms; they arrive in their order.
std::vector<Arrival> with_jitter(const TrueDrive& drive, std::uint64_t seed, const Subset& subset, double from_s,
                                 double to_s) {
  auto all = nominal(drive, seed, subset);
  Random random(seed, 405);
  for (Arrival& a : all) {
    const double t = seconds_between(sim::internal::stamp_at(0), Stamp{a.at_ns});
    if (t < from_s || t >= to_s) continue;
    const auto shift = static_cast<std::int64_t>(1e9 * random.uniform(-0.02, 0.02));
    std::visit(
        [&](auto& m) {
          if constexpr (requires { m.stamp; }) m.stamp.ns += shift;
        },
        a.measurement);
  }
  return all;
}

// The middle between two frames of a moving rover, after 40 % of the drive.
double while_moving(const TrueDrive& drive) {
  constexpr double kLongestMoving_s = 2;
  std::size_t frame = drive.frames_s.size() * 2 / 5;
  while (drive.frames_s[frame + 1] - drive.frames_s[frame] > kLongestMoving_s) ++frame;
  return 0.5 * (drive.frames_s[frame] + drive.frames_s[frame + 1]);
}

std::vector<FaultCase> fault_cases(const TrueDrive& drive) {
  const double end = drive.motion->seconds(), at_stop = 0.4 * end, from = while_moving(drive);
  const auto drawn = [](const sim::SensorFaults& faults, double outliers) -> MeasurementSource {
    return [=](const TrueDrive& d, std::uint64_t seed, const Subset& subset) {
      sim::CompassOptions compass = d.scenario.compass;
      if (outliers > 0) compass.outlier_fraction = outliers;
      return arrivals(draw(d, faults, compass, seed), subset);
    };
  };
  const auto dark = [=](double seconds) -> MeasurementSource {
    return [=](const TrueDrive& d, std::uint64_t s, const Subset& w) {
      return without_vision(d, s, w, from, from + seconds);
    };
  };
  const auto stamped = [=](std::int64_t ns) {
    return changed<ImuSample>(from, from + 40, [=](ImuSample& m, double, Random& random) {
      if (random.uniform() < 0.02) m.stamp.ns += ns;
    });
  };
  const auto accel_step = [](ImuSample& m, double, Random&) { m.accel_m_s2.array() += 0.3; };
  constexpr double kBurst_rad = 40 / 57.29578;
  using enum LocalizationSensor;
  return {
      {"camera dark 10 s", vision, from, from + 10, dark(10)},
      {"camera dark 30 s", vision, from, from + 30, dark(30)},
      {"gyro bias steps by 0.02 rad/s", imu, from, end,
       changed<ImuSample>(from, end, [](ImuSample& m, double, Random&) { m.gyro_rad_s.array() += 0.02; })},
      {"accelerometer bias steps by 0.3 m/s²", imu, from, end, changed<ImuSample>(from, end, accel_step)},
      {"the same at a stop", imu, at_stop, end, changed<ImuSample>(at_stop, end, accel_step)},
      {"compass outliers 30 %", compass, 0, end, drawn({}, 0.3)},
      {"compass 40° off, 10 s of every 20 s, for 80 s", compass, from, from + 80,
       changed<CompassSample>(
           from, from + 80,
           [](CompassSample& m, double t, Random&) { m.heading_rad += std::fmod(t, 20) < 10 ? kBurst_rad : 0; })},
      {"compass stuck", compass, from, end,
       drawn({{sim::MotionSensor::compass, sim::SensorFaultKind::freeze, from, end}}, 0)},
      {"wheel slip 80 % for 40 s", wheels, from, from + 40,
       [=](const TrueDrive& d, std::uint64_t s, const Subset& w) { return slipping(d, s, w, from, from + 40); }},
      {"stamps scatter by 20 ms for 40 s", imu, from, from + 40,
       [=](const TrueDrive& d, std::uint64_t s, const Subset& w) { return with_jitter(d, s, w, from, from + 40); }},
      {"IMU gap 1 s", imu, from, from + 1,
       drawn({{sim::MotionSensor::imu, sim::SensorFaultKind::drop, from, from + 1}}, 0)},
      {"IMU gap 10 s", imu, from, from + 10,
       drawn({{sim::MotionSensor::imu, sim::SensorFaultKind::drop, from, from + 10}}, 0)},
      {"IMU frozen 10 s", imu, from, from + 10,
       drawn({{sim::MotionSensor::imu, sim::SensorFaultKind::freeze, from, from + 10}}, 0)},
      {"NaN in 5 % of all samples", imu, 0, end, with_nans},
      {"2 % of the IMU's stamps 20 s back", imu, from, from + 40, stamped(-20'000'000'000)},
      {"2 % of the IMU's stamps 1000 s ahead", imu, from, from + 40, stamped(1'000'000'000'000)},
      {"stamps out of order for 40 s", imu, from, from + 40,
       [=](const TrueDrive& d, std::uint64_t s, const Subset& w) {
         return with_reordered_stamps(d, s, w, from, from + 40);
       }},
  };
}

// 99.73 % quantile of chi-square with three degrees of freedom, the probability of 3 σ in one dimension.
constexpr double kThreeSigma = 14.156;

// One visual motion that is wrong by 0.5 m and 5° in random directions, with its usual covariance.
/// A random motion of the middle 80 % of the drive.
std::size_t wild_place(const TrueDrive& drive, std::uint64_t seed) {
  Random random(seed, 406);
  return static_cast<std::size_t>(random.uniform(0.1, 0.9) * static_cast<double>(drive.poses.size() - 1));
}

std::vector<Arrival> with_wild_motion(const TrueDrive& drive, std::uint64_t seed, const Subset& subset) {
  DrawnDrive d = draw(drive, {}, drive.scenario.compass, seed);
  Random random(seed, 403);
  const auto direction = [&] {
    Eigen::Vector3d v(random.normal(), random.normal(), random.normal());
    return v.normalized().eval();
  };
  Vector6d error;
  error << 0.5 * direction(), 5 / 57.29578 * direction();
  RelativeMotion& wild = d.motions[wild_place(drive, seed)];
  wild.previous_from_current = wild.previous_from_current * exp_se3(error);
  return arrivals(d, subset);
}

void print_wild_motions(const TrueDrive& drive, const Seeds& seeds, const ThreadPool& workers) {
  fmt::print("\n## {}: one wild motion of vision, 0.5 m and 5° ({} seeds)\n\n", drive.scenario.name, seeds.count);
  fmt::print(
      "| sensors | inside 3 σ after it, % | at the end, % | error at the end, mm | σ at the end, mm | vision rejected "
      "| "
      "IMU rejected |\n|---|---|---|---|---|---|---|\n");
  for (int mask = 0; mask < 16; ++mask) {
    const auto trials = run_trials(drive, Subset::of(mask), seeds, with_wild_motion, workers);
    int after = 0, end = 0;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const TrialResult& t = trials[i];
      const auto seed = static_cast<std::uint64_t>(seeds.first) + i;
      after += t.frames[wild_place(drive, seed) + 5].nees_position < kThreeSigma ? 1 : 0;
      end += t.frames.back().nees_position < kThreeSigma ? 1 : 0;
    }
    const auto mean = [&](const auto& value) { return mean_of(each(trials, value)).mean; };
    const auto rejected = [&](LocalizationSensor sensor) {
      return mean([&](const TrialResult& t) { return static_cast<double>(t.last.health_of(sensor).rejected); });
    };
    fmt::print("| {} | {:.0f} | {:.0f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", Subset::of(mask).name(),
               100.0 * after / seeds.count, 100.0 * end / seeds.count,
               mean([](const TrialResult& t) { return 1e3 * t.frames.back().distance_m; }),
               mean([](const TrialResult& t) {
                 return 1e3 * std::sqrt(t.last.world_from_body.covariance.diagonal().head<3>().sum());
               }),
               rejected(LocalizationSensor::vision), rejected(LocalizationSensor::imu));
    std::fflush(stdout);
  }
}

// Median and largest delay of the detection, and in how many trials there was none.
std::string detection_text(const std::vector<TrialResult>& trials) {
  std::vector<double> seconds, samples;
  for (const TrialResult& t : trials) {
    if (!t.detection) continue;
    seconds.push_back(t.detection->after_s);
    samples.push_back(t.detection->samples);
  }
  if (seconds.empty()) return "never";
  std::sort(seconds.begin(), seconds.end());
  std::sort(samples.begin(), samples.end());
  const std::size_t middle = seconds.size() / 2;
  std::string text = fmt::format("{:.2f}, {:.2f} s ({:.0f}, {:.0f})", seconds[middle], seconds.back(), samples[middle],
                                 samples.back());
  if (seconds.size() < trials.size()) text += fmt::format("; not in {}", trials.size() - seconds.size());
  return text;
}

void print_faults(const TrueDrive& drive, const Seeds& seeds, const ThreadPool& workers) {
  fmt::print("\n## {}: sensor faults, all sensors ({} seeds)\n\n", drive.scenario.name, seeds.count);
  fmt::print(
      "\"Inside 3 σ\": trials whose position error is inside the 99.7 % region of its covariance, 5 frames after the "
      "fault and at the end. Detected: median and largest time in seconds (and samples of the sensor) after which its "
      "health says so.\n\n");
  fmt::print(
      "| fault | final error, % | vision alone, same fault | largest error, mm | inside 3 σ after the fault | at the "
      "end | "
      "NEES pose "
      "at the end | detected | excluded / missing, frames per trial | state at the end "
      "|\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const FaultCase& fault : fault_cases(drive)) {
    const auto trials =
        run_trials(drive, Subset::of(15), seeds, fault.measurements, workers, Watch{fault.sensor, fault.from_s});
    const auto alone = run_trials(drive, Subset::of(0), seeds, fault.measurements, workers);
    int inside_after = 0, inside_end = 0, ok = 0;
    double largest = 0, excluded = 0, missing = 0;
    for (const TrialResult& t : trials) {
      std::size_t after = 0;
      while (after + 1 < t.frames.size() && t.frames[after].time_s < fault.to_s) ++after;
      after = std::min(after + 5, t.frames.size() - 1);
      inside_after += t.frames[after].nees_position < kThreeSigma ? 1 : 0;
      inside_end += t.frames.back().nees_position < kThreeSigma ? 1 : 0;
      for (const FrameError& s : t.frames) largest = std::max(largest, s.distance_m);
      const auto sensor = static_cast<std::size_t>(fault.sensor);
      excluded += t.states_s[sensor][static_cast<std::size_t>(SensorState::excluded)];
      missing += t.states_s[sensor][static_cast<std::size_t>(SensorState::missing)];
      ok += t.last.health[sensor].state == SensorState::ok ? 1 : 0;
    }
    const auto end = [](const TrialResult& t) { return t.final_percent; };
    const double n = static_cast<double>(trials.size());
    fmt::print(
        "| {} | {:.4f} | {:.4f} | {:.0f} | {} of {} | {} of {} | {:.2f} | {} | {:.1f} / {:.1f} | {} of {} ok |\n",
        fault.name, mean_of(each(trials, end)).mean, mean_of(each(alone, end)).mean, 1e3 * largest, inside_after,
        seeds.count, inside_end, seeds.count,
        mean_of(each(trials, [](const TrialResult& t) { return t.frames.back().nees_pose; })).mean,
        detection_text(trials), excluded / n, missing / n, ok, seeds.count);
    std::fflush(stdout);
  }
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--seeds", "30"},
                                                        {"--first", "1"},
                                                        {"--threads", "2"},
                                                        {"--config", "config"},
                                                        {"--tables", "all"},
                                                        {"--runs", "runs"},
                                                        {"--errors", ""}});
  if (arguments.scenarios.empty()) arguments.scenarios = {"rocky_20pct", "crater_rim", "loop"};
  const ThreadPool workers(arguments.number("--threads"));
  const Seeds seeds{arguments.number("--first"), arguments.number("--seeds")};
  fmt::print(
      "# Localization, Monte Carlo\n\nOdometry errors of {}. Final error: of the last "
      "position, "
      "over the distance travelled; ATE: RMS position error over the frames; both relative to the first pose. ±: 95 % "
      "confidence interval of the paired difference.\n",
      arguments.options.at("--errors"));
  for (const std::string& name : arguments.scenarios) {
    auto drive = open_true_drive(arguments.options.at("--config"), name);
    if (!drive)
      throw std::runtime_error(fmt::format("{}: no such scenario in {}", name, arguments.options.at("--config")));
    drive->odometry = resampled_odometry(arguments, name);
    const std::string& tables = arguments.options.at("--tables");
    if (tables == "all" || tables == "subsets") print_subsets(*drive, seeds, workers);
    if (tables == "all" || tables == "faults") print_faults(*drive, seeds, workers);
    if (tables == "all" || tables == "wild") print_wild_motions(*drive, seeds, workers);
  }
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
