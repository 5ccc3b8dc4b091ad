#include "spartan/reconstruction/local_map.h"

namespace spartan {

Image<float> class_band(ImageView<const GroundClass> classes) {
  Image<float> band(classes.width(), classes.height());
  for (int y = 0; y < classes.height(); ++y) {
    for (int x = 0; x < classes.width(); ++x) band(x, y) = static_cast<float>(classes(x, y));
  }
  return band;
}

}  // namespace spartan
