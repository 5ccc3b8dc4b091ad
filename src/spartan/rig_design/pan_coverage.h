// Ground coverage of a panned pair at one stop (docs/math/rig_design.md, "Ground").
#pragma once

#include <optional>

#include "spartan/rig_design/azimuth_set.h"
#include "spartan/rig_design/ground_view.h"
#include "spartan/rig_design/requirements.h"

namespace spartan {

/// Overlap of two neighbouring views that are one pan step apart.
struct PanOverlap {
  double view_rad = 0, step_rad = 0;
  double percent() const;  ///< share of the field of view; negative: a gap
  double gap_deg() const;  ///< between the views; negative: an overlap
};

/// A range of distances on the ground from the pan axis.
struct DistanceSpan {
  double from_m = 0, to_m = 0;
};

/// Coverage of all pans together. Azimuths are clipped to the required azimuth, which is centred straight ahead.
struct PanCoverage {
  std::optional<PanOverlap> overlap;             ///< nominal, from the field of view; none for a single pan
  std::optional<PanOverlap> far_overlap;         ///< at the top row, one camera; none for a single pan
  std::optional<PanOverlap> far_overlap_stereo;  ///< the same for both cameras; also none without common ground
  AzimuthSet azimuth_far;                        ///< azimuths at which the far edge (top row) is seen, one camera
  AzimuthSet azimuth_far_stereo;                 ///< the same for both cameras
  /// Distances at which both cameras cover the whole required azimuth: the longest such range; none if there is none.
  std::optional<DistanceSpan> full_coverage;
};

PanCoverage pan_coverage(const GroundView& view, const PanRequirements& pans);

/// The azimuth that the requirements demand.
AzimuthSet required_azimuth(const PanRequirements& pans);
/// The part of the required azimuth that the pans cover at a distance from the pan axis. `at_pan_0` is a footprint at
/// pan 0, of one camera or of both.
AzimuthSet covered_azimuth(const GroundPolygon& at_pan_0, const PanRequirements& pans, double distance_m);

}  // namespace spartan
