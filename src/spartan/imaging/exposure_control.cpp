#include "spartan/imaging/exposure_control.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "spartan/imaging/internal/camera_stage.h"

namespace spartan {
namespace {

constexpr int kProbeStep_px = 5;       // odd: all colours of a Bayer mosaic
constexpr double kHorizon_rad = 0.05;  // 3°
constexpr double kLeastGround = 0.05;  // share of the probes
constexpr int kBins = 1024;
constexpr double kHighQuantile = 0.98;
// Where the high quantile is saturated, the brightness that it would have is unknown: taken for 1.5 × full scale. That
// of a saturated median follows from the share s > ½ of saturated pixels, 1 + (s − ½); 5 where hardly any pixel is not
// saturated. A factor that is too small or too large in one step is followed by another step.
constexpr double kSaturated = 0.995, kBeyondHigh = 1.5, kBeyondMedian = 5, kAllSaturated = 0.99;
constexpr double kLargestFactor = 16;
constexpr double kSameSetting = 1e-3;     // relative; cameras round their settings
constexpr double kNearest_m = 1;          // where the rig does not state it
constexpr double kLeastMedian = 1.0 / 3;  // of the level, where highlights would be saturated

struct Counts {
  std::array<std::uint32_t, kBins> bins{};
  std::uint32_t total = 0, saturated = 0;

