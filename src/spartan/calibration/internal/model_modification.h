// Camera models with modified parameters, for every type of model.
#pragma once

#include "spartan/core/image.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan::internal {

/// Multiplies focal lengths and skew by `factor`; the principal point is unchanged.
CameraModel with_scaled_focal_length(const CameraModel& model, double factor);

/// The model for images resampled to `factor` times the size; the outer corner of the top-left pixel is fixed.
CameraModel resized(const CameraModel& model, double factor);

/// Shifts the principal point by `rows_px` rows downwards.
CameraModel with_row_offset(const CameraModel& model, double rows_px);

/// Sets both focal lengths to fx (`by_x`) or to fy.
CameraModel with_square_pixels(const CameraModel& model, bool by_x);

/// Replaces the distortion of a pinhole or radial_tangential model by the one-parameter division model (Fitzgibbon
/// 2001) r_u = r_d/(1 + k r_d²), as k1, k2, k4 and k5 of the rational model: a least-squares fit over an image of that
/// size, with an error below 0.01 px. Other models are returned unchanged.
CameraModel with_division_distortion(const CameraModel& model, double k, ImageSize size);

}  // namespace spartan::internal
