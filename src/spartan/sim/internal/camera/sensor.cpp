#include "spartan/sim/internal/camera/sensor.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "spartan/numerics/random.h"
#include "spartan/sim/internal/camera/compression.h"

namespace spartan::sim::internal {
namespace {

constexpr double kPlanckTimesLight_Jm = 6.62607015e-34 * 299792458.0;
constexpr double kWavelength_m = 555e-9;
constexpr double kLumensPerWatt = 683.0;  // at 555 nm

constexpr std::uint64_t kPatternStream = 1U << 20U, kRowStream = 1U << 21U;  // of random numbers; added to the row

// Responses of the red, green and blue filters to soil, rock, sky and rover, relative to luminance: dust is
// butterscotch, basalt nearly gray, the dusty sky between them, the rover gray. Empirical.
struct Tint {
  std::array<float, 3> rgb;
};
constexpr std::array<Tint, kMaterials> kTints{
    {{{1.45F, 0.93F, 0.60F}}, {{1.18F, 0.98F, 0.83F}}, {{1.20F, 0.97F, 0.80F}}, {{1, 1, 1}}}};

// Index into rgb of a pixel in a Bayer mosaic.
int channel_of(PixelLayout layout, int x, int y) {
  const int at = 2 * (y & 1) + (x & 1);
  constexpr std::array<std::array<int, 4>, 4> kChannels{{{0, 1, 1, 2}, {1, 0, 2, 1}, {1, 2, 0, 1}, {2, 1, 1, 0}}};
  switch (layout) {
    case PixelLayout::bayer_rggb:
      return kChannels[0][static_cast<std::size_t>(at)];
    case PixelLayout::bayer_grbg:
      return kChannels[1][static_cast<std::size_t>(at)];
    case PixelLayout::bayer_gbrg:
      return kChannels[2][static_cast<std::size_t>(at)];
    default:
      return kChannels[3][static_cast<std::size_t>(at)];
  }
}

// Specks of dust on the front lens, far out of focus: soft dark discs.
class Dust {
 public:
  Dust(std::uint64_t seed, ImageSize size) {
    Random random(seed, 404);
    for (Speck& speck : specks_) {
      speck.x = random.uniform(0, size.width);
      speck.y = random.uniform(0, size.height);
      speck.radius = size.width * random.uniform(0.012, 0.05);
      speck.depth = random.uniform(0.15, 0.5);
    }
  }
  float transmission(int x, int y) const {
    double through = 1;
    for (const Speck& speck : specks_) {
      const double away = std::hypot(x - speck.x, y - speck.y) / speck.radius;
      if (away < 1) through *= 1 - speck.depth * (1 - away * away) * (1 - away * away);
    }
    return static_cast<float>(through);
  }

