#include "spartan/odometry/internal/motion/motion_problem.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace spartan::internal {
namespace {

/// c² of the Cauchy loss ρ(s) = c² ln(1 + s/c²) of a squared normalized residual s; empirical. A residual with s = c²
/// (2.4 standard deviations) has half the weight of a small one.
constexpr double kCauchy = 6.0;
/// Cost of a landmark that is predicted behind the camera: the Cauchy loss at s = c² (e¹⁰ − 1), so that no residual in
/// front of the camera costs more in practice.
constexpr double kBehindCameraCost = kCauchy * 10;
/// Information (px⁻²) of an offset that is taken as exact; large against that of any measurement.
constexpr double kExactInformation = 1e12;
/// Dimensions of a residual that a fit leaves at least; reached only where a motion rests on a few landmarks.
constexpr double kMinDimensions = 0.5;
using Jacobian = Eigen::Matrix<double, 3, 7>;

}  // namespace

struct MotionProblem::Frame {
  explicit Frame(const Pose& previous_from_current) {
    const Pose current_from_previous = previous_from_current.inverse();
    rotation = current_from_previous.rotation_matrix();
    translation = current_from_previous.translation();
  }
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

MotionProblem::MotionProblem(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                             const DisparityOffset& prior, bool robust)
    : stereo_(stereo), matches_(matches), prior_(prior), robust_(robust) {
  entries_.reserve(matches.size());
  for (const LandmarkMatch& m : matches) {
    const Eigen::Vector3d ray((m.point.pixel.x() - stereo.centre_px.x()) / stereo.focal_px,
                              (m.point.pixel.y() - stereo.centre_px.y()) / stereo.focal_px, 1);
    entries_.push_back({m.previous_from_anchor.rotation() * ray, m.previous_from_anchor.translation(), m.measured,
                        m.point.disparity, Eigen::Matrix3d::Identity()});
  }
}

MotionProblem::Projected MotionProblem::project(const Entry& entry, const Frame& frame, double offset) const {
  Projected p;
  p.w = (entry.disparity + offset) / (stereo_.focal_px * stereo_.baseline_m);
  p.q = frame.rotation * (entry.along + p.w * entry.from_anchor) + p.w * frame.translation;
  p.in_front = p.q.z() > kMinRelativeDepth;
  return p;
}

Eigen::Vector3d MotionProblem::residual(const Entry& entry, const Projected& p, double offset) const {
  const double g = 1 / p.q.z(), f = stereo_.focal_px;
  return {entry.measured.x() - (f * g * p.q.x() + stereo_.centre_px.x()),
          entry.measured.y() - (f * g * p.q.y() + stereo_.centre_px.y()),
          entry.measured.z() + offset - (entry.disparity + offset) * g};
}

Eigen::Vector3d MotionProblem::residual(std::size_t match, const MotionState& state) const {
  const Entry& entry = entries_[match];
  return residual(entry, project(entry, Frame(state.motion), state.offset), state.offset);
}

double MotionProblem::square(const Entry& entry, const Frame& frame, double offset) const {
  const Projected p = project(entry, frame, offset);
  if (!p.in_front) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d r = residual(entry, p, offset);
  return r.dot(entry.weight * r);
}

Jacobian MotionProblem::jacobian(const Entry& entry, const Projected& p, const Frame& frame, double offset) const {
  const double f = stereo_.focal_px, g = 1 / p.q.z();
  Eigen::Matrix3d by_q;
  by_q << f * g, 0, -f * g * g * p.q.x(),  //
      0, f * g, -f * g * g * p.q.y(),      //
      0, 0, -(entry.disparity + offset) * g * g;
  Jacobian j;
  j.leftCols<3>() = -p.w * by_q;
  j.middleCols<3>(3) = by_q * skew(p.q);
  // ∂h/∂d less the offset of the measurement.
  const Eigen::Vector3d by_inverse_depth = frame.rotation * entry.from_anchor + frame.translation;
  j.col(6) = by_q * by_inverse_depth / (f * stereo_.baseline_m) + Eigen::Vector3d(0, 0, g - 1);
  return j;
}

void MotionProblem::update_weights(const MotionState& state) {
  const Frame frame(state.motion);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Projected p = project(entries_[i], frame, state.offset);
    if (!p.in_front) continue;
    const Eigen::Vector3d by_disparity =
        jacobian(entries_[i], p, frame, state.offset).col(6) + Eigen::Vector3d(0, 0, 1);
    const Eigen::Matrix3d spread =
        matches_[i].covariance + matches_[i].disparity_variance * by_disparity * by_disparity.transpose();
    entries_[i].weight = spread.inverse();
  }
}

