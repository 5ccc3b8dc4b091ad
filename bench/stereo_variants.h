// Dark, noisy and backlit variants of stereo pairs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "spartan/numerics/random.h"
#include "stereo_pairs.h"

namespace spartan {

enum class Light { dark, noisy, backlit };
inline constexpr std::array<Light, 3> kLights{Light::dark, Light::noisy, Light::backlit};
inline std::string name_of(Light light) {
  return light == Light::dark ? "dark" : light == Light::noisy ? "noisy" : "backlit";
}

/// Gray levels of an image under another light, with the noise of photons and of reading (10 electrons):
/// dark: an eighth of the levels, 10 000 electrons at level 255; noisy: the same levels, 500 electrons at level 255;
/// backlit: levels above 200 stay (sky), the others get a gamma of 1.5 and an eighth of the gain.
inline Image<std::uint8_t> under(Light light, const Image<std::uint8_t>& image, std::uint64_t seed) {
  Random random(seed);
  const double electrons_per_level = (light == Light::noisy ? 500 : 10'000) / 255.0;
  Image<std::uint8_t> result(image.size());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      double level = image(x, y);
      if (light == Light::dark) level /= 8;
      if (light == Light::backlit && level <= 200) level = 255.0 / 8 * std::pow(level / 255, 1.5);
      const double electrons = level * electrons_per_level;
      const double noisy = electrons + random.normal(0, std::sqrt(electrons + 100));
      result(x, y) = static_cast<std::uint8_t>(std::lround(std::clamp(noisy / electrons_per_level, 0.0, 255.0)));
    }
  }
  return result;
}

inline Pair under(Light light, const Pair& pair) {
  Pair result;
  result.name = pair.name + "/" + name_of(light);
  result.folder = pair.folder;
  result.left = under(light, pair.left, 1);
  result.right = under(light, pair.right, 2);
  result.truth = pair.truth.clone();
  result.mask = pair.mask.clone();
  result.disparities = pair.disparities;
  return result;
}

}  // namespace spartan
