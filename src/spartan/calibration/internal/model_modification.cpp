#include "spartan/calibration/internal/model_modification.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>

namespace spartan::internal {
namespace {

// Applies `change` to the values of the named parameters.
CameraModel with_changed(const CameraModel& model, std::initializer_list<std::string_view> keys,
                         const std::function<double(double)>& change) {
  const auto kinds = parameter_specs(model);
  ModelParameters numbers = parameters(model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (std::find(keys.begin(), keys.end(), kinds[i].key) == keys.end()) continue;
    for (double& v : numbers[i]) v = change(v);
  }
  return with_parameters(model, numbers);
}

}  // namespace

CameraModel with_scaled_focal_length(const CameraModel& model, double factor) {
  return with_changed(model, {"focal_px", "skew_px"}, [&](double v) { return v * factor; });
}

CameraModel resized(const CameraModel& model, double factor) {
  return with_changed(with_scaled_focal_length(model, factor), {"centre_px"},
                      [&](double v) { return (v + 0.5) * factor - 0.5; });
}

CameraModel with_row_offset(const CameraModel& model, double rows_px) {
  const auto kinds = parameter_specs(model);
  ModelParameters numbers = parameters(model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i].key == "centre_px") numbers[i].back() += rows_px;
  }
  return with_parameters(model, numbers);
}

CameraModel with_square_pixels(const CameraModel& model, bool by_x) {
  const auto kinds = parameter_specs(model);
  ModelParameters numbers = parameters(model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i].key == "focal_px") numbers[i].assign(numbers[i].size(), by_x ? numbers[i].front() : numbers[i].back());
  }
  return with_parameters(model, numbers);
}

CameraModel with_division_distortion(const CameraModel& model, double k, ImageSize size) {
  const auto* plain = std::get_if<PinholeModel>(&model);
  const auto* radial = std::get_if<RadialTangentialModel>(&model);
  if (!plain && !radial) return model;
  const PinholeModel pinhole = plain ? *plain : radial->pinhole();
  const double across = std::max(pinhole.cx, size.width - 1 - pinhole.cx) / pinhole.fx,
               down = std::max(pinhole.cy, size.height - 1 - pinhole.cy) / pinhole.fy;
  // For a negative k the undistorted radius diverges at 1 + k r_d² = 0: the fit ends where that factor is 0.3
  // (empirical).
  constexpr int kRadii = 100;  // samples of the fit
  constexpr double kSmallestFactor = 0.3;
  const auto undistorted = [&](double distorted) { return distorted / (1 + k * distorted * distorted); };
  const double corner = std::hypot(across, down);
  const double last = k < 0 ? std::min(corner, std::sqrt((1 - kSmallestFactor) / -k)) : corner;
  const double reach = undistorted(last) * undistorted(last);
  // g = r_d/r_u ≈ (1 + k1 s + k2 s²)/(1 + k4 s + k5 s²) with s = r_u²; multiplied by the denominator it is linear in
  // k1, k2, k4, k5.
  Eigen::Matrix<double, kRadii, 4> by_coefficient;
  Eigen::Matrix<double, kRadii, 1> wanted;
  for (int i = 0; i < kRadii; ++i) {
    const double distorted = last * (i + 1) / kRadii, r = undistorted(distorted), g = distorted / r, s = r * r / reach;
    by_coefficient.row(i) = r * Eigen::RowVector4d(s, s * s, -g * s, -g * s * s);
    wanted[i] = r * (g - 1);
  }
  const Eigen::Vector4d c = by_coefficient.colPivHouseholderQr().solve(wanted);
  return RadialTangentialModel(
      pinhole, {c[0] / reach, c[1] / (reach * reach), 0, 0, 0, c[2] / reach, c[3] / (reach * reach), 0});
}

}  // namespace spartan::internal
