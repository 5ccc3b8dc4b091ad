// Camera models with some of their numbers changed, whatever the model.
#pragma once

#include "spartan/core/image.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

/// Focal lengths (and what is measured by them) times `factor`; the centre stays.
CameraModel with_focal_times(const CameraModel& model, double factor);

/// The model for pictures that are `factor` times as large; their corner stays.
CameraModel resized(const CameraModel& model, double factor);

/// The model for pictures that show everything `rows_px` lower.
CameraModel with_rows_lower(const CameraModel& model, double rows_px);

/// fx and fy both what the one of them is.
CameraModel with_square_pixels(const CameraModel& model, bool by_x);

/// A pinhole with the distortion that it lacks: r_u = r_d/(1 + k r_d²) as far as pictures of that size reach, as k1,
/// k2, k4 and k5 of the rational model (least squares; off by less than 0.01 px). Other models stay as they are.
CameraModel with_radial(const CameraModel& model, double k, ImageSize size);

}  // namespace spartan
