#include "spartan/reconstruction/local_map.h"
#include "spartan/reconstruction/rendering.h"

namespace spartan {

Image<float> class_band(ImageView<const GroundClass> classes) {
  Image<float> band(classes.width(), classes.height());
  for (int y = 0; y < classes.height(); ++y) {
    for (int x = 0; x < classes.width(); ++x) band(x, y) = static_cast<float>(classes(x, y));
  }
  return band;
}

std::vector<MapCategory> class_categories() {
  constexpr Rgb8 kFreeColour{140, 170, 120};
  return {{"unknown", kUnknownColour}, {"free", kFreeColour}, {"obstacle", kObstacleColour}, {"cavity", kCavityColour}};
}

}  // namespace spartan
