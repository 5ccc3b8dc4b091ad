// Footprints of a stereo pair on level ground, as polygons.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/rig_design/azimuth_set.h"

namespace spartan {

/// A pair over level ground: both cameras at the same height, half a baseline left and right of the pan axis, pointing
/// ahead and down by `tilt`.
struct GroundView {
  double height_m = 0;
  double tilt_rad = 0;  ///< of the optical axes below the horizontal
  double hfov_rad = 0, vfov_rad = 0;
  double baseline_m = 0;
};

/// Corners on the ground, counter-clockwise from above, (x ahead, y to the left) of the foot of the pan axis, m.
using GroundPolygon = std::vector<Eigen::Vector2d>;

/// Whether the top row, and with it the whole image, is below the horizon.
bool is_below_horizon(const GroundView& view);

/// Distance of the ground in the middle column, ahead of the foot of the camera, m: of the bottom row, and of the top
/// row (infinite at the horizon).
double near_edge_m(const GroundView& view);
double far_edge_m(const GroundView& view);

/// The ground in the image of one camera, `camera_left_m` to the left of the pan axis, at a pan angle (positive to the
/// left): the image corners projected onto the plane. Throws std::invalid_argument where is_below_horizon() is false.
GroundPolygon footprint(const GroundView& view, double camera_left_m, double pan_rad);
/// The ground that both cameras see; may be empty.
GroundPolygon common_footprint(const GroundView& view, double pan_rad);

/// The intersection of two convex polygons; may be empty.
GroundPolygon intersection(const GroundPolygon& a, const GroundPolygon& b);
double area_m2(const GroundPolygon& polygon);

/// Half of the azimuth that the far edge of a footprint at pan 0 spans from the origin, rad; none for an empty one.
std::optional<double> far_edge_half_azimuth_rad(const GroundPolygon& polygon);
/// The azimuths at which a circle around the origin lies inside a convex polygon.
AzimuthSet azimuths_at(const GroundPolygon& polygon, double distance_m);

}  // namespace spartan