const std::vector<double>& MotionProblem::squares(const MotionState& state) {
  const Frame frame(state.motion);
  squares_.resize(entries_.size());
  for (std::size_t i = 0; i < entries_.size(); ++i) squares_[i] = square(entries_[i], frame, state.offset);
  return squares_;
}

double MotionProblem::prior_information() const {
  return prior_.variance > 0 ? 1 / prior_.variance : kExactInformation;
}

double MotionProblem::cost(const std::vector<bool>& used, const MotionState& state, double noise_scale) const {
  const Frame frame(state.motion);
  const double scale = 1 / (noise_scale * noise_scale), change = prior_.value - state.offset;
  double sum = prior_information() * change * change;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (!used[i]) continue;
    const double s = square(entries_[i], frame, state.offset) * scale;
    if (!std::isfinite(s)) {
      sum += kBehindCameraCost;
    } else {
      sum += robust_ ? kCauchy * std::log1p(s / kCauchy) : s;
    }
  }
  return sum;
}

template <class Visit>
void MotionProblem::for_each_residual(const std::vector<bool>& used, const MotionState& state, double noise_scale,
                                      const Visit& visit) const {
  const Frame frame(state.motion);
  const double scale = 1 / (noise_scale * noise_scale);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (!used[i]) continue;
    const Entry& entry = entries_[i];
    const Projected p = project(entry, frame, state.offset);
    if (!p.in_front) continue;
    const Eigen::Vector3d r = residual(entry, p, state.offset);
    visit(matches_[i], r, jacobian(entry, p, frame, state.offset), entry.weight, r.dot(entry.weight * r) * scale);
  }
}

NormalEquations<Matrix7d, Vector7d> MotionProblem::linearize(const std::vector<bool>& used, const MotionState& state,
                                                             double noise_scale) const {
  NormalEquations<Matrix7d, Vector7d> normal{cost(used, state, noise_scale), Matrix7d::Zero(), Vector7d::Zero()};
  const double scale = 1 / (noise_scale * noise_scale);
  const auto add = [&](const LandmarkMatch&, const Eigen::Vector3d& r, const Jacobian& j,
                       const Eigen::Matrix3d& inverse_spread, double s) {
    const double weight = scale * (robust_ ? 1 / (1 + s / kCauchy) : 1);  // ρ'(s)
    const Jacobian weighted = weight * inverse_spread * j;
    normal.information.noalias() += weighted.transpose() * j;
    normal.gradient.noalias() += weighted.transpose() * r;
  };
  for_each_residual(used, state, noise_scale, add);
  normal.information(6, 6) += prior_information();
  normal.gradient[6] += prior_information() * (prior_.value - state.offset);
  return normal;
}

Matrix7d MotionProblem::covariance(const std::vector<bool>& used, const MotionState& state, double noise_scale) const {
  Matrix7d a = Matrix7d::Zero(), b = Matrix7d::Zero();
  const double scale = 1 / (noise_scale * noise_scale);
  const auto add_slope = [&](const LandmarkMatch& match, const Eigen::Vector3d&, const Jacobian& j,
                             const Eigen::Matrix3d& inverse_spread, double s) {
    const double weight = robust_ ? 1 / (1 + s / kCauchy) : 1, slope = robust_ ? -weight * weight / kCauchy : 0;
    a += scale * (weight + 2.0 / match.dimensions() * s * slope) * (j.transpose() * inverse_spread * j);
  };
  for_each_residual(used, state, noise_scale, add_slope);
  a(6, 6) += prior_information();
  const Matrix7d inverse = a.ldlt().solve(Matrix7d::Identity());
  Eigen::Matrix<double, 7, 2> shared = Eigen::Matrix<double, 7, 2>::Zero();  // score of the shared error along u and v
  const auto add_score = [&](const LandmarkMatch& match, const Eigen::Vector3d&, const Jacobian& j,
                             const Eigen::Matrix3d& inverse_spread, double s) {
    const Matrix7d information = j.transpose() * inverse_spread * j;
    const double weight = robust_ ? 1 / (1 + s / kCauchy) : 1;
    // The fit follows each residual by its leverage: so many of its dimensions are left.
    const double leverage = scale * weight * information.cwiseProduct(inverse).sum();
    const double dimensions = std::max(match.dimensions() - leverage, kMinDimensions);
    b += scale * weight * weight * s / dimensions * information;
    shared += scale * weight * match.parallax_px * (j.transpose() * inverse_spread).leftCols<2>();
  };
  for_each_residual(used, state, noise_scale, add_score);
  b(6, 6) += prior_information();
  Matrix7d covariance = inverse * b * inverse.transpose();
  // Not of the offset: its random walk covers what lasts over many frames.
  const Eigen::Matrix<double, 6, 2> moved = kSharedViewpointError * (inverse * shared).topRows<6>();
  covariance.topLeftCorner<6, 6>() += moved * moved.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace spartan::internal
