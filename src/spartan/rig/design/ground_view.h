// What of level ground a pair sees: footprints of one eye and of both, as polygons.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/rig/design/azimuth_set.h"

namespace spartan {

/// A pair over level ground: both eyes at one height, half a baseline left and right of the axis of pan, looking
/// ahead and down by `tilt`.
struct GroundView {
  double height_m = 0;
  double tilt_rad = 0;  ///< of the optical axes below level
  double hfov_rad = 0, vfov_rad = 0;
  double baseline_m = 0;
};

/// Corners on the ground, counter-clockwise from above, (x ahead, y to the left) of the foot of the axis of pan, m.
using GroundPolygon = std::vector<Eigen::Vector2d>;

/// Whether all of the picture's ground is at a finite distance: the top row looks below the horizon.
bool sees_ground_only(const GroundView& view);

/// Ahead of the camera's foot in the middle column, m: the bottom row, and the top row (infinite at the horizon).
double near_edge_m(const GroundView& view);
double far_edge_m(const GroundView& view);

/// The ground in the picture of one eye, `eye_left_m` to the left of the axis, with the head panned (positive to the
/// left): the corners of the picture projected on to the plane. Throws std::invalid_argument where it does not see
/// ground only.
GroundPolygon footprint(const GroundView& view, double eye_left_m, double pan_rad);
/// The ground that both eyes see; empty where they share nothing.
GroundPolygon common_footprint(const GroundView& view, double pan_rad);

/// The common part of two convex polygons; empty where there is none.
GroundPolygon intersection(const GroundPolygon& a, const GroundPolygon& b);
double area_m2(const GroundPolygon& polygon);

/// Half of the angle over which the far edge of a footprint at pan 0 is seen from the origin, rad; none where it is
/// empty.
std::optional<double> far_half_azimuth_rad(const GroundPolygon& polygon);
/// The directions in which a convex polygon has ground at a distance from the origin, of the circle around it.
AzimuthSet azimuths_at(const GroundPolygon& polygon, double distance_m);

}  // namespace spartan
