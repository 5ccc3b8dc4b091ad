#include "spartan/odometry/internal/detection/harris.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/odometry/internal/detection/feature_spread.h"
#include "spartan/odometry/internal/detection/surf.h"

namespace spartan::internal {
namespace {

/// k of the response (Harris and Stephens, §4: empirical).
constexpr double kHarrisTrace = 0.04;
/// Side of the Sobel filter.
constexpr int kSobel_px = 3;

/// Whether a response is the largest of its 3×3 neighbourhood; of equal ones the first.
bool is_corner(ImageView<const float> response, int x, int y) {
  const float centre = response(x, y);
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const float other = response(x + i, y + j);
      const bool before = j < 0 || (j == 0 && i < 0);
      if (before ? !(centre > other) : centre < other) return false;
    }
  }
  return true;
}

/// Maximum of the parabola through three values, in −1/2 … 1/2 from the middle one, which is the largest.
float parabola_peak(float before, float middle, float after) {
  const float curvature = before - 2 * middle + after;
  return curvature < 0 ? std::clamp(0.5f * (before - after) / curvature, -0.5f, 0.5f) : 0.0f;
}

}  // namespace

HarrisDetector::HarrisDetector(const DetectionOptions& options, ThreadPool workers)
    : options_(options), workers_(std::move(workers)) {}

void HarrisDetector::find_maxima(int margin) {
  found_.clear();
  float strongest = 0;
  for (int y = margin; y < response_.height() - margin; ++y) {
    const float* row = response_.row(y);
    for (int x = margin; x < response_.width() - margin; ++x) strongest = std::max(strongest, row[x]);
  }
  if (!(strongest > 0)) return;
  const float threshold = strongest * static_cast<float>(options_.harris.quality);
  const ImageView<const float> response = std::as_const(response_).view();
  for (int y = margin; y < response.height() - margin; ++y) {
    for (int x = margin; x < response.width() - margin; ++x) {
      if (!(response(x, y) > threshold) || !is_corner(response, x, y)) continue;
      Feature f;
      f.x = static_cast<float>(x) + parabola_peak(response(x - 1, y), response(x, y), response(x + 1, y));
      f.y = static_cast<float>(y) + parabola_peak(response(x, y - 1), response(x, y), response(x, y + 1));
      f.scale = static_cast<float>(options_.harris.scale_px);
      f.strength = response(x, y);
      found_.push_back(f);
    }
  }
}

const std::vector<Feature>& HarrisDetector::detect(ImageView<const std::uint8_t> image,
                                                   ImageView<const std::uint8_t> mask, const WantedFeatures& wanted) {
  features_.clear();
  if (image.empty()) return features_;
  integral_.compute(image);
  if (response_.size() != image.size()) response_ = Image<float>(image.size());
  cv::Mat response = as_mat(response_);
  cv::cornerHarris(as_mat(image), response, options_.harris.window_px, kSobel_px, kHarrisTrace, cv::BORDER_REFLECT_101);
  // Windows inside the image, and neighbours.
  find_maxima(options_.harris.window_px / 2 + 2);
  discard_masked(found_, mask);
  features_ = spread_features(found_, image.size(), wanted.count.value_or(options_.landmarks), options_.spacing_px,
                              wanted.taken);
  workers_.parallel_for(0, static_cast<int>(features_.size()), 64, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      Feature& f = features_[static_cast<std::size_t>(i)];
      if (!options_.harris.upright) f.angle = surf_orientation(integral_, f);
      f.descriptor = surf_descriptor(integral_, f);
    }
  });
  return features_;
}

}  // namespace spartan::internal
