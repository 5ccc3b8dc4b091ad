// Dead reckoning by vision only, or by vision and map constraints, beside the localization with all sensors.
#pragma once

#include "spartan/localization/localizer.h"

namespace spartan {

/// A Localizer without any other sensor, in the world of one with all sensors. Without constraints its pose is the
/// product of the visual motions; its covariance accumulates theirs and the drift (docs/math/localization.md,
/// "Vision").
class VisionOnlyFilter {
 public:
  explicit VisionOnlyFilter(const LocalizationOptions& options) : localizer_(options) {}

  void start(Stamp stamp, const Pose& world_from_body);
  /// As Localizer::add.
  bool add(const RelativeMotion& motion) { return localizer_.add(motion); }
  bool add(PoseConstraint constraint);
  bool reaches(Stamp stamp) const { return localizer_.reaches(stamp); }

  UncertainPose world_from_body() const;

  Bytes save() const;
  Status restore(const Bytes& bytes);

 private:
  Localizer localizer_;
  Pose world_from_own_;  // between the worlds: the own one always starts level and ahead
};

}  // namespace spartan
