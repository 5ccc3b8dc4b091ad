// Where the world frame lies (docs/conventions.md, "Frames").
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string_view>

#include "spartan/camera/samples.h"
#include "spartan/core/pose.h"

namespace spartan {

/// The direction "up" in the body frame (unit length), from the mean specific force of samples taken at rest.
/// Nothing where there are fewer than 10 samples, or where their mean differs from `gravity_m_s2` by more than 5 %,
/// or where they scatter by more than 10 % of it: then the rover was not at rest, or the sensor is in other units.
std::optional<Eigen::Vector3d> measure_up(std::span<const ImuSample> samples, double gravity_m_s2);

/// world_from_body of the first frame: origin at the body, z up (`up_in_body`, or the body's own z where that is not
/// known), x along the horizontal part of the left optical axis. Where that axis is vertical, body x takes its place.
Pose first_world_from_body(const Pose& body_from_left, const std::optional<Eigen::Vector3d>& up_in_body);

}  // namespace spartan
