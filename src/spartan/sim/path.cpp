#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "spartan/core/pose.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim {
namespace {

// Distance covered during the acceleration phase, as a fraction of (full speed × ramp time): the integral of the
// smooth step t³(6t² − 15t + 10) from 0 to t in 0 … 1.
double ramp_integral(double t) {
  return t * t * t * t * (t * (t - 3) + 2.5);
}

PlanarPose interpolate(const PlanarPose& a, const PlanarPose& b, double part) {
  return {a.x + part * (b.x - a.x), a.y + part * (b.y - a.y), a.heading + part * (b.heading - a.heading)};
}

// Integrates a curve from its heading as a function of its length, by the midpoint rule with kParts sub-steps per step.
std::vector<PlanarPose> curve_of(double length_m, const std::function<double(double)>& heading) {
  constexpr int kParts = 20;
  std::vector<PlanarPose> curve{{0, 0, heading(0)}};
  const int steps = std::max(1, static_cast<int>(std::ceil(length_m / Motion::kStep_m - 1e-9)));
  for (int i = 0; i < steps; ++i) {
    PlanarPose p = curve.back();
    const double from = i * Motion::kStep_m, to = std::min((i + 1) * Motion::kStep_m, length_m);
    for (int k = 0; k < kParts; ++k) {
      const double h = heading(from + (k + 0.5) * (to - from) / kParts);
      p.x += (to - from) / kParts * std::cos(h);
      p.y += (to - from) / kParts * std::sin(h);
    }
    p.heading = heading(to);
    curve.push_back(p);
  }
  return curve;
}

// Moves a curve that starts at the origin to a start pose.
std::vector<PlanarPose> from_start(std::vector<PlanarPose> curve, const PlanarPose& start) {
  const double c = std::cos(start.heading), s = std::sin(start.heading);
  for (PlanarPose& p : curve) {
    p = {start.x + c * p.x - s * p.y, start.y + s * p.x + c * p.y, start.heading + p.heading};
  }
  return curve;
}

// Natural cubic spline through points, parameterized by chord length; `bend` holds the second derivatives at the knots.
struct Spline {
  std::vector<double> t;
  Eigen::MatrixX2d points, bend;

  explicit Spline(const std::vector<Eigen::Vector2d>& through) {
    const auto n = static_cast<Eigen::Index>(through.size());
    points.resize(n, 2);
    t.assign(1, 0.0);
    for (Eigen::Index i = 0; i < n; ++i) {
      points.row(i) = through[static_cast<std::size_t>(i)].transpose();
      if (i > 0) t.push_back(t.back() + (points.row(i) - points.row(i - 1)).norm());
    }
    Eigen::MatrixXd a = Eigen::MatrixXd::Identity(n, n);
    Eigen::MatrixX2d b = Eigen::MatrixX2d::Zero(n, 2);
    for (Eigen::Index i = 1; i + 1 < n; ++i) {
      const double before = width(i - 1), after = width(i);
      a(i, i - 1) = before / 6;
      a(i, i) = (before + after) / 3;
      a(i, i + 1) = after / 6;
      b.row(i) = (points.row(i + 1) - points.row(i)) / after - (points.row(i) - points.row(i - 1)) / before;
    }
    bend = a.partialPivLu().solve(b);
  }
  double width(Eigen::Index i) const { return t[static_cast<std::size_t>(i) + 1] - t[static_cast<std::size_t>(i)]; }
  Eigen::Vector2d at(Eigen::Index i, double part) const {
    const double h = width(i), a = 1 - part, b = part;
    return (a * points.row(i) + b * points.row(i + 1) +
            h * h / 6 * ((a * a * a - a) * bend.row(i) + (b * b * b - b) * bend.row(i + 1)))
        .transpose();
  }
};

// Resamples the spline at equal distances, with headings from the chords around each point.
std::vector<PlanarPose> smooth_curve(const std::vector<Eigen::Vector2d>& through) {
  const Spline spline(through);
  constexpr int kFine = 4000;
  std::vector<Eigen::Vector2d> fine;
  for (Eigen::Index i = 0; i + 1 < spline.points.rows(); ++i) {
    for (int k = 0; k < kFine; ++k) fine.push_back(spline.at(i, static_cast<double>(k) / kFine));
  }
  fine.push_back(through.back());
  std::vector<PlanarPose> curve{{fine[0].x(), fine[0].y(), 0}};
  double travelled = 0, due = Motion::kStep_m;
  for (std::size_t i = 1; i < fine.size(); ++i) {
    const double step = (fine[i] - fine[i - 1]).norm();
    while (step > 0 && travelled + step >= due) {
      const Eigen::Vector2d p = fine[i - 1] + (due - travelled) / step * (fine[i] - fine[i - 1]);
      curve.push_back({p.x(), p.y(), 0});
      due += Motion::kStep_m;
    }
    travelled += step;
  }
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const PlanarPose& a = curve[i == 0 ? 0 : i - 1];
    const PlanarPose& b = curve[std::min(i + 1, curve.size() - 1)];
    double heading = std::atan2(b.y - a.y, b.x - a.x);
    if (i > 0) heading = curve[i - 1].heading + std::remainder(heading - curve[i - 1].heading, 2 * std::numbers::pi);
    curve[i].heading = heading;
  }
  return curve;
}

