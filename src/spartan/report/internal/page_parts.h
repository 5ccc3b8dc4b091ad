// What the sections of the report page share.
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/figures/plot.h"

namespace spartan::internal {

constexpr int kPageImage_px = 440;  ///< largest width of an image that is embedded

/// At most `most` indices of a list, evenly spread, its first and last one included.
inline std::vector<std::size_t> spread_indices(std::size_t size, std::size_t most) {
  const std::size_t count = size < most ? size : most;
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < count; ++i) indices.push_back(count > 1 ? i * (size - 1) / (count - 1) : 0);
  return indices;
}

/// Names the axes of a plot of the world from above; x is east if a compass measured it, else the start heading.
inline void name_world_axes(Plot& plot, bool heading_east) {
  plot.x_label = heading_east ? "x (east), m" : "x (start heading), m";
  plot.y_label = heading_east ? "y (north), m" : "y, m";
}

/// The rover from above, an arrow in its heading.
inline PlotMarker rover_marker(const std::string& name, const Pose& world_from_body) {
  const Eigen::Vector3d& at = world_from_body.translation();
  const Eigen::Vector3d ahead = world_from_body.rotation() * Eigen::Vector3d::UnitX();
  return {name, {20, 20, 20}, at.x(), at.y(), std::atan2(ahead.y(), ahead.x())};
}

}  // namespace spartan::internal
