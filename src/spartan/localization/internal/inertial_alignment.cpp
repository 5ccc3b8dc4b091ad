#include "spartan/localization/internal/inertial_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace spartan::internal {
namespace {

constexpr std::size_t kMinSegments = 3, kMinSegmentsWithUp = 1;
/// Quantile of chi-square with 6 degrees of freedom, 99.9 %: the biases together.
constexpr double kMaxBiasChiSquare = 22.5;
/// Largest chi-square per degree of freedom: three times the expected noise.
constexpr double kMaxNoiseFactor = 9;
constexpr int kIterations = 5;
/// Index of the first unknown of each part; the velocities follow, three for each frame.
constexpr int kGyro = 0, kAccel = 3, kUp = 6, kTime = 8, kVelocities = 9;

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

struct Unknowns {
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d up;                 // in the first body frame, as are the velocities
  Eigen::Matrix<double, 3, 2> basis;  // of the plane normal to `up`
  double time = 0;
  std::vector<Eigen::Vector3d> velocities{};  // at the frames

  void set_up(const Eigen::Vector3d& direction) {
    up = direction.normalized();
    const Eigen::Vector3d other = std::abs(up.x()) < 0.7 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    basis.col(0) = up.cross(other).normalized();
    basis.col(1) = up.cross(basis.col(0));
  }
};

// Rotation of the first body frame from each frame.
std::vector<Eigen::Matrix3d> attitudes(std::span<const AlignmentSegment> segments) {
  std::vector<Eigen::Matrix3d> all{Eigen::Matrix3d::Identity()};
  all.reserve(segments.size() + 1);
  for (const AlignmentSegment& s : segments) all.push_back(all.back() * s.motion.rotation_matrix());
  return all;
}

// The mean specific force points up, but for the change of the velocity.
Unknowns first_guess(std::span<const AlignmentSegment> segments, const std::vector<Eigen::Matrix3d>& attitude) {
  Unknowns x;
  x.velocities.assign(segments.size() + 1, Eigen::Vector3d::Zero());
  Eigen::Vector3d change = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < segments.size(); ++k) {
    x.velocities[k] = attitude[k] * segments[k].motion.translation() / segments[k].inertial.seconds;
    change += attitude[k] * segments[k].inertial.velocity;
  }
  x.velocities.back() = x.velocities[segments.size() - 1];
  x.set_up(change - (x.velocities.back() - x.velocities.front()));
  return x;
}

struct Equation {
  Vector9d residual;
  Eigen::Matrix<double, 9, 9> by_common;                      // biases, up, time
  Eigen::Matrix<double, 9, 3> by_velocity, by_next_velocity;  // of both frames
  Matrix9d covariance;
};

