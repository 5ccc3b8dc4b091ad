#include "spartan/system/internal/stop_stage.h"

#include <utility>

namespace spartan::internal {

Status StopStage::add_odometry_frame(std::int64_t position_id, const RectifiedPair& frame, double nearest_m,
                                     const UncertainPose& world_from_body, const RelativeMotion& motion) {
  const bool begins = position_id >= 0 && position_id != position_id_;
  if (begins) {
    if (Status valid = StopMapper::check(frame, nearest_m); !valid) return valid;
  }
  std::erase_if(early_, [&](const EarlyView& view) { return view.position_id != position_id; });
  if (position_id < 0) return {};
  if (begins) return begin_stop(position_id, frame, nearest_m, world_from_body, motion);
  chain_.add(motion);
  return {};
}

Status StopStage::begin_stop(std::int64_t position_id, const RectifiedPair& frame, double nearest_m,
                             const UncertainPose& world_from_body, const RelativeMotion& motion) {
  mapper_.leave();
  position_id_ = position_id;
  stamp_ = frame.stamp;
  world_from_body_ = world_from_body;
  chain_.start(motion);
  views_.clear();
  pending_.clear();
  first_frame_.emplace(frame);
  first_frame_nearest_m_ = nearest_m;
  const std::vector<EarlyView> early = std::exchange(early_, {});
  for (const EarlyView& view : early) {
    if (Status s = add_view(position_id, view.key.pair, view.images.view(), view.nearest_m); !s) return s;
  }
  return {};
}

void StopStage::restore_first_frame(const RectifiedPair& frame, double nearest_m) {
  first_frame_.emplace(frame);
  first_frame_nearest_m_ = nearest_m;
}

Status StopStage::add_to_mapper(const RectifiedPair& frame, double nearest_m) {
  const Eigen::Vector3d up_in_body = world_from_body_.pose.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  return mapper_.add(frame, nearest_m, up_in_body);
}

Status StopStage::add_view(std::int64_t position_id, const std::string& pair, const RectifiedPair& frame,
                           double nearest_m) {
  if (position_id < 0) return {};
  if (Status valid = StopMapper::check(frame, nearest_m); !valid) return valid;
  std::erase_if(pending_, [&](const FrameKey& key) { return key.pair == pair && key.left_stamp == frame.stamp; });
  if (position_id != position_id_) {
    // Early views of one stop only, so that memory stays bounded if the odometry pair delivers no frames.
    std::erase_if(early_, [&](const EarlyView& view) { return view.position_id != position_id; });
    early_.push_back({position_id, {pair, frame.stamp}, StoredPair(frame), nearest_m});
    return {};
  }
  if (mapper_.views().empty() && first_frame_) {
    if (Status s = add_to_mapper(first_frame_->view(), first_frame_nearest_m_); !s) return s;
  }
  if (Status s = add_to_mapper(frame, nearest_m); !s) return s;
  views_.push_back({pair, frame.stamp});
  return {};
}

std::optional<Stamp> StopStage::pending_first_frame() const {
  return position_id_ < 0 || first_frame_ ? std::nullopt : std::optional(stamp_);
}

std::optional<StopSurvey> StopStage::survey() {
  if (mapper_.views().empty()) return std::nullopt;
  StopSurvey survey;
  survey.position_id = position_id_;
  survey.stamp = stamp_;
  survey.last_stamp = chain_.last_stamp();
  survey.first_from_last = chain_.first_from_last();
  survey.world_from_body = world_from_body_;
  survey.views = static_cast<int>(mapper_.views().size());
  survey.points = surface_points(mapper_.merge());
  return survey;
}

void StopStage::clear() {
  mapper_.leave();
  first_frame_.reset();
  views_.clear();
  pending_.clear();
  position_id_ = -1;
}

void StopStage::save(ArchiveWriter& out) const {
  out.put(position_id_);
  out.put(stamp_.ns);
  out.put(world_from_body_.pose);
  out.put(world_from_body_.covariance);
  chain_.save(out);
  std::vector<FrameKey> keys = views_;
  for (const EarlyView& view : early_) keys.push_back(view.key);
  std::vector<std::int64_t> stamps;
  stamps.reserve(keys.size());
  for (const FrameKey& key : keys) stamps.push_back(key.left_stamp.ns);
  out.put_array(stamps.data(), stamps.size());
  for (const FrameKey& key : keys) out.put(key.pair);
}

void StopStage::restore(ArchiveReader& in) {
  position_id_ = in.get<std::int64_t>();
  stamp_ = in.get_stamp();
  world_from_body_.pose = in.get_pose();
  world_from_body_.covariance = in.get_matrix6();
  chain_.restore(in);
  early_.clear();
  views_.clear();
  pending_.clear();
  for (const std::int64_t stamp : in.get_array<std::int64_t>()) pending_.push_back({in.get_string(), Stamp{stamp}});
  mapper_.leave();
  first_frame_.reset();
}

}  // namespace spartan::internal
