#include "spartan/system/internal/position_stage.h"

#include <utility>

namespace spartan {

PositionStage::KeptShot::KeptShot(const RectifiedPair& shot)
    : pair(shot),
      left(Image<std::uint8_t>::copy_of(shot.left)),
      right(Image<std::uint8_t>::copy_of(shot.right)),
      left_mask(Image<std::uint8_t>::copy_of(shot.left_mask)),
      right_mask(Image<std::uint8_t>::copy_of(shot.right_mask)) {}

RectifiedPair PositionStage::KeptShot::view() const {
  RectifiedPair shot = pair;
  shot.left = left;
  shot.right = right;
  shot.left_mask = left_mask;
  shot.right_mask = right_mask;
  return shot;
}

Status PositionStage::pass(std::int64_t position_id, const RectifiedPair& shot, double nearest_m,
                           const UncertainPose& standing, const UncertainPose& moved) {
  const bool arrives = position_id >= 0 && position_id != position_id_;
  if (arrives) {
    if (Status fits = StopMapper::check(shot, nearest_m); !fits) return fits;
  }
  std::erase_if(early_, [&](const EarlyLook& look) { return look.position_id != position_id; });
  if (position_id < 0) return {};
  if (arrives) return arrive(position_id, shot, nearest_m, standing);
  last_stamp_ = shot.stamp;
  since_arrival_ = compose(since_arrival_, moved);
  return {};
}

Status PositionStage::arrive(std::int64_t position_id, const RectifiedPair& shot, double nearest_m,
                             const UncertainPose& standing) {
  mapper_.leave();
  position_id_ = position_id;
  stamp_ = last_stamp_ = shot.stamp;
  standing_ = standing;
  since_arrival_ = {};
  looks_.clear();
  wanted_.clear();
  kept_.emplace(shot);
  kept_nearest_m_ = nearest_m;
  const std::vector<EarlyLook> early = std::exchange(early_, {});
  for (const EarlyLook& look : early) {
    if (Status s = this->look(position_id, look.name.pair, look.shot.view(), look.nearest_m); !s) return s;
  }
  return {};
}

void PositionStage::recall_arrival(const RectifiedPair& shot, double nearest_m) {
  kept_.emplace(shot);
  kept_nearest_m_ = nearest_m;
}

Status PositionStage::add(const RectifiedPair& shot, double nearest_m) {
  const Eigen::Vector3d up_in_body = standing_.pose.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  return mapper_.add(shot, nearest_m, up_in_body);
}

Status PositionStage::look(std::int64_t position_id, const std::string& pair, const RectifiedPair& shot,
                           double nearest_m) {
  if (position_id < 0) return {};
  if (Status fits = StopMapper::check(shot, nearest_m); !fits) return fits;
  std::erase_if(wanted_, [&](const FrameKey& w) { return w.pair == pair && w.left_stamp == shot.stamp; });
  if (position_id != position_id_) {
    // Of one position, so that they do not pile up where the odometry's pair has gone dark.
    std::erase_if(early_, [&](const EarlyLook& look) { return look.position_id != position_id; });
    early_.push_back({position_id, {pair, shot.stamp}, KeptShot(shot), nearest_m});
    return {};
  }
  if (mapper_.views().empty() && kept_) {
    if (Status s = add(kept_->view(), kept_nearest_m_); !s) return s;
  }
  if (Status s = add(shot, nearest_m); !s) return s;
  looks_.push_back({pair, shot.stamp});
  return {};
}

std::optional<Stamp> PositionStage::wanted_arrival() const {
  return position_id_ < 0 || kept_ ? std::nullopt : std::optional(stamp_);
}

std::optional<PositionSurvey> PositionStage::survey() {
  if (mapper_.views().empty()) return std::nullopt;
  PositionSurvey survey;
  survey.position_id = position_id_;
  survey.stamp = stamp_;
  survey.last_stamp = last_stamp_;
  survey.since_arrival = since_arrival_;
  survey.standing = standing_;
  survey.views = static_cast<int>(mapper_.views().size());
  survey.merged = mapper_.merge();
  survey.points = surface_points(survey.merged);
  return survey;
}

void PositionStage::leave() {
  mapper_.leave();
  kept_.reset();
  looks_.clear();
  wanted_.clear();
  position_id_ = -1;
}

void PositionStage::save(ArchiveWriter& out) const {
  out.put(position_id_);
  out.put(stamp_.ns);
  out.put(standing_.pose);
  out.put(standing_.covariance);
  out.put(last_stamp_.ns);
  out.put(since_arrival_.pose);
  out.put(since_arrival_.covariance);
  std::vector<FrameKey> views = looks_;
  for (const EarlyLook& look : early_) views.push_back(look.name);
  std::vector<std::int64_t> stamps;
  stamps.reserve(views.size());
  for (const FrameKey& view : views) stamps.push_back(view.left_stamp.ns);
  out.put_array(stamps.data(), stamps.size());
  for (const FrameKey& view : views) out.put(view.pair);
}

void PositionStage::restore(ArchiveReader& in) {
  position_id_ = in.get<std::int64_t>();
  stamp_.ns = in.get<std::int64_t>();
  standing_.pose = in.get_pose();
  standing_.covariance = in.get_matrix6();
  last_stamp_.ns = in.get<std::int64_t>();
  since_arrival_.pose = in.get_pose();
  since_arrival_.covariance = in.get_matrix6();
  early_.clear();
  looks_.clear();
  wanted_.clear();
  for (const std::int64_t stamp : in.get_array<std::int64_t>()) wanted_.push_back({in.get_string(), Stamp{stamp}});
  mapper_.leave();
  kept_.reset();
}

}  // namespace spartan
