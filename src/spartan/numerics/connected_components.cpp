#include "spartan/numerics/connected_components.h"

#include <algorithm>

namespace spartan {

std::vector<std::vector<PixelIndex>> connected_components(ImageView<const std::uint8_t> mask) {
  const auto [width, height] = mask.size();
  Image<std::uint8_t> visited(width, height);
  std::vector<std::vector<PixelIndex>> components;
  std::vector<PixelIndex> stack;
  for (int first_y = 0; first_y < height; ++first_y) {
    for (int first_x = 0; first_x < width; ++first_x) {
      if (mask(first_x, first_y) == 0 || visited(first_x, first_y) != 0) continue;
      std::vector<PixelIndex>& component = components.emplace_back();
      stack.assign(1, {first_x, first_y});
      visited(first_x, first_y) = 1;
      while (!stack.empty()) {
        const PixelIndex at = stack.back();
        stack.pop_back();
        component.push_back(at);
        for (int y = std::max(at.y - 1, 0); y <= std::min(at.y + 1, height - 1); ++y) {
          for (int x = std::max(at.x - 1, 0); x <= std::min(at.x + 1, width - 1); ++x) {
            if (mask(x, y) == 0 || visited(x, y) != 0) continue;
            visited(x, y) = 1;
            stack.push_back({x, y});
          }
        }
      }
    }
  }
  return components;
}

}  // namespace spartan
