// Visual motions of a simulated drive with the errors of the odometry on rendered drives.
#pragma once

#include <fmt/format.h>

#include <memory>
#include <stdexcept>

#include "localization_trial.h"
#include "odometry_errors.h"
#include "standard_recordings.h"

namespace spartan {

/// Typical covariance of the motions of a run, body frame.
struct ReportedMotion {
  Matrix6d covariance, root;
};
inline ReportedMotion reported_motion(const std::string& recording, const std::string& run) {
  const auto source = open_recording(recording);
  const auto motions = motions_of_run(run);
  if (!source || !motions || motions->empty()) throw std::runtime_error(run + ": is no run of " + recording);
  const Rig& rig = (*source)->info().rig;
  const auto pair = std::find_if(rig.pairs.begin(), rig.pairs.end(), [](const auto& p) { return p.for_odometry; });
  const Matrix6d ad = adjoint(rig.body_from_camera(pair->left)), camera = typical_covariance(*motions);
  return {ad * camera * ad.transpose(), ad * Matrix6d(camera.llt().matrixL())};
}

/// The true motions with errors of the odometry.
inline std::vector<RelativeMotion> motions_with_errors(const TrueDrive& drive, const ReportedMotion& reported,
                                                       const OdometryErrors& errors, std::uint64_t seed) {
  const WhitenedErrors whitened = errors.draw(drive.poses.size(), seed);
  std::vector<RelativeMotion> motions;
  for (std::size_t i = 1; i < drive.poses.size(); ++i) {
    RelativeMotion m;
    m.from = sim::internal::stamp_at(drive.frames_s[i - 1]);
    m.to = sim::internal::stamp_at(drive.frames_s[i]);
    m.previous_from_current = drive.poses[i - 1].inverse() * drive.poses[i] * exp_se3(reported.root * whitened[i]);
    m.covariance = reported.covariance;
    motions.push_back(m);
  }
  return motions;
}

/// By the options of a benchmark: the errors are those of RECORDINGS/NAME with the run RUNS/NAME for each NAME of
/// --errors, scaled to the covariance that the run RUNS/SCENARIO reported. Throws std::runtime_error.
inline decltype(TrueDrive::odometry) resampled_odometry(const RecordingArguments& arguments,
                                                        const std::string& scenario) {
  const std::string& runs = arguments.options.at("--runs");
  const auto errors =
      std::make_shared<const OdometryErrors>(odometry_errors(arguments.folder, runs, arguments.options.at("--errors")));
  const ReportedMotion reported =
      reported_motion(fmt::format("{}/{}", arguments.folder, scenario), fmt::format("{}/{}", runs, scenario));
  return [errors, reported](const TrueDrive& drive, std::uint64_t seed) {
    return motions_with_errors(drive, reported, *errors, seed);
  };
}

}  // namespace spartan
