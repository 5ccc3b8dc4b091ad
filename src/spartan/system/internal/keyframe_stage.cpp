#include "spartan/system/internal/keyframe_stage.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "spartan/core/time.h"

namespace spartan::internal {
namespace {

constexpr int kRings = 8, kRays = 9;  // samples of a sector

double wrapped(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

}  // namespace

bool GroundSector::contains(const Eigen::Vector2d& point_m) const {
  const Eigen::Vector2d d = point_m - camera_m;
  return d.norm() <= range_m && std::abs(wrapped(std::atan2(d.y(), d.x()) - heading_rad)) <= half_angle_rad;
}

GroundSector ground_sector(const RectifiedStereo& geometry, const Pose& world_from_left, double range_m) {
  constexpr double kLeastHorizontal = 0.1;  // of the unit vector of the optical axis; less is straight down
  const Eigen::Vector3d axis = world_from_left.rotation() * Eigen::Vector3d::UnitZ();
  GroundSector sector;
  sector.camera_m = world_from_left.translation().head<2>();
  sector.range_m = range_m;
  if (axis.head<2>().norm() < kLeastHorizontal) {
    sector.half_angle_rad = std::numbers::pi;
  } else {
    sector.heading_rad = std::atan2(axis.y(), axis.x());
    sector.half_angle_rad = std::atan(0.5 * geometry.size.width / geometry.focal_px);
  }
  return sector;
}

double new_ground(const GroundSector& now, const GroundSector& before) {
  double outside = 0, all = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double radius = now.range_m * (ring + 0.5) / kRings;  // also the weight: the area of the ring
    for (int ray = 0; ray < kRays; ++ray) {
      const double angle = now.heading_rad + now.half_angle_rad * ((2.0 * ray + 1) / kRays - 1);
      const Eigen::Vector2d point = now.camera_m + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      all += radius;
      if (!before.contains(point)) outside += radius;
    }
  }
  return outside / all;
}

bool KeyframeStage::is_due(const RectifiedPair& frame, const Pose& world_from_left) const {
  if (!any_) return true;
  const Pose last_from_now = world_from_left_.inverse() * world_from_left;
  const double every_m = options_.every_m > 0 ? options_.every_m : side_m_ / 4;
  if (last_from_now.translation().norm() >= every_m) return true;
  if (log_so3(last_from_now.rotation()).norm() >= options_.turn_deg * std::numbers::pi / 180) return true;
  const double range_m = side_m_ / 2;
  return new_ground(ground_sector(frame.geometry, world_from_left, range_m),
                    ground_sector(frame.geometry, world_from_left_, range_m)) >= options_.new_ground;
}

void KeyframeStage::begin(const RectifiedPair& frame, const Pose& world_from_left, const UncertainPose& world_from_body,
                          const RelativeMotion& motion) {
  any_ = pending_ = true;
  age_ = 0;
  world_from_left_ = world_from_left;
  world_from_body_ = world_from_body;
  stamp_ = frame.stamp;
  chain_.start(motion);
  frame_.emplace(frame);
}

void KeyframeStage::advance(const RelativeMotion& motion) {
  if (!pending_) return;
  if (age_ < options_.delay_frames) ++age_;
  chain_.add(motion);
}

Result<std::vector<SurfacePoint>> KeyframeStage::points(double nearest_m) {
  const Eigen::Vector3d up_in_body = world_from_body_.pose.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  mapper_.leave();
  if (Status added = mapper_.add(frame_->view(), nearest_m, up_in_body); !added) return failure(added);
  return surface_points(mapper_.merge());
}

StopSurvey KeyframeStage::survey() const {
  StopSurvey survey;
  survey.stamp = stamp_;
  survey.last_stamp = chain_.last_stamp();
  survey.first_from_last = chain_.first_from_last();
  survey.world_from_body = world_from_body_;
  survey.views = 1;
  return survey;
}

void KeyframeStage::clear() {
  pending_ = false;
  mapper_.leave();
  frame_.reset();
}

std::optional<Stamp> KeyframeStage::pending_frame() const {
  return pending_ && !frame_ ? std::optional(stamp_) : std::nullopt;
}

void KeyframeStage::save(ArchiveWriter& out) const {
  out.put(any_);
  out.put(pending_);
  out.put(world_from_left_);
  out.put(age_);
  out.put(stamp_.ns);
  out.put(world_from_body_.pose);
  out.put(world_from_body_.covariance);
  chain_.save(out);
}

void KeyframeStage::restore(ArchiveReader& in) {
  any_ = in.get<bool>();
  pending_ = in.get<bool>();
  world_from_left_ = in.get_pose();
  age_ = in.get<std::int32_t>();
  stamp_ = in.get_stamp();
  world_from_body_.pose = in.get_pose();
  world_from_body_.covariance = in.get_matrix6();
  chain_.restore(in);
  mapper_.leave();
  frame_.reset();
}

}  // namespace spartan::internal
