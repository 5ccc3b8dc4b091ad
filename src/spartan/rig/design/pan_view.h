// What a pair sees of the ground around the rover from the pans of one stop (docs/math/rig_design.md, "Ground").
#pragma once

#include <optional>

#include "spartan/rig/design/azimuth_set.h"
#include "spartan/rig/design/ground_view.h"
#include "spartan/rig/design/requirements.h"

namespace spartan {

/// What neighbouring pans share that are a step apart, each spanning the view.
struct PanOverlap {
  double view_rad = 0, step_rad = 0;
  double percent() const;  ///< of the view; negative: a gap
  double gap_deg() const;  ///< between them; negative: an overlap
};

/// On the ground, from the axis of pan.
struct DistanceSpan {
  double from_m = 0, to_m = 0;
};

/// What the pans see together. Azimuths are of the azimuth that is asked for, straight ahead in its middle.
struct PanFigures {
  std::optional<PanOverlap> overlap;             ///< nominal: of the view's angle; none for a single pan
  std::optional<PanOverlap> far_overlap;         ///< at the top row, one eye; none for a single pan
  std::optional<PanOverlap> far_overlap_stereo;  ///< what both eyes see; none too where they share nothing
  AzimuthSet azimuth_far;                        ///< in which directions the top row's ground is seen, one eye
  AzimuthSet azimuth_far_stereo;                 ///< and by both
  /// Where both eyes see all of the asked azimuth; the longest such span, none where there is no such distance.
  std::optional<DistanceSpan> azimuth_held;
};

PanFigures pan_figures(const GroundView& view, const PanRequirements& pans);

/// The azimuth that is asked for.
AzimuthSet asked_azimuth(const PanRequirements& pans);
/// In which directions of it ground is seen at a distance from the axis of pan. `at_pan_0` is a footprint, of one eye
/// or of both.
AzimuthSet seen_azimuth(const GroundPolygon& at_pan_0, const PanRequirements& pans, double distance_m);

}  // namespace spartan