// Residual = measurement − prediction, with the derivatives of the prediction.
Equation equation_of(const AlignmentSegment& s, const Eigen::Matrix3d& attitude, const Unknowns& x, std::size_t k,
                     double gravity) {
  const Preintegration& imu = s.inertial;
  const double t = imu.seconds;
  const Eigen::Matrix3d back = attitude.transpose();
  const Eigen::Vector3d gyro = x.gyro_bias - imu.gyro_bias_rad_s, accel = x.accel_bias - imu.accel_bias_m_s2;
  const Eigen::Matrix3d turned = imu.rotation * exp_so3(imu.rotation_by_gyro * gyro).toRotationMatrix();
  Equation e;
  e.residual.head<3>() = log_so3(Eigen::Quaterniond(turned.transpose() * s.motion.rotation_matrix()));
  e.residual.segment<3>(3) = back * (x.velocities[k + 1] - x.velocities[k] + gravity * t * x.up) - imu.velocity -
                             imu.velocity_by_gyro * gyro - imu.velocity_by_accel * accel;
  e.residual.tail<3>() = s.motion.translation() - back * (t * x.velocities[k] - 0.5 * gravity * t * t * x.up) -
                         imu.position - imu.position_by_gyro * gyro - imu.position_by_accel * accel;
  e.by_common.setZero();
  e.by_common.block<3, 3>(0, kGyro) = imu.rotation_by_gyro;
  e.by_common.block<3, 3>(3, kGyro) = imu.velocity_by_gyro;
  e.by_common.block<3, 3>(6, kGyro) = imu.position_by_gyro;
  e.by_common.block<3, 3>(3, kAccel) = imu.velocity_by_accel;
  e.by_common.block<3, 3>(6, kAccel) = imu.position_by_accel;
  e.by_common.block<3, 2>(3, kUp) = -gravity * t * back * x.basis;
  e.by_common.block<3, 2>(6, kUp) = -0.5 * gravity * t * t * back * x.basis;
  e.residual -= x.time * imu.by_time;
  e.by_common.col(kTime) = imu.by_time;
  e.by_velocity << Eigen::Matrix3d::Zero(), back, t * back;
  e.by_next_velocity << Eigen::Matrix3d::Zero(), -back, Eigen::Matrix3d::Zero();
  // The motion's right perturbation (ρ, φ): D Exp(φ), d + D ρ.
  Eigen::Matrix<double, 9, 6> by_motion = Eigen::Matrix<double, 9, 6>::Zero();
  by_motion.block<3, 3>(0, 3).setIdentity();
  by_motion.block<3, 3>(6, 0) = s.motion.rotation_matrix();
  e.covariance = imu.covariance + by_motion * s.covariance * by_motion.transpose();
  e.covariance.diagonal().array() += 1e-16;
  return e;
}

struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd vector;
  double chi_square = 0, bias_chi_square = 0;  ///< the second: its part by the prior of the biases
};

NormalEquations normal_equations(std::span<const AlignmentSegment> segments,
                                 const std::vector<Eigen::Matrix3d>& attitude, const Unknowns& x,
                                 const AlignmentPrior& prior) {
  const auto count = static_cast<Eigen::Index>(kVelocities + 3 * x.velocities.size());
  NormalEquations n{Eigen::MatrixXd::Zero(count, count), Eigen::VectorXd::Zero(count)};
  const auto add_prior = [&](int at, const Eigen::Vector3d& value, double sigma) {
    const double weight = 1 / std::max(sigma * sigma, 1e-18);
    n.matrix.diagonal().segment<3>(at).array() += weight;
    n.vector.segment<3>(at) -= weight * value;
    n.bias_chi_square += weight * value.squaredNorm();
  };
  add_prior(kGyro, x.gyro_bias, prior.gyro_bias_rad_s);
  add_prior(kAccel, x.accel_bias, prior.accel_bias_m_s2);
  n.chi_square = n.bias_chi_square;
  const double time_weight = 1 / std::max(prior.time_s * prior.time_s, 1e-18);
  n.matrix(kTime, kTime) += time_weight;
  n.vector[kTime] -= time_weight * x.time;
  n.chi_square += time_weight * x.time * x.time;
  if (prior.up) {
    const double weight = 1 / (prior.up_sigma_rad * prior.up_sigma_rad);
    const Eigen::Vector2d off = x.basis.transpose() * (attitude.back() * *prior.up);
    n.matrix.diagonal().segment<2>(kUp).array() += weight;
    n.vector.segment<2>(kUp) += weight * off;
    n.chi_square += weight * off.squaredNorm();
  }
  constexpr int kAll = kVelocities + 6;
  Eigen::Matrix<double, 9, kAll> jacobian;
  for (std::size_t k = 0; k < segments.size(); ++k) {
    const Equation e = equation_of(segments[k], attitude[k], x, k, prior.gravity_m_s2);
    const Eigen::LLT<Matrix9d> llt(e.covariance);
    jacobian << e.by_common, e.by_velocity, e.by_next_velocity;
    const Eigen::Matrix<double, 9, kAll> white = llt.matrixL().solve(jacobian);
    const Vector9d residual = llt.matrixL().solve(e.residual);
    n.chi_square += residual.squaredNorm();
    const Eigen::Matrix<double, kAll, kAll> square = white.transpose() * white;
    const Eigen::Matrix<double, kAll, 1> right = white.transpose() * residual;
    const auto v = static_cast<Eigen::Index>(kVelocities + 3 * k);
    n.matrix.topLeftCorner<kVelocities, kVelocities>() += square.topLeftCorner<kVelocities, kVelocities>();
    n.matrix.block<kVelocities, 6>(0, v) += square.topRightCorner<kVelocities, 6>();
    n.matrix.block<6, kVelocities>(v, 0) += square.bottomLeftCorner<6, kVelocities>();
    n.matrix.block<6, 6>(v, v) += square.bottomRightCorner<6, 6>();
    n.vector.head<kVelocities>() += right.head<kVelocities>();
    n.vector.segment<6>(v) += right.tail<6>();
  }
  return n;
}

