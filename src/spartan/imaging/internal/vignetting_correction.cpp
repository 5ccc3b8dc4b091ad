#include "spartan/imaging/internal/vignetting_correction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace spartan::internal {
namespace {

constexpr int kVignettingRowsPerPart = 32;  // rows per task; does not affect results

}  // namespace

Result<VignettingCorrection> VignettingCorrection::create(const Camera& camera, const ThreadPool& workers) {
  const Eigen::Vector2d middle((camera.size.width - 1) / 2.0, (camera.size.height - 1) / 2.0);
  const Eigen::Vector2d centre =
      camera.vignetting.centre_px.value_or(project(camera.model, Eigen::Vector3d::UnitZ()).value_or(middle));
  const double half_diagonal = std::hypot(camera.size.width, camera.size.height) / 2;
  const auto light = [&](int x, int y) {
    return camera.vignetting.relative_illumination((Eigen::Vector2d(x, y) - centre).squaredNorm() /
                                                   (half_diagonal * half_diagonal));
  };
  Image<std::uint16_t> factors(camera.size);
  workers.parallel_for(0, camera.size.height, kVignettingRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < camera.size.width; ++x) {
        const double factor = (1 << kFractionBits) / light(x, y);
        // 0 marks a relative illumination out of range.
        const bool fits = light(x, y) > Vignetting::kMinIllumination && factor >= 1;
        factors(x, y) = fits ? static_cast<std::uint16_t>(std::lround(factor)) : std::uint16_t{0};
      }
    }
  });
  for (int y = 0; y < camera.size.height; ++y) {
    for (int x = 0; x < camera.size.width; ++x) {
      if (factors(x, y) != 0) continue;
      return failure(
          ErrorCode::configuration,
          fmt::format("the vignetting of camera '{}' gives a relative illumination of {:.3g} at pixel {}, {}; it "
                      "must be between {} and {}",
                      camera.name, light(x, y), x, y, Vignetting::kMinIllumination, 1 << kFractionBits),
          "cameras." + camera.name + ".vignetting");
    }
  }
  return VignettingCorrection(std::move(factors), camera.pixel_format.full_scale(), camera.black_level());
}

template <class T>
void VignettingCorrection::apply_any(ImageView<const T> image, ImageView<T> result, const ThreadPool& workers) const {
  if (image.size() != factors_.size() || result.size() != factors_.size()) {
    throw std::invalid_argument("VignettingCorrection: the images have another size than the camera");
  }
  const auto full_scale = static_cast<std::uint32_t>(full_scale_), black = static_cast<std::uint32_t>(black_level_);
  workers.parallel_for(0, image.height(), kVignettingRowsPerPart, [&](int begin, int end) {
    constexpr std::uint32_t kUnity = 1U << kFractionBits, kHalf = kUnity / 2;
    for (int y = begin; y < end; ++y) {
      const T* const in = image.row(y);
      const std::uint16_t* const factors = factors_.row(y);
      T* const out = result.row(y);
      for (int x = 0; x < image.width(); ++x) {
        // black + (value − black) · factor
        const std::uint32_t bright = in[x] * std::uint32_t{factors[x]} + kHalf;
        const std::uint32_t excess = black * (std::uint32_t{factors[x]} - kUnity);
        const std::uint32_t level = bright > excess ? (bright - excess) >> kFractionBits : 0;
        out[x] = static_cast<T>(std::min(level, full_scale));
      }
    }
  });
}

void VignettingCorrection::apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result,
                                 const ThreadPool& workers) const {
  apply_any(image, result, workers);
}
void VignettingCorrection::apply(ImageView<const std::uint16_t> image, ImageView<std::uint16_t> result,
                                 const ThreadPool& workers) const {
  apply_any(image, result, workers);
}

}  // namespace spartan::internal
