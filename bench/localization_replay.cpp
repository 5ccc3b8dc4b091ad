// Replays the localization of rendered recordings with stored odometry: `make bench-localization_replay ARGS="..."`.
//
//   localization_replay [--from FOLDER] [--runs FOLDER] SCENARIO...
//
// FOLDER/SCENARIO of --from is a recording with sensors and ground truth; of --runs, the output of `spartan run
// --odometry-only` for it. Localizes with every subset of sensors over the same odometry.
#include <fmt/format.h>

#include <stdexcept>

#include "localization_trial.h"
#include "odometry_errors.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

// A recorded drive in the form of a simulated one.
struct RecordedDrive {
  TrueDrive truth;
  DrawnDrive drawn;
};

std::optional<RecordedDrive> open_recorded(const std::string& recording, const std::string& run) {
  auto source = open_recording(recording);
  const auto poses = load_trajectory(recording + "/truth/poses.tum");
  const auto motions = motions_of_run(run);
  if (!source || !poses || !motions || motions->empty()) return std::nullopt;
  RecordedDrive drive;
  const RecordingInfo& info = (*source)->info();
  drive.truth.scenario.gravity_m_s2 = info.gravity_m_s2.value_or(9.81);
  const auto pair =
      std::find_if(info.rig.pairs.begin(), info.rig.pairs.end(), [](const auto& p) { return p.for_odometry; });
  if (pair == info.rig.pairs.end()) return std::nullopt;
  const Pose body_from_left = info.rig.body_from_camera(pair->left), left_from_body = body_from_left.inverse();
  while (true) {
    auto sample = (*source)->next();
    if (!sample || !*sample) break;
    const Sample& s = **sample;
    if (const auto* imu = std::get_if<ImuSample>(&s)) drive.drawn.imu.push_back(*imu);
    if (const auto* wheels = std::get_if<WheelSample>(&s)) drive.drawn.wheels.push_back(*wheels);
    if (const auto* compass = std::get_if<CompassSample>(&s)) drive.drawn.compass.push_back(*compass);
    if (const auto* tilt = std::get_if<InclinometerSample>(&s)) drive.drawn.inclinometer.push_back(*tilt);
  }
  const auto add_frame = [&](Stamp stamp) {
    drive.truth.frames_s.push_back(seconds_between(sim::internal::stamp_at(0), stamp));
    drive.truth.poses.push_back(pose_near(poses->poses, stamp).pose);
  };
  const Matrix6d ad = adjoint(body_from_left);
  add_frame(motions->front().from);
  for (const MeasuredMotion& m : *motions) {
    add_frame(m.to);
    drive.drawn.motions.push_back({m.from, m.to, body_from_left * m.previous_from_current * left_from_body,
                                   ad * m.covariance * ad.transpose(), m.measured});
  }
  for (std::size_t i = 1; i < drive.truth.poses.size(); ++i)
    drive.truth.length_m += (drive.truth.poses[i].translation() - drive.truth.poses[i - 1].translation()).norm();
  return drive;
}

double mean_nees(const TrialResult& r, double FrameError::*which) {
  double sum = 0;
  for (const FrameError& s : r.frames) sum += s.*which;
  return sum / static_cast<double>(r.frames.size());
}

void run(const std::vector<std::string>& words) {
  const RecordingArguments arguments = read_arguments(words, {{"--runs", "runs"}});
  fmt::print("| recording | sensors | final error, % | ATE, mm | NEES over all frames: position | attitude | pose |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  for (const std::string& name : arguments.scenarios) {
    const auto drive = open_recorded(arguments.folder + "/" + name, arguments.options.at("--runs") + "/" + name);
    if (!drive) throw std::runtime_error(name + ": there is no recording with ground truth, or no run of it");
    for (int mask = 0; mask < 16; ++mask) {
      const TrialResult r =
          run_trial(drive->truth, arrivals(drive->drawn, Subset::of(mask)), options_for(drive->truth));
      fmt::print("| {} | {} | {:.4f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", name, Subset::of(mask).name(),
                 r.final_percent, 1e3 * r.ate_m, mean_nees(r, &FrameError::nees_position),
                 mean_nees(r, &FrameError::nees_attitude), mean_nees(r, &FrameError::nees_pose));
    }
  }
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
