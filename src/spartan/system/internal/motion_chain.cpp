#include "spartan/system/internal/motion_chain.h"

namespace spartan::internal {
namespace {

void put(ArchiveWriter& out, const UncertainPose& pose) {
  out.put(pose.pose);
  out.put(pose.covariance);
}

UncertainPose get_uncertain_pose(ArchiveReader& in) {
  UncertainPose pose;
  pose.pose = in.get_pose();
  pose.covariance = in.get_matrix6();
  return pose;
}

}  // namespace

void MotionChain::start(const RelativeMotion& motion) {
  first_from_last_ = first_from_reference_ = {};
  reference_stamp_ = last_stamp_ = motion.to;
  if (!motion.keeps_reference) return;
  reference_stamp_ = motion.from;
  first_from_reference_ = invert({motion.previous_from_current, motion.covariance});
}

void MotionChain::add(const RelativeMotion& motion) {
  if (motion.from != reference_stamp_) first_from_reference_ = first_from_last_;
  reference_stamp_ = motion.from;
  first_from_last_ = compose(first_from_reference_, {motion.previous_from_current, motion.covariance});
  last_stamp_ = motion.to;
  if (motion.keeps_reference) return;
  first_from_reference_ = first_from_last_;
  reference_stamp_ = motion.to;
}

void MotionChain::save(ArchiveWriter& out) const {
  out.put(reference_stamp_.ns);
  out.put(last_stamp_.ns);
  put(out, first_from_reference_);
  put(out, first_from_last_);
}

void MotionChain::restore(ArchiveReader& in) {
  reference_stamp_ = in.get_stamp();
  last_stamp_ = in.get_stamp();
  first_from_reference_ = get_uncertain_pose(in);
  first_from_last_ = get_uncertain_pose(in);
}

}  // namespace spartan::internal
