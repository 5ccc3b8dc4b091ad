// Choosing features so that they cover the image.
#pragma once

#include <vector>

#include "spartan/odometry/landmark_detector.h"

namespace spartan {

/// Keeps at most `count` of the features: the image is cut into about count/4 square cells, each cell gives its
/// strongest in turn (first all cells' strongest, then all second ones …) until enough are there; none stands nearer
/// than `spacing_px` to one already kept. Result strongest first; ties are broken by y, then x.
std::vector<Feature> spread_features(std::vector<Feature> features, ImageSize size, int count, double spacing_px);

/// Marks places of an image as taken, to keep a distance between landmarks.
class Occupancy {
 public:
  Occupancy(ImageSize size, double spacing_px);
  bool is_free(double x, double y) const;
  void take(double x, double y);

 private:
  struct Place {
    float x, y;
  };
  int cell_of(double v) const { return static_cast<int>(v / cell_px_) + 1; }
  double spacing_px_, cell_px_;
  int columns_, rows_;
  std::vector<std::vector<Place>> cells_;
};

}  // namespace spartan
