// OpenCV's semi-global matchers for benchmarks.
#pragma once

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/image_io/opencv_bridge.h"

namespace spartan {

struct OpenCvMatcher {
  std::string name;
  int mode = cv::StereoSGBM::MODE_SGBM;
  int uniqueness = 10;  ///< Margin in percent by which the best match must win; 0: every match is kept.
};

/// Disparities 0 … disparities − 1 of one thread, with the penalties that OpenCV's documentation recommends. OpenCV
/// does not match columns whose search range leaves the image, so the images get a border of that width on the left;
/// `padded` false leaves it out.
inline Image<float> opencv_disparity(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                     int disparities, const OpenCvMatcher& method, bool padded = true) {
  constexpr int kBlock = 5;
  const int border = padded ? disparities : 0;
  cv::Mat l = as_mat(left), r = as_mat(right), fixed;
  if (padded) {
    cv::copyMakeBorder(as_mat(left), l, 0, 0, border, 0, cv::BORDER_REPLICATE);
    cv::copyMakeBorder(as_mat(right), r, 0, 0, border, 0, cv::BORDER_REPLICATE);
  }
  cv::setNumThreads(1);
  cv::StereoSGBM::create(0, disparities, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock, 1, 63, method.uniqueness,
                         100, 2, method.mode)
      ->compute(l, r, fixed);
  Image<float> disparity(left.width(), left.height());
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const short value = fixed.at<short>(y, x + border);
      disparity(x, y) = value < 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(value) / 16;
    }
  }
  return disparity;
}

}  // namespace spartan