  void add(int value, int full_scale) {
    ++bins[static_cast<std::size_t>(static_cast<std::int64_t>(value) * (kBins - 1) / full_scale)];
    ++total;
    if (value >= full_scale) ++saturated;
  }
  double quantile(double part) const {
    const auto wanted = static_cast<std::uint32_t>(part * total);
    std::uint32_t seen = 0;
    for (std::size_t i = 0; i < bins.size(); ++i) {
      seen += bins[i];
      if (seen > wanted) return (static_cast<double>(i) + 0.5) / kBins;
    }
    return 1;
  }
};

int sample_at(const FrameImage& image, int x, int y) {
  const bool colour = image.format().layout == PixelLayout::rgb;
  if (image.format().bytes_per_sample() == 1) return colour ? image.as<Rgb8>()(x, y).g : image.as<std::uint8_t>()(x, y);
  return colour ? image.as<Rgb16>()(x, y).g : image.as<std::uint16_t>()(x, y);
}

// In the middle of the image; 0 where the camera sees nothing there.
double pixels_per_radian(const Camera& camera) {
  constexpr double kApart_px = 10;
  const Eigen::Vector2d middle(0.5 * camera.size.width, 0.5 * camera.size.height);
  const auto first = unproject(camera.model, middle),
             second = unproject(camera.model, {middle.x() + kApart_px, middle.y()});
  if (!first || !second) return 0;
  const double sine = first->direction.normalized().cross(second->direction.normalized()).norm();
  return sine > 0 ? kApart_px / std::asin(std::min(sine, 1.0)) : 0;
}

bool is_close(double a, double b) {
  return std::abs(a - b) <= kSameSetting * b;
}

}  // namespace

Result<GroundMeter> GroundMeter::create(const Rig& rig, const StereoPair& pair, const std::string& mask_folder) {
  GroundMeter meter;
  meter.rig_ = rig;
  for (const auto& [side, name] : {std::pair{&meter.left_, pair.left}, std::pair{&meter.right_, pair.right}}) {
    const Camera& camera = *rig.find_camera(name);
    const auto mask = internal::load_self_mask(camera, mask_folder);
    if (!mask) return failure(mask);
    side->camera = name;
    for (int y = kProbeStep_px / 2; y < camera.size.height; y += kProbeStep_px) {
      for (int x = kProbeStep_px / 2; x < camera.size.width; x += kProbeStep_px) {
        if (!mask->empty() && (*mask)(x, y) == 0) continue;
        const auto ray = unproject(camera.model, {x, y});
        if (ray) side->probes.push_back({x, y, ray->direction.normalized().cast<float>()});
      }
    }
  }
  return meter;
}

GroundBrightness GroundMeter::measure(const StereoFrame& frame, const Eigen::Vector3d& up_in_body) const {
  Counts ground, all;
  std::size_t probes = 0;
  const auto lowest = static_cast<float>(-std::sin(kHorizon_rad));
  for (const auto& [side, image] : {std::pair{&left_, &frame.left}, std::pair{&right_, &frame.right}}) {
    if (image->empty()) continue;
    const Eigen::Matrix3d camera_from_body =
        rig_.body_from_camera(side->camera, frame.pan_rad, frame.tilt_rad).rotation().conjugate().toRotationMatrix();
    const Eigen::Vector3f up = (camera_from_body * up_in_body).cast<float>();
    const int black = rig_.find_camera(side->camera)->black_level();
    const int full_scale = image->format().full_scale() - black;
    for (const Probe& probe : side->probes) {
      if (probe.x >= image->width() || probe.y >= image->height()) continue;
      const int value = std::clamp(sample_at(*image, probe.x, probe.y) - black, 0, full_scale);
      all.add(value, full_scale);
      if (probe.direction.dot(up) < lowest) ground.add(value, full_scale);
      ++probes;
    }
  }
  GroundBrightness brightness;
  if (probes == 0) return brightness;
  brightness.ground = static_cast<double>(ground.total) / static_cast<double>(probes);
  const Counts& measured = brightness.ground < kLeastGround ? all : ground;
  brightness.median = measured.quantile(0.5);
  brightness.high = measured.quantile(kHighQuantile);
  brightness.saturated = static_cast<double>(measured.saturated) / measured.total;
  return brightness;
}

double ExposureControl::brightness_factor(const GroundBrightness& ground) const {
  const double level = 0.01 * options_.level_percent, ceiling = 0.01 * options_.highlight_percent;
  double median = ground.median;
  if (median >= kSaturated)
    median = ground.saturated >= kAllSaturated ? kBeyondMedian : 1 + std::max(0.0, ground.saturated - 0.5);
  const double high = std::max(median, ground.high >= kSaturated ? kBeyondHigh : ground.high);
  const double by_median = level / median, by_high = ceiling / high;
  return std::min(std::max(std::min(by_median, by_high), kLeastMedian * by_median), kLargestFactor);
}

// Exposure time up to the limit of motion blur, then gain, then a longer exposure.
ExposureSettings ExposureControl::split(double product_us, double motion_px_s, const ExposureBounds& cameras) const {
  const ExposureBounds bounds = limit({options_.shortest_us, options_.longest_us, 1, options_.largest_gain}, cameras);
  const double by_blur = motion_px_s > 0 ? 1e6 * options_.most_blur_px / motion_px_s : bounds.longest_us;
  const double sharp_us = std::clamp(by_blur, bounds.shortest_us, bounds.longest_us);
  double time_us = std::clamp(product_us, bounds.shortest_us, sharp_us);
  const double gain = std::clamp(product_us / time_us, bounds.smallest_gain, bounds.largest_gain);
  time_us = std::clamp(product_us / gain, bounds.shortest_us, bounds.longest_us);
  return {time_us, gain};
}

std::optional<ExposureSettings> ExposureControl::update(const GroundBrightness& ground, const ExposureSettings& taken,
                                                        double motion_px_s, const ExposureBounds& bounds) const {
  if (!(taken.exposure_us > 0)) return std::nullopt;
  const double gain = std::max(taken.gain, 1.0);
  double factor = brightness_factor(ground);
  const bool bright_enough = std::abs(std::log(factor)) <= std::log1p(0.01 * options_.tolerance_percent);
  if (bright_enough) factor = 1;
  const ExposureSettings wanted = split(taken.exposure_us * gain * factor, motion_px_s, bounds);
  // The division into time and gain follows the speed only where it matters.
  const double longer = taken.exposure_us / wanted.exposure_us;
  if (bright_enough && longer < 1.2 && longer > 0.5) return std::nullopt;
  // At the bounds nothing is left to change.
  const bool as_taken = is_close(wanted.exposure_us, taken.exposure_us) && is_close(wanted.gain, gain);
  return as_taken ? std::nullopt : std::optional(wanted);
}

double ground_motion_px_s(const Rig& rig, const StereoPair& pair, const Vector6d& body_velocity) {
  const Camera& camera = *rig.find_camera(pair.left);
  const double nearest_m = pair.nearest_m > 0 ? pair.nearest_m : kNearest_m;
  return pixels_per_radian(camera) * (body_velocity.head<3>().norm() / nearest_m + body_velocity.tail<3>().norm());
}

}  // namespace spartan
