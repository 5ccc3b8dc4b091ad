#include "spartan/system/position_stage.h"

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

void PositionStage::arrive(std::int64_t position_id, const RectifiedPair& shot, double nearest_m,
                           const UncertainPose& standing) {
  mapper_.leave();
  position_id_ = position_id;
  stamp_ = shot.stamp;
  standing_ = standing;
  kept_.emplace(shot);
  kept_nearest_m_ = nearest_m;
}

void PositionStage::recall(const RectifiedPair& shot, double nearest_m) {
  if (kept_ || shot.stamp != stamp_) return;
  kept_.emplace(shot);
  kept_nearest_m_ = nearest_m;
}

Status PositionStage::add(const RectifiedPair& shot, double nearest_m) {
  const Eigen::Vector3d up_in_body = standing_.pose.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  return mapper_.add(shot, nearest_m, up_in_body);
}

Status PositionStage::look(std::int64_t position_id, const RectifiedPair& shot, double nearest_m) {
  if (position_id < 0 || position_id != position_id_) return {};
  if (mapper_.views().empty() && kept_) {
    if (Status s = add(kept_->view(), kept_nearest_m_); !s) return s;
  }
  return add(shot, nearest_m);
}

std::optional<Stamp> PositionStage::kept_stamp() const {
  return position_id_ < 0 ? std::nullopt : std::optional(stamp_);
}

std::optional<PositionSurvey> PositionStage::leave() {
  std::optional<PositionSurvey> survey;
  if (!mapper_.views().empty()) {
    survey.emplace();
    survey->position_id = position_id_;
    survey->stamp = stamp_;
    survey->standing = standing_;
    survey->views = static_cast<int>(mapper_.views().size());
    survey->merged = mapper_.merge();
    survey->points = surface_points(survey->merged);
  }
  mapper_.leave();
  kept_.reset();
  position_id_ = -1;
  return survey;
}

void PositionStage::save(ArchiveWriter& out) const {
  out.put(position_id_);
  out.put(stamp_.ns);
  out.put(standing_.pose);
  out.put(standing_.covariance);
}

void PositionStage::restore(ArchiveReader& in) {
  position_id_ = in.get<std::int64_t>();
  stamp_.ns = in.get<std::int64_t>();
  standing_.pose = in.get_pose();
  standing_.covariance = in.get_matrix6();
  mapper_.leave();
  kept_.reset();
}

}  // namespace spartan
