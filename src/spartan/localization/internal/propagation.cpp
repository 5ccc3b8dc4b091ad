#include "spartan/localization/internal/propagation.h"

namespace spartan::internal {
namespace {

// White noise of acceleration and angular rate integrated over the step; the double integral correlates position with
// velocity.
void add_white_noise(Transition& t, const Eigen::Vector3d& accel_variance, const Eigen::Vector3d& rate_variance,
                     double seconds) {
  t.noise.block<3, 3>(error_at::kPosition, error_at::kPosition).diagonal() +=
      accel_variance * (seconds * seconds * seconds / 3);
  t.noise.block<3, 3>(error_at::kPosition, error_at::kVelocity).diagonal() += accel_variance * (seconds * seconds / 2);
  t.noise.block<3, 3>(error_at::kVelocity, error_at::kPosition).diagonal() += accel_variance * (seconds * seconds / 2);
  t.noise.block<3, 3>(error_at::kVelocity, error_at::kVelocity).diagonal() += accel_variance * seconds;
  t.noise.block<3, 3>(error_at::kAttitude, error_at::kAttitude).diagonal() += rate_variance * seconds;
}

Transition identity_transition() {
  Transition t;
  t.by_moving.setIdentity();
  t.by_constants.setZero();
  t.noise.setZero();
  return t;
}

struct Integrated {
  Eigen::Vector3d rotation;  // rotation vector
  Eigen::Matrix3d before, after;
  Eigen::Vector3d force_from, force_to;  // without bias, body
  Eigen::Vector3d acceleration;          // world
};

Integrated integrate(const NavigationState& s, const InertialStep& step, double gravity) {
  Integrated i;
  i.rotation = (0.5 * (step.gyro_from + step.gyro_to) - s.gyro_bias_rad_s) * step.seconds;
  i.before = s.world_from_body.rotation_matrix();
  i.after = i.before * exp_so3(i.rotation).toRotationMatrix();
  i.force_from = step.accel_from - s.accel_bias_m_s2;
  i.force_to = step.accel_to - s.accel_bias_m_s2;
  i.acceleration =
      0.5 * (i.before * i.force_from + i.after * i.force_to) - s.gravity_scale * gravity * true_up(s.gravity_tilt_rad);
  return i;
}

}  // namespace

NavigationState propagate(const NavigationState& s, const InertialStep& step, double gravity) {
  const Integrated i = integrate(s, step, gravity);
  const Eigen::Vector3d velocity = i.before * s.velocity_m_s;  // world
  NavigationState r = s;
  r.world_from_body = {
      s.world_from_body.rotation() * exp_so3(i.rotation),
      s.world_from_body.translation() + velocity * step.seconds + 0.5 * step.seconds * step.seconds * i.acceleration};
  r.velocity_m_s = r.world_from_body.rotation().conjugate() * (velocity + i.acceleration * step.seconds);
  return r;
}

// With δp = R ρ (to first order), v = R w the velocity in the world, a' = a + δa:
//   φ' = ΔRᵀ φ − J_r t δb_g
//   δv = R (ν − [w]× φ)
//   δa = −½ R [f₀]× φ − ½ R' [f₁]× φ' − ½ (R + R') δb_a − γ g ∂up δτ − g up δγ
//   ρ' = ΔRᵀ ρ + R'ᵀ (δv t + ½ δa t²),   ν' = R'ᵀ (δv + δa t) + [w']× φ'
Transition transition(const NavigationState& s, const InertialStep& step, const InertialNoise& noise, double gravity) {
  const Integrated i = integrate(s, step, gravity);
  const double t = step.seconds;
  Transition r = identity_transition();
  const Eigen::Matrix3d to_body = i.after.transpose(), back = to_body * i.before;
  const Eigen::Vector3d after = back * s.velocity_m_s + t * (to_body * i.acceleration);  // w'

  using Rows = Eigen::Matrix<double, 3, error_at::kMoving>;
  Rows rotation = Rows::Zero(), velocity = Rows::Zero(), accel = Rows::Zero();
  rotation.middleCols<3>(error_at::kAttitude) = back;
  rotation.middleCols<3>(error_at::kGyroBias) = -t * left_jacobian_so3(-i.rotation);
  velocity.middleCols<3>(error_at::kVelocity) = i.before;
  velocity.middleCols<3>(error_at::kAttitude) = -i.before * skew(s.velocity_m_s);
  accel = -0.5 * i.after * skew(i.force_to) * rotation;
  accel.middleCols<3>(error_at::kAttitude) -= 0.5 * i.before * skew(i.force_from);
  accel.middleCols<3>(error_at::kAccelBias) = -0.5 * (i.before + i.after);
  Eigen::Matrix3d accel_by_gravity;
  accel_by_gravity << -s.gravity_scale * gravity * true_up_jacobian(s.gravity_tilt_rad),
      -gravity * true_up(s.gravity_tilt_rad);

  r.by_moving.middleRows<3>(error_at::kAttitude) = rotation;
  r.by_moving.middleRows<3>(error_at::kVelocity) = to_body * (velocity + t * accel) + skew(after) * rotation;
  r.by_moving.middleRows<3>(error_at::kPosition) = to_body * (t * velocity + 0.5 * t * t * accel);
  r.by_moving.block<3, 3>(error_at::kPosition, error_at::kPosition) = back;
  r.by_constants.block<3, 3>(error_at::kVelocity, 0) = t * to_body * accel_by_gravity;
  r.by_constants.block<3, 3>(error_at::kPosition, 0) = 0.5 * t * t * to_body * accel_by_gravity;
  // A clock that is off by ε adds ε (ω₁ − ω₀)/t and ε (f₁ − f₀)/t to the readings, where a bias subtracts.
  static_assert(error_at::kGyroBias == 9);
  const auto by_biases = r.by_moving.topRows<error_at::kGyroBias>();
  r.by_constants.col(3).head<error_at::kGyroBias>() =
      -1 / t *
      (by_biases.middleCols<3>(error_at::kGyroBias) * (step.gyro_to - step.gyro_from) +
       by_biases.middleCols<3>(error_at::kAccelBias) * (step.accel_to - step.accel_from));

  add_white_noise(r, noise.accel.cwiseAbs2(), noise.gyro.cwiseAbs2(), t);
  r.noise.block<3, 3>(error_at::kGyroBias, error_at::kGyroBias).diagonal().array() +=
      noise.gyro_walk * noise.gyro_walk * t;
  r.noise.block<3, 3>(error_at::kAccelBias, error_at::kAccelBias).diagonal().array() +=
      noise.accel_walk * noise.accel_walk * t;
  return r;
}

// The velocity w is constant in the body frame: p' = p + ½ (R + R') w t.
NavigationState propagate(const NavigationState& s, const ConstantVelocityStep& step) {
  NavigationState r = s;
  const Eigen::Quaterniond before = s.world_from_body.rotation(),
                           after = before * exp_so3(step.rate_rad_s * step.seconds);
  r.world_from_body = {
      after, s.world_from_body.translation() + 0.5 * step.seconds * (before * s.velocity_m_s + after * s.velocity_m_s)};
  return r;
}

// ρ' = ΔRᵀ ρ + ½ t (ΔRᵀ (ν − [w]× φ) + ν − [w]× φ'),   φ' = ΔRᵀ φ,   ν' = ν
Transition transition(const NavigationState& s, const ConstantVelocityStep& step, const ConstantVelocityNoise& noise) {
  const double t = step.seconds;
  Transition r = identity_transition();
  const Eigen::Matrix3d back = exp_so3(step.rate_rad_s * t).toRotationMatrix().transpose();
  const Eigen::Matrix3d speed = skew(s.velocity_m_s);
  r.by_moving.block<3, 3>(error_at::kAttitude, error_at::kAttitude) = back;
  r.by_moving.block<3, 3>(error_at::kPosition, error_at::kPosition) = back;
  r.by_moving.block<3, 3>(error_at::kPosition, error_at::kVelocity) = 0.5 * t * (back + Eigen::Matrix3d::Identity());
  r.by_moving.block<3, 3>(error_at::kPosition, error_at::kAttitude) = -0.5 * t * (back * speed + speed * back);
  add_white_noise(r, Eigen::Vector3d::Constant(noise.velocity_m_s_sqrt_hz * noise.velocity_m_s_sqrt_hz),
                  Eigen::Vector3d::Constant(noise.attitude_rad_sqrt_hz * noise.attitude_rad_sqrt_hz), t);
  return r;
}

void propagate_covariance(ErrorCovariance& p, const Transition& t) {
  constexpr int kRest = error_at::kSize - error_at::kMoving;
  Eigen::Matrix<double, error_at::kMoving, error_at::kSize> rows;
  rows.noalias() = t.by_moving * p.topRows<error_at::kMoving>();
  rows.noalias() += t.by_constants * p.middleRows<4>(error_at::kGravityTilt);
  Eigen::Matrix<double, error_at::kMoving, error_at::kMoving> square =
      rows.leftCols<error_at::kMoving>() * t.by_moving.transpose();
  square.noalias() += rows.middleCols<4>(error_at::kGravityTilt) * t.by_constants.transpose();
  square += t.noise;
  p.topLeftCorner<error_at::kMoving, error_at::kMoving>() = 0.5 * (square + square.transpose());
  p.topRightCorner<error_at::kMoving, kRest>() = rows.rightCols<kRest>();
  p.bottomLeftCorner<kRest, error_at::kMoving>() = rows.rightCols<kRest>().transpose();
}

void propagate_covariance(StateEstimate& estimate, const Transition& t) {
  propagate_covariance(estimate.covariance, t);
  if (!estimate.past) return;
  ErrorCovariance& x = estimate.past->with_present;
  x.leftCols<error_at::kMoving>() = (x.leftCols<error_at::kMoving>() * t.by_moving.transpose() +
                                     x.middleCols<4>(error_at::kGravityTilt) * t.by_constants.transpose())
                                        .eval();
}

}  // namespace spartan::internal
