#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "spartan/core/options.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/localization/localizer.h"
#include "spartan/report/report.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"
#include "spartan/system/run_folder.h"

namespace spartan {
namespace {

/// At most so many starts of segments, evenly spread over the drive.
constexpr std::size_t kMaxStarts = 400;

/// A motion of the body, and where its end is along the true path.
struct Step {
  RelativeMotion motion;
  Pose true_motion;
  double end_m = 0;
};

/// Consecutive measured motions: each begins where the one before ends.
using Chain = std::vector<Step>;

const StampedPose* nearest(const Trajectory& truth, Stamp stamp, double max_dt_s) {
  const auto after = std::lower_bound(truth.begin(), truth.end(), stamp,
                                      [](const StampedPose& pose, Stamp s) { return pose.stamp < s; });
  const StampedPose* best = nullptr;
  for (auto it = after == truth.begin() ? after : after - 1; it != truth.end() && it <= after; ++it) {
    const double apart_s = std::abs(seconds_between(it->stamp, stamp));
    if (apart_s > max_dt_s) continue;
    if (best == nullptr || apart_s < std::abs(seconds_between(best->stamp, stamp))) best = &*it;
  }
  return best;
}

/// The frames between which motions are transported.
struct Mounting {
  const Rig& rig;
  const StereoPair& pair;
  CalibrationErrors errors;
  Pose body_from_camera;  // the rectified left camera
  Pose truth_from_body;   // truth: the frame whose poses the truth of the recording states

  CalibrationEffect effect_of_calibration(const Pose& body_motion) const {
    return calibration_effect(body_motion, body_from_camera, rig, pair, errors);
  }
};

Mounting mounting_of(const Rig& rig, const StereoPair& pair, const CalibrationErrors& errors) {
  const RectifyingAxes axes = rectifying_axes(rig.right_from_left(pair));
  Mounting mounting{rig, pair, errors, {}, {}};
  mounting.body_from_camera = rig.body_from_camera(pair.left) * Pose(axes.left_from_rectified, Eigen::Vector3d::Zero());
  if (rig.convention == PoseConvention::left_optical)
    mounting.truth_from_body = rig.body_from_camera(rig.pairs.front().left).inverse();
  return mounting;
}

/// Split where a frame was not measured from the one before.
std::vector<Chain> chains_of(const std::vector<FrameRecord>& frames, const Mounting& mounting, const Trajectory& truth,
                             double max_dt_s) {
  std::vector<Chain> chains(1);
  const Pose &body_from_camera = mounting.body_from_camera, &truth_from_body = mounting.truth_from_body;
  const Matrix6d to_body = adjoint(body_from_camera);
  double along_m = 0;
  for (const FrameRecord& frame : frames) {
    if (!frame.has_pose || frame.motion.first) continue;
    const StampedPose *from = nearest(truth, frame.motion.from, max_dt_s), *to = nearest(truth, frame.stamp, max_dt_s);
    if (from == nullptr || to == nullptr) continue;
    Step step;
    step.motion.from = frame.motion.from;
    step.motion.to = frame.stamp;
    step.motion.previous_from_current =
        body_from_camera * frame.motion.previous_from_current * body_from_camera.inverse();
    step.motion.covariance = to_body * frame.motion.covariance * to_body.transpose();
    step.motion.by_calibration = mounting.effect_of_calibration(step.motion.previous_from_current);
    step.true_motion = truth_from_body.inverse() * from->pose.inverse() * to->pose * truth_from_body;
    along_m += step.true_motion.translation().norm();
    step.end_m = along_m;
    if (!chains.back().empty() && chains.back().back().motion.to != step.motion.from) chains.emplace_back();
    chains.back().push_back(step);
  }
  return chains;
}

/// None where the covariance is singular: a motion that is exact by definition.
std::optional<double> normalized_error(const Pose& truth, const Pose& estimate, const Matrix6d& covariance) {
  const Eigen::LLT<Matrix6d> factors(covariance);
  if (factors.info() != Eigen::Success) return std::nullopt;
  const Vector6d error = log_se3(truth.inverse() * estimate);
  return error.dot(factors.solve(error));
}

NormalizedErrors summary_of(double length_m, std::vector<double> values) {
  NormalizedErrors result;
  result.length_m = length_m;
  result.count = static_cast<int>(values.size());
  if (values.empty()) return result;
  const ErrorStatistics statistics = statistics_of(std::move(values));
  result.mean = statistics.mean;
  result.median = statistics.median;
  return result;
}

/// Adds the errors of the segments that begin with one step of a chain. `lengths_m` increase.
void add_segments(const Chain& chain, std::size_t start, const std::vector<double>& lengths_m,
                  DeadReckoning dead_reckoning, std::vector<std::vector<double>>& of_length) {
  const double begin_m = chain[start].end_m - chain[start].true_motion.translation().norm();
  Pose estimate, truth;
  std::size_t next = 0;
  for (std::size_t i = start; i < chain.size() && next < lengths_m.size(); ++i) {
    dead_reckoning.add(chain[i].motion);
    estimate = estimate * chain[i].motion.previous_from_current;
    truth = truth * chain[i].true_motion;
    for (; next < lengths_m.size() && chain[i].end_m - begin_m >= lengths_m[next]; ++next) {
      const auto error = normalized_error(truth, estimate, dead_reckoning.covariance());
      if (error) of_length[next].push_back(*error);
    }
  }
}

}  // namespace

Result<MotionConsistency> motion_consistency(const std::string& run, const Trajectory& truth, double max_dt_s,
                                             std::vector<double> lengths_m) {
  const RunFolder folder{run};
  const auto options = load_options<RunOptions>(folder.config());
  if (!options) return failure(options);
  const auto rig = read_rig_yaml(folder.rig());
  if (!rig) return failure(rig);
  auto store = RunStore::open_read_only(folder.store());
  if (!store) return failure(store);
  const auto frames = store->frames();
  if (!frames) return failure(frames);
  if (frames->empty()) return failure(ErrorCode::input, "contains no frames", folder.store());
  const StereoPair* pair = rig->find_pair(frames->front().pair);
  if (pair == nullptr) return failure(ErrorCode::input, "has frames of a pair that the rig does not have", run);
  if (rig->find_camera(pair->left)->mount != "body")
    return failure(ErrorCode::input, "has cameras on a pan-tilt unit, whose angles a run does not store", run);
  auto fresh = DeadReckoning::create(options->localization.vision);
  if (!fresh) return failure(fresh);

  const std::vector<Chain> chains = chains_of(
      *frames, mounting_of(*rig, *pair, resolved_options(*options, *rig).mapping.map.calibration), truth, max_dt_s);
  std::sort(lengths_m.begin(), lengths_m.end());
  std::vector<double> of_motions;
  std::vector<std::vector<double>> of_length(lengths_m.size());
  const std::size_t every = frames->size() / kMaxStarts + 1;
  for (const Chain& chain : chains) {
    for (const Step& step : chain) {
      const auto error = normalized_error(step.true_motion, step.motion.previous_from_current, step.motion.covariance);
      if (error) of_motions.push_back(*error);
    }
    for (std::size_t start = 0; start < chain.size(); start += every)
      add_segments(chain, start, lengths_m, *fresh, of_length);
  }
  MotionConsistency result;
  result.motions = summary_of(0, std::move(of_motions));
  for (std::size_t i = 0; i < lengths_m.size(); ++i)
    result.segments.push_back(summary_of(lengths_m[i], std::move(of_length[i])));
  return result;
}

}  // namespace spartan
