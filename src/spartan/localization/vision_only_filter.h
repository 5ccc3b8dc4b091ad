// The drive as vision alone measures it, or vision and map, beside the localization that hears everything.
#pragma once

#include "spartan/localization/localizer.h"

namespace spartan {

/// A Localizer that hears no other sensor, in the world of one that does. Without constraints its pose is the product
/// of the motions; its covariance grows as theirs, with the errors that last (docs/math/localization.md, "Vision").
class VisionOnlyFilter {
 public:
  explicit VisionOnlyFilter(const LocalizationOptions& options) : localizer_(options) {}

  void start(Stamp stamp, const Pose& world_from_body);
  /// As Localizer.
  bool add(const RelativeMotion& motion) { return localizer_.add(motion); }
  bool add(PoseConstraint constraint);
  bool reaches(Stamp stamp) const { return localizer_.reaches(stamp); }

  UncertainPose world_from_body() const;

  Bytes save() const;
  Status restore(const Bytes& bytes);

 private:
  Localizer localizer_;
  Pose world_from_own_;  // the localizer's world is level and looks ahead; the other one may lie otherwise
};

}  // namespace spartan
