// Visual odometry: the motion of the rover from one stereo shot to the next.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "spartan/core/archive.h"
#include "spartan/core/options.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/core/time.h"
#include "spartan/imaging/rectified_pair.h"

namespace spartan {

enum class TrackingStatus : std::uint8_t {
  tracking,  ///< the motion is measured well
  degraded,  ///< measured from little; its covariance says so
  lost,      ///< not measured: the pose given is the prediction
  standing,  ///< the rover has not moved
};
std::string_view name_of(TrackingStatus status);

/// Milliseconds of each sub-step of one call (wall clock; for reports only, nothing depends on it).
struct OdometryTimes {
  double detect = 0, reconstruct = 0, match = 0, estimate = 0, total = 0;
};

/// The motion between two shots, in rectified left optical frames.
struct MotionEstimate {
  Stamp from, to;
  bool first = false;  ///< there was no shot before: the motion is the identity
  Pose previous_from_current;
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation, (translation, rotation), m² rad²
  TrackingStatus status = TrackingStatus::tracking;
  std::string reason;  ///< why it is not `tracking`; empty otherwise
  int landmarks = 0, matches = 0, inliers = 0;
  double rms_px = 0;  ///< of the inliers' reprojection residuals
  OdometryTimes times;
};

struct OdometryOptions;  // odometry_options.h

/// Landmark detection → landmark 3D reconstruction → landmark matching → motion estimation, holding the landmarks of
/// t−1 (the published "1/z" block).
class Odometer {
 public:
  Odometer(const OdometryOptions& options, Workers workers);
  Odometer(Odometer&&) noexcept;
  Odometer& operator=(Odometer&&) noexcept;
  ~Odometer();

  /// Takes the next shot. `predicted` (previous_from_current) comes from outside where something better than constant
  /// velocity is known. `disparity` of the left image is used where the options ask for it and it is not empty.
  MotionEstimate add(const RectifiedPair& pair, const std::optional<Pose>& predicted = {},
                     ImageView<const float> disparity = {});

  /// The memory of the stage as a versioned value; restore() of it makes the following estimates the same, bit for bit.
  Bytes save() const;
  Status restore(const Bytes& state);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spartan
