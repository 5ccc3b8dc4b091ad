#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/reconstruction/rendering.h"

namespace spartan {

Image<Rgb8> colour_disparity(ImageView<const float> disparity) {
  std::vector<float> known;
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      if (!std::isnan(disparity(x, y))) known.push_back(disparity(x, y));
    }
  }
  Image<Rgb8> image(disparity.size());
  if (known.empty()) return image;
  const auto percentile = [&](double fraction) {
    const auto at = known.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(known.size() - 1));
    std::nth_element(known.begin(), at, known.end());
    return *at;
  };
  const float low = percentile(0.01), high = std::max(percentile(0.99), low + 1e-3F);

  cv::Mat levels(256, 1, CV_8UC1), colours;
  for (int i = 0; i < 256; ++i) levels.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i);
  cv::applyColorMap(levels, colours, cv::COLORMAP_TURBO);
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const float d = disparity(x, y);
      if (std::isnan(d)) continue;
      const int level = static_cast<int>(std::clamp((d - low) / (high - low), 0.0F, 1.0F) * 255.0F);
      const auto bgr = colours.at<cv::Vec3b>(level);
      image(x, y) = {bgr[2], bgr[1], bgr[0]};
    }
  }
  return image;
}

}  // namespace spartan
