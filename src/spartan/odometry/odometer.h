// Visual odometry: the motion of the rover from one stereo frame to the next.
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
  tracking,    ///< the motion is measured
  degraded,    ///< measured from few inliers or against many outliers; its covariance says how well
  lost,        ///< not measured: the motion returned is the prediction
  stationary,  ///< the rover is stationary: the motion returned is the identity
};
std::string_view name_of(TrackingStatus status);

/// Wall-clock milliseconds of each sub-module in one call; for reports only, no result depends on it.
struct OdometryTimes {
  double detect = 0, reconstruct = 0, match = 0, estimate = 0, total = 0;
};

/// The motion between two stereo frames, in rectified left optical frames.
struct MotionEstimate {
  Stamp from, to;
  bool first = false;  ///< there was no previous frame: the motion is the identity
  Pose previous_from_current;
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation, (translation, rotation), m² rad²
  TrackingStatus status = TrackingStatus::tracking;
  std::string reason;  ///< why the status is not `tracking`; empty otherwise
  int landmarks = 0, matches = 0, inliers = 0;
  double rms_px = 0;  ///< root mean square of the inliers' reprojection residuals per coordinate, pixels
  OdometryTimes times;
};

struct OdometryOptions;  // odometry_options.h

/// Stereo visual odometry of the SPARTAN paper (Kostavelis et al., ICCV Workshops 2011): landmark detection → landmark
/// 3D reconstruction → landmark matching → motion estimation. It keeps the landmarks of t−1 (the published "1/z"
/// block). Derivation: docs/math/odometry.md.
class Odometer {
 public:
  Odometer(const OdometryOptions& options, ThreadPool workers);
  Odometer(Odometer&&) noexcept;
  Odometer& operator=(Odometer&&) noexcept;
  ~Odometer();

  /// Processes the next stereo frame. `predicted` (previous_from_current, left optical frames) replaces the
  /// constant-velocity prediction. `disparity` is the dense disparity of the left image (pixels, NaN unknown), used
  /// where the option reconstruction.source is `dense` and it is not empty. Never fails: a pair that cannot be used
  /// gives the status `lost` with a reason.
  MotionEstimate add(const RectifiedPair& pair, const std::optional<Pose>& predicted = {},
                     ImageView<const float> disparity = {});

  /// The state as a versioned value; after restore() the following estimates are the same, bit for bit. restore() fails
  /// with code `input` where the bytes are damaged or of another version, and then changes nothing.
  Bytes save() const;
  Status restore(const Bytes& state);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spartan
