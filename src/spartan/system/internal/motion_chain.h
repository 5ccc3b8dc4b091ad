// The pose of the latest frame relative to a first one.
#pragma once

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/time.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// Composes relative motions, of which several in a row may begin at the same frame (RelativeMotion::keeps_reference):
/// the uncertainty of a lost frame then adds nothing to the poses after it.
class MotionChain {
 public:
  /// Makes the frame at which `motion` ends the first one.
  void start(const RelativeMotion& motion);
  /// The motion that ends at the next frame. It begins at the reference of the motion before or at its end.
  void add(const RelativeMotion& motion);

  const UncertainPose& first_from_last() const { return first_from_last_; }
  Stamp last_stamp() const { return last_stamp_; }

  void save(ArchiveWriter& out) const;
  void restore(ArchiveReader& in);

 private:
  Stamp reference_stamp_, last_stamp_;
  UncertainPose first_from_reference_, first_from_last_;
};

}  // namespace spartan::internal
