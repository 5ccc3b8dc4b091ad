// Selection of features that cover the image evenly.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "spartan/odometry/internal/detection/landmark_detector.h"

namespace spartan::internal {

/// False at pixels where the mask is 0, and outside of it. An empty mask allows all.
bool is_allowed(const Feature& feature, ImageView<const std::uint8_t> mask);
/// Discards features that are not allowed.
void discard_masked(std::vector<Feature>& features, ImageView<const std::uint8_t> mask);

/// Selects at most `count` features. The image is divided into about count/4 square cells; the strongest feature of
/// every cell is taken first, then the second strongest of every cell, and so on. No two selected features are nearer
/// than `spacing_px`, nor to a position that is `taken`; these count as the strongest of their cells. Result in order
/// of decreasing strength; ties are broken by y, then x.
std::vector<Feature> spread_features(std::span<const Feature> features, ImageSize size, int count, double spacing_px,
                                     std::span<const Eigen::Vector2f> taken = {});
/// The indices of the same features.
std::vector<std::uint32_t> spread_indices(std::span<const Feature> features, ImageSize size, int count,
                                          double spacing_px, std::span<const Eigen::Vector2f> taken = {});

/// Keeps a minimum distance between points of an image.
class Occupancy {
 public:
  Occupancy(ImageSize size, double spacing_px);
  /// True where no point that was taken is nearer than the spacing.
  bool is_free(double x, double y) const;
  void take(double x, double y);

 private:
  struct Point {
    float x, y;
    std::int32_t next;  // in the same cell; −1: none
  };
  int cell_of(double v) const { return static_cast<int>(v / cell_px_) + 1; }
  double spacing_px_, cell_px_;
  int columns_, rows_;
  std::vector<std::int32_t> first_;  // of each cell; −1: none
  std::vector<Point> points_;
};

}  // namespace spartan::internal