void step(Unknowns& x, const Eigen::VectorXd& by) {
  x.gyro_bias += by.segment<3>(kGyro);
  x.accel_bias += by.segment<3>(kAccel);
  x.set_up(x.up + x.basis * by.segment<2>(kUp));
  x.time += by[kTime];
  for (std::size_t k = 0; k < x.velocities.size(); ++k)
    x.velocities[k] += by.segment<3>(static_cast<Eigen::Index>(kVelocities + 3 * k));
}

}  // namespace

std::optional<InertialAlignment> align_inertially(std::span<const AlignmentSegment> segments,
                                                  const AlignmentPrior& prior) {
  if (segments.size() < (prior.up ? kMinSegmentsWithUp : kMinSegments)) return std::nullopt;
  const std::vector<Eigen::Matrix3d> attitude = attitudes(segments);
  Unknowns x = first_guess(segments, attitude);
  if (prior.up) x.set_up(attitude.back() * *prior.up);
  for (int i = 0; i < kIterations; ++i) {
    const NormalEquations n = normal_equations(segments, attitude, x, prior);
    const Eigen::VectorXd by = n.matrix.ldlt().solve(n.vector);
    if (!by.allFinite()) return std::nullopt;
    step(x, by);
  }
  const NormalEquations n = normal_equations(segments, attitude, x, prior);
  if (!(n.bias_chi_square <= kMaxBiasChiSquare)) return std::nullopt;
  // 9 residuals of each segment and those of the prior, less the unknowns.
  const double freedom =
      9.0 * static_cast<double>(segments.size()) + (prior.up ? 9 : 7) - static_cast<double>(n.vector.size());
  InertialAlignment r;
  r.noise_factor = std::max(1.0, n.chi_square / freedom);
  if (!(r.noise_factor <= kMaxNoiseFactor)) return std::nullopt;
  const Eigen::LLT<Eigen::MatrixXd> llt(n.matrix);
  if (llt.info() != Eigen::Success) return std::nullopt;

  const Eigen::Matrix3d to_last = attitude.back().transpose();
  Eigen::MatrixXd by_unknowns = Eigen::MatrixXd::Zero(13, n.vector.size());
  by_unknowns.block<6, 6>(0, 0).setIdentity();
  by_unknowns.block<3, 3>(6, n.vector.size() - 3) = to_last;
  by_unknowns.block<3, 2>(9, kUp) = to_last * x.basis;
  by_unknowns(12, kTime) = 1;
  const Eigen::MatrixXd half = llt.matrixL().solve(by_unknowns.transpose());
  r.covariance = r.noise_factor * half.transpose() * half;
  r.gyro_bias_rad_s = x.gyro_bias;
  r.accel_bias_m_s2 = x.accel_bias;
  r.time_offset_s = x.time;
  r.velocity_m_s = to_last * x.velocities.back();
  r.up = to_last * x.up;
  return r;
}

}  // namespace spartan::internal
