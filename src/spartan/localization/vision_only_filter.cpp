#include "spartan/localization/localizer.h"

namespace spartan {

Result<VisionOnlyFilter> VisionOnlyFilter::create(const LocalizationOptions& options) {
  auto localizer = Localizer::create(options);
  if (!localizer) return failure(localizer);
  return VisionOnlyFilter(std::move(*localizer));
}

void VisionOnlyFilter::start(Stamp stamp, const Pose& world_from_body) {
  localizer_.start(stamp, Eigen::Vector3d::UnitX());
  world_from_own_ = world_from_body * localizer_.estimate().world_from_body.pose.inverse();
}

// Right perturbations: covariances are the same in either world.
bool VisionOnlyFilter::add(PoseConstraint constraint) {
  constraint.world_from_body = world_from_own_.inverse() * constraint.world_from_body;
  return localizer_.add(constraint);
}

UncertainPose VisionOnlyFilter::world_from_body() const {
  UncertainPose pose = localizer_.estimate().world_from_body;
  pose.pose = world_from_own_ * pose.pose;
  return pose;
}

Bytes VisionOnlyFilter::save() const {
  ArchiveWriter out;
  const Bytes localizer = localizer_.save();
  out.put(world_from_own_);
  out.put_array(localizer.data(), localizer.size());
  return out.take();
}

Status VisionOnlyFilter::restore(const Bytes& bytes) {
  ArchiveReader in(bytes);
  const Pose world_from_own = in.get_pose();
  const auto localizer = in.get_array<std::uint8_t>();
  if (Status s = in.finish("saved state of the vision-only filter"); !s) return s;
  if (Status s = localizer_.restore(localizer); !s) return s;
  world_from_own_ = world_from_own;
  return {};
}

}  // namespace spartan