Result<std::vector<PathLeg>> lay_waypoints(const PathOptions& o) {
  if (o.waypoints_m.empty() || o.waypoints_m.size() % 2 != 0) {
    return failure(ErrorCode::configuration, "must list the coordinates x, y, x, y … of at least one waypoint",
                   "waypoints_m");
  }
  std::vector<Eigen::Vector2d> through{{0, 0}};
  for (std::size_t i = 0; i < o.waypoints_m.size(); i += 2) {
    through.emplace_back(o.waypoints_m[i], o.waypoints_m[i + 1]);
    if ((through.back() - through[through.size() - 2]).norm() < 0.05)
      return failure(ErrorCode::configuration, "two successive waypoints are less than 5 cm apart", "waypoints_m");
  }
  const std::vector<PlanarPose> curve = smooth_curve(through);
  std::vector<PathLeg> legs;
  if (std::abs(curve.front().heading) > 1e-3) legs.push_back({{}, curve.front().heading, 0});
  legs.push_back({curve, 0, 0});
  return legs;
}

std::vector<PathLeg> lay_square_spiral(const PathOptions& o) {
  std::vector<PathLeg> legs;
  PlanarPose at;
  for (int i = 0; i < o.legs; ++i) {
    const double heading = at.heading;
    legs.push_back({from_start(curve_of(o.leg_m + i * o.growth_m, [](double) { return 0.0; }), at), 0, 0});
    at = legs.back().curve.back();
    if (i + 1 < o.legs) legs.push_back({{}, std::numbers::pi / 2, 0});
    at.heading = heading + std::numbers::pi / 2;
  }
  return legs;
}

}  // namespace

Motion Motion::stationary(const PlanarPose& at, double seconds) {
  Motion m;
  m.start_ = at;
  m.seconds_ = seconds;
  return m;
}

namespace {

// Speed profile of a motion over an amount: smooth ramps around a plateau. Short motions do not reach the full rate.
struct Profile {
  double rate, ramp_s, seconds;
};
Profile plan(double amount, double rate, double ramp_s) {
  const double reached = std::min(rate, amount / ramp_s);
  return {reached, ramp_s, reached > 0 ? ramp_s + amount / reached : 0};
}

}  // namespace

Motion Motion::turn(const PlanarPose& at, double angle_rad, double rate_rad_s, double ramp_s) {
  Motion m;
  m.start_ = at;
  m.amount_ = std::abs(angle_rad);
  m.turn_sign_ = angle_rad < 0 ? -1 : 1;
  const Profile p = plan(m.amount_, rate_rad_s, ramp_s);
  m.rate_ = p.rate;
  m.ramp_s_ = p.ramp_s;
  m.seconds_ = p.seconds;
  return m;
}

