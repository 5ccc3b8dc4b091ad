// Camera models with some of their numbers changed, whatever the model.
#pragma once

#include "spartan/rig/camera_model.h"

namespace spartan {

/// Focal lengths (and what is measured by them) times `factor`; the centre stays.
CameraModel with_focal_times(const CameraModel& model, double factor);

/// The model for pictures that are `factor` times as large; their corner stays.
CameraModel resized(const CameraModel& model, double factor);

/// A pinhole with the distortion that it lacks, r_u = r_d/(1 + k r_d²); other models stay as they are.
CameraModel with_radial(const CameraModel& model, double k);

}  // namespace spartan
