#include "spartan/sim/internal/camera/compression.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <vector>

#include "spartan/image_io/image_io.h"
#include "spartan/image_io/opencv_bridge.h"

namespace spartan::sim::internal {

FrameImage compressed_by_jpeg(const FrameImage& image, int quality) {
  const auto file = encode_jpeg(image.as<std::uint8_t>(), quality);
  return decode_image(file.value(), "JPEG").value().with_format(image.format());
}

FrameImage compressed_by_wavelets(const FrameImage& image, double bits_per_pixel) {
  // OpenCV's rate: the size of the file over that of the raw image of 8 bits per pixel, in thousandths.
  const int rate = std::clamp(static_cast<int>(std::lround(1000 * bits_per_pixel / 8)), 1, 1000);
  std::vector<std::uint8_t> file;
  if (!cv::imencode(".jp2", as_mat(image.as<std::uint8_t>()), file, {cv::IMWRITE_JPEG2000_COMPRESSION_X1000, rate}))
    throw std::runtime_error("OpenCV cannot write JPEG 2000; it must be built with OpenJPEG");
  const cv::Mat decoded = cv::imdecode(file, cv::IMREAD_GRAYSCALE);
  return FrameImage::own(Image<std::uint8_t>::copy_of(as_view<std::uint8_t>(decoded)), image.format());
}

}  // namespace spartan::sim::internal
