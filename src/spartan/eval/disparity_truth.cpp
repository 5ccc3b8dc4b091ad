#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "spartan/core/files.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/image_io/image_io.h"

namespace spartan {
namespace {

template <class Sample>
Image<float> divided(ImageView<const Sample> image, double divisor) {
  Image<float> disparity(image.size());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      disparity(x, y) = image(x, y) == 0 ? std::numeric_limits<float>::quiet_NaN()
                                         : static_cast<float>(static_cast<double>(image(x, y)) / divisor);
    }
  }
  return disparity;
}

// A gray image that is stored as RGB.
Result<Image<std::uint8_t>> gray_from_rgb(ImageView<const Rgb8> image, const std::string& path) {
  Image<std::uint8_t> gray(image.size());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const Rgb8 pixel = image(x, y);
      if (pixel.r != pixel.g || pixel.g != pixel.b) {
        return failure(ErrorCode::input, "is a colour image; a disparity image is gray, or RGB with equal channels",
                       path);
      }
      gray(x, y) = pixel.r;
    }
  }
  return gray;
}

}  // namespace

Result<Image<float>> read_disparity(const std::string& path, double scale_of_8_bit) {
  if (!(scale_of_8_bit > 0) || !std::isfinite(scale_of_8_bit)) {
    return failure(ErrorCode::usage, fmt::format("the truth scale is {}, but must be positive", scale_of_8_bit));
  }
  const auto content = read_file(path);
  if (!content) return failure(content);
  if (content->starts_with("Pf")) return parse_pfm(*content, path);
  const auto image = decode_image(*content, path);
  if (!image) return failure(image);
  const bool rgb = image->format().layout == PixelLayout::rgb;
  if (image->format().bits == 16 && !rgb) return divided(image->as<std::uint16_t>(), 256.0);
  if (image->format().bits == 8 && !rgb) return divided(image->as<std::uint8_t>(), scale_of_8_bit);
  if (image->format().bits == 8) {
    const auto gray = gray_from_rgb(image->as<Rgb8>(), path);
    if (!gray) return failure(gray);
    return divided(gray->view(), scale_of_8_bit);
  }
  return failure(ErrorCode::input, "is a 16-bit colour image; a disparity image is PFM, 16-bit gray PNG or 8-bit PNG",
                 path);
}

Result<Image<std::uint8_t>> read_truth_mask(const std::string& path) {
  auto mask = read_gray8(path);
  if (!mask) return failure(mask);
  for (int y = 0; y < mask->height(); ++y) {
    for (int x = 0; x < mask->width(); ++x) {
      const std::uint8_t value = (*mask)(x, y);
      if (value != kMaskSeenByBoth && value != kMaskOccluded && value != kMaskNoTruth) {
        return failure(ErrorCode::input,
                       fmt::format("holds {} at ({}, {}); a truth mask holds only 255, 128 and 0", value, x, y), path);
      }
    }
  }
  return mask;
}

}  // namespace spartan
