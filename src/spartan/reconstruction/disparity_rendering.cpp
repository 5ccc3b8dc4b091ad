#include <algorithm>
#include <cmath>

#include "spartan/reconstruction/rendering.h"

namespace spartan {

Image<Rgb8> colour_disparity(ImageView<const float> disparity) {
  Image<Rgb8> image(disparity.size());
  const Range range = disparity_colour_range(disparity);
  const auto low = static_cast<float>(range.low), high = static_cast<float>(range.high);
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const float d = disparity(x, y);
      if (!std::isnan(d)) image(x, y) = disparity_colour((d - low) / (high - low));
    }
  }
  return image;
}

}  // namespace spartan