 private:
  struct Speck {
    double x = 0, y = 0, radius = 0, depth = 0;
  };
  std::array<Speck, 14> specks_;
};

// Relative illumination of the lens at the cosine of a field angle.
double illumination(double cosine, double vignetting) {
  return std::pow(std::max(0.0, cosine), 4 * vignetting);
}

}  // namespace

Vignetting fitted_vignetting(const Camera& camera, double vignetting) {
  constexpr int kSide = 24;  // places along each edge of the image
  const Eigen::Vector2d centre = project(camera.model, Eigen::Vector3d::UnitZ()).value();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double half_diagonal_squared = 0.25 * Eigen::Vector2d(camera.size.width, camera.size.height).squaredNorm();
  for (int j = 0; j <= kSide; ++j) {
    for (int i = 0; i <= kSide; ++i) {
      const Eigen::Vector2d pixel(i * (camera.size.width - 1.0) / kSide, j * (camera.size.height - 1.0) / kSide);
      const auto ray = unproject(camera.model, pixel);
      if (!ray) continue;
      const double r = (pixel - centre).squaredNorm() / half_diagonal_squared;
      const Eigen::Vector3d powers(r, r * r, r * r * r);
      normal += powers * powers.transpose();
      right += powers * (illumination(ray->direction.z(), vignetting) - 1);
    }
  }
  const Eigen::Vector3d coefficients = normal.ldlt().solve(right);
  return {{coefficients[0], coefficients[1], coefficients[2]}, centre};
}

double electrons_per_second(const SensorOptions& s) {
  const double lux = std::numbers::pi * s.transmission / (4 * s.f_number * s.f_number);
  const double photon_energy_J = kPlanckTimesLight_Jm / kWavelength_m;
  const double area_m2 = s.pixel_um * s.pixel_um * 1e-12;
  return lux / kLumensPerWatt / photon_energy_J * area_m2 * s.quantum_efficiency;
}

Exposure choose_exposure(const SensorOptions& s, double mean_luminance) {
  const double rate = std::max(mean_luminance, 1e-9) * electrons_per_second(s);
  const double wanted = s.target_level * s.full_well_e;
  Exposure exposure;
  exposure.seconds = std::min(wanted / rate, s.longest_exposure_ms * 1e-3);
  exposure.gain = std::clamp(wanted / (rate * exposure.seconds), 1.0, s.largest_gain);
  return exposure;
}

Sensor::Sensor(const SensorOptions& options, const Camera& camera, const SensorIdentity& identity)
    : options_(options), camera_(camera), response_(camera.size.width, camera.size.height, 1.0F) {
  const bool has_dark_levels = options.dark_offset_e > 0 || options.hot_pixel_fraction > 0;
  if (has_dark_levels) dark_level_e_ = Image<float>(camera.size);
  for (int y = 0; y < camera.size.height; ++y) {
    Random random(identity.pattern_seed, kPatternStream + static_cast<std::uint64_t>(y));
    for (int x = 0; x < camera.size.width; ++x) {
      const auto ray = unproject(camera.model, Eigen::Vector2d(x, y));
      response_(x, y) = ray ? static_cast<float>(illumination(ray->direction.z(), options.vignetting)) : 0.0F;
      const double pattern = 1 + 0.01 * random.normal(0, options.pixel_response_percent);
      response_(x, y) *= static_cast<float>(identity.gain * std::max(0.0, pattern));
      if (!has_dark_levels) continue;
      const double offset = random.normal(0, options.dark_offset_e);
      const bool hot = random.uniform() < options.hot_pixel_fraction;
      const double leak = random.uniform(0.1, 1) * options.full_well_e;
      dark_level_e_(x, y) = static_cast<float>(offset + (hot ? leak : 0));
    }
  }
}

double Sensor::levels_per_electron(const Exposure& exposure) const {
  const double full = (1 << camera_.pixel_format.bits) - 1;
  return exposure.gain * full * (1 - options_.black_level) / options_.full_well_e;
}

Image<float> Sensor::electrons(const LuminanceImage& image, const Exposure& exposure, const ImageFault& fault) const {
  const auto per_luminance = static_cast<float>(electrons_per_second(options_) * exposure.seconds * fault.light_factor);
  const bool colour = camera_.pixel_format.is_bayer() && image.split;
  const Dust dust(fault.dust_seed, camera_.size);
  Image<float> result(camera_.size.width, camera_.size.height);
  for (int y = 0; y < result.height(); ++y) {
    for (int x = 0; x < result.width(); ++x) {
      float luminance = image.total(x, y);
      if (colour) {
        const auto c = static_cast<std::size_t>(channel_of(camera_.pixel_format.layout, x, y));
        luminance = 0;
        for (std::size_t m = 0; m < kMaterials; ++m) luminance += image.by_material[m](x, y) * kTints[m].rgb[c];
      }
      result(x, y) = luminance * per_luminance * response_(x, y);
      if (fault.dust) result(x, y) *= dust.transmission(x, y);
    }
  }
  return result;
}

FrameImage Sensor::expose(const LuminanceImage& luminance, const Exposure& exposure, const ImageFault& fault,
                          std::uint64_t seed, const ThreadPool& workers) const {
  const Image<float> signal = electrons(luminance, exposure, fault);
  const PixelFormat& format = camera_.pixel_format;
  const double full = (1 << format.bits) - 1, black = options_.black_level * full;
  const int shift = format.bits > 8 && format.alignment == BitAlignment::high ? 16 - format.bits : 0;
  const double levels = levels_per_electron(exposure), read_variance = options_.read_noise_e * options_.read_noise_e;
  const auto develop = [&]<class Pixel>(Image<Pixel> image) {
    workers.parallel_for(0, image.height(), 16, [&](int from, int to) {
      for (int y = from; y < to; ++y) {
        const auto row = static_cast<std::uint64_t>(y);
        Random random(seed, row);
        const double row_noise = Random(seed, kRowStream + row).normal(0, options_.row_noise_e);
        for (int x = 0; x < image.width(); ++x) {
          // Shot noise is Poisson-distributed, read noise Gaussian; their sum is Gaussian at the levels where noise
          // shows.
          const double mean = signal(x, y);
          const double fixed = row_noise + (dark_level_e_.empty() ? 0.0 : static_cast<double>(dark_level_e_(x, y)));
          const double noisy = mean + std::sqrt(mean + read_variance) * random.normal() + fixed;
          const double e = std::min(noisy, options_.full_well_e);
          const auto level = static_cast<int>(std::clamp(std::round(black + levels * e), 0.0, full));
          image(x, y) = static_cast<Pixel>(level << shift);
        }
      }
    });
    return FrameImage::own(std::move(image), format);
  };
  const auto [w, h] = camera_.size;
  if (format.bits > 8) return develop(Image<std::uint16_t>(w, h));
  FrameImage image = develop(Image<std::uint8_t>(w, h));
  if (format.layout != PixelLayout::gray) return image;
  if (options_.wavelet_bits > 0) return compressed_by_wavelets(image, options_.wavelet_bits);
  return options_.jpeg_quality > 0 ? compressed_by_jpeg(image, options_.jpeg_quality) : image;
}

Image<float> Sensor::noise_free(const LuminanceImage& luminance, const Exposure& exposure) const {
  Image<float> image = electrons(luminance, exposure, {});
  const auto levels = static_cast<float>(levels_per_electron(exposure));
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) image(x, y) *= levels;
  }
  return image;
}

}  // namespace spartan::sim::internal