Motion Motion::drive(std::vector<PlanarPose> curve, double speed_m_s, double ramp_s) {
  Motion m;
  m.start_ = curve.front();
  m.amount_ = curve_length(curve);
  m.curve_ = std::move(curve);
  const Profile p = plan(m.amount_, speed_m_s, ramp_s);
  m.rate_ = p.rate;
  m.ramp_s_ = p.ramp_s;
  m.seconds_ = p.seconds;
  return m;
}

double Motion::progress(double t) const {
  if (rate_ <= 0 || t <= 0) return 0;
  if (t >= seconds_) return amount_;
  if (t > seconds_ - ramp_s_) return amount_ - rate_ * ramp_s_ * ramp_integral((seconds_ - t) / ramp_s_);
  if (t >= ramp_s_) return rate_ * (0.5 * ramp_s_ + (t - ramp_s_));
  return rate_ * ramp_s_ * ramp_integral(t / ramp_s_);
}

PlanarPose Motion::at(double t) const {
  const double done = progress(t);
  if (curve_.empty()) return {start_.x, start_.y, start_.heading + turn_sign_ * done};
  const double index = std::clamp(done / kStep_m, 0.0, static_cast<double>(curve_.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(index), curve_.size() - 2);
  // The last step may be shorter than the others.
  const double last_step = i + 2 == curve_.size() ? std::max(amount_ / kStep_m - static_cast<double>(i), 1e-9) : 1.0;
  return interpolate(curve_[i], curve_[i + 1], std::clamp((index - static_cast<double>(i)) / last_step, 0.0, 1.0));
}

double Motion::time_of(double target_progress) const {
  double low = 0, high = seconds_;
  while (high - low > 1e-6) {
    const double middle = 0.5 * (low + high);
    (progress(middle) < target_progress ? low : high) = middle;
  }
  return high;
}

double curve_length(const std::vector<PlanarPose>& curve) {
  if (curve.size() < 2) return 0;
  const PlanarPose &a = curve[curve.size() - 2], &b = curve.back();
  return static_cast<double>(curve.size() - 2) * Motion::kStep_m +
         std::min(Motion::kStep_m, std::hypot(b.x - a.x, b.y - a.y));
}

std::pair<std::vector<PlanarPose>, std::vector<PlanarPose>> cut(const std::vector<PlanarPose>& curve, double metres) {
  const auto at = std::clamp<std::ptrdiff_t>(std::lround(metres / Motion::kStep_m), 0,
                                             static_cast<std::ptrdiff_t>(curve.size()) - 1);
  return {{curve.begin(), curve.begin() + at + 1}, {curve.begin() + at, curve.end()}};
}

Result<std::vector<PathLeg>> lay_path(const PathOptions& o) {
  const double turn = o.turn_deg * kRadiansPerDegree, swing = o.swing_deg * kRadiansPerDegree;
  if (o.kind == PathKind::waypoints) return lay_waypoints(o);
  if (o.kind == PathKind::square_spiral) return lay_square_spiral(o);
  if (o.kind == PathKind::turn_in_place) return std::vector<PathLeg>{{{}, turn, 0}};
  if (o.kind == PathKind::stationary) return std::vector<PathLeg>{{{}, 0, o.stationary_s}};
  const auto heading = [&](double s) {
    if (o.kind == PathKind::arc) return turn * s / o.length_m;
    if (o.kind == PathKind::loop) return 2 * std::numbers::pi * s / o.length_m;
    if (o.kind == PathKind::winding) return swing * std::sin(2 * std::numbers::pi * s / o.wavelength_m);
    return 0.0;
  };
  return std::vector<PathLeg>{{curve_of(o.length_m, heading), 0, 0}};
}

}  // namespace spartan::sim
