#include "spartan/system/internal/stop_stage.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace spartan::internal {

Status StopStage::add_odometry_frame(std::int64_t position_id, const RectifiedPair& frame, double nearest_m,
                                     const UncertainPose& world_from_body, const RelativeMotion& motion,
                                     BackEnd& back_end) {
  const bool begins = position_id >= 0 && position_id != this->position_id();
  if (begins) {
    if (Status valid = StopMapper::check(frame, nearest_m); !valid) return valid;
  }
  for (Stop& stop : stops_) {
    stop.chain.add(motion);
    if (stop.departed && stop.age < delay_frames_) ++stop.age;
  }
  std::erase_if(early_, [&](const EarlyView& view) { return view.position_id != position_id; });
  if (!begins) return {};
  return begin_stop(position_id, frame, nearest_m, world_from_body, motion, back_end);
}

Status StopStage::begin_stop(std::int64_t position_id, const RectifiedPair& frame, double nearest_m,
                             const UncertainPose& world_from_body, const RelativeMotion& motion, BackEnd& back_end) {
  Stop& stop = stops_.emplace_back();
  stop.position_id = position_id;
  stop.stamp = frame.stamp;
  stop.world_from_body = world_from_body;
  stop.chain.start(motion);
  stop.first_frame.emplace(frame);
  stop.first_frame_nearest_m = nearest_m;
  std::vector<EarlyView> early = std::exchange(early_, {});
  for (EarlyView& view : early) add_to(stop, view.key, std::move(view.images), view.nearest_m, back_end);
  return {};
}

Status StopStage::add_view(std::int64_t position_id, const std::string& pair, const RectifiedPair& frame,
                           double nearest_m, BackEnd& back_end) {
  if (position_id < 0) return {};
  if (Status valid = StopMapper::check(frame, nearest_m); !valid) return valid;
  const FrameKey key{pair, frame.stamp};
  if (position_id == this->position_id()) {
    add_to(stops_.back(), key, StoredPair(frame), nearest_m, back_end);
  } else {
    // Early views of one stop only, so that memory stays bounded if the odometry pair delivers no frames.
    std::erase_if(early_, [&](const EarlyView& view) { return view.position_id != position_id; });
    early_.push_back({position_id, key, StoredPair(frame), nearest_m});
  }
  return {};
}

void StopStage::add_to(Stop& stop, const FrameKey& key, StoredPair images, double nearest_m, BackEnd& back_end) {
  if (stop.ticket != 0) return;  // merged before
  if (stop.first_frame) compute(stop, *std::exchange(stop.first_frame, {}), stop.first_frame_nearest_m, back_end);
  compute(stop, std::move(images), nearest_m, back_end);
  stop.views.push_back(key);
}

// The view was checked when it was added, so it can be computed.
void StopStage::compute(const Stop& stop, StoredPair images, double nearest_m, BackEnd& back_end) {
  const Eigen::Vector3d up_in_body = stop.world_from_body.pose.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  back_end.submit("view of a stop", [this, up_in_body, nearest_m, merged = stop.merged,
                                     view = std::make_shared<const StoredPair>(std::move(images))] {
    const Status added =
        merged->clock.measure("reconstruction", [&] { return mapper_.add(view->view(), nearest_m, up_in_body); });
    if (!added) throw std::logic_error("StopStage: " + added.error().message());
  });
}

void StopStage::depart(BackEnd& back_end) {
  if (current() == nullptr) return;
  Stop& stop = stops_.back();
  if (stop.views.empty()) {
    stops_.pop_back();
    return;
  }
  stop.departed = true;
  stop.departure = std::chrono::steady_clock::now();
  if (stop.ticket == 0) merge(stop, back_end);
}

void StopStage::merge(Stop& stop, BackEnd& back_end) {
  stop.ticket = back_end.submit("merging of a stop", [this, merged = stop.merged] {
    merged->clock.measure("mapping", [&] { merged->points = surface_points(mapper_.merge()); });
    mapper_.leave();
  });
}

void StopStage::start_match(const MapMerger& merger, std::optional<MapExcerpt> global, StageClock clock,
                            BackEnd& back_end) {
  Stop& stop = stops_.front();
  stop.match = std::make_shared<MapMergeResult>();
  stop.ticket = back_end.submit(
      "map of a stop",
      [&merger, &back_end, merged = stop.merged, match = stop.match, stamp = stop.stamp, prior = stop.world_from_body,
       taken = clock.take(), excerpt = std::make_shared<const std::optional<MapExcerpt>>(std::move(global))] {
        merged->clock.add(taken);
        *match = merged->clock.measure(
            "slam", [&] { return merger.match(merged->points, stamp, prior, *excerpt, back_end.workers()); });
      });
}

StopSurvey StopStage::survey() const {
  const Stop& stop = *oldest();
  return {stop.position_id,
          stop.stamp,
          stop.world_from_body,
          stop.chain.last_stamp(),
          stop.chain.first_from_last(),
          static_cast<int>(stop.views.size()) + 1};
}

StopStage::Mapped StopStage::take_oldest() {
  const Stop& stop = stops_.front();
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - stop.departure;
  Mapped mapped{std::move(*stop.match), stop.merged->clock.take(), since.count()};
  stops_.pop_front();
  return mapped;
}

std::vector<FrameKey> StopStage::pending_frames(const std::string& odometry_pair) const {
  std::vector<FrameKey> keys;
  for (const Stop& stop : stops_) {
    if (stop.first_frame_is_pending) keys.push_back({odometry_pair, stop.stamp});
    keys.insert(keys.end(), stop.pending.begin(), stop.pending.end());
  }
  keys.insert(keys.end(), pending_early_.begin(), pending_early_.end());
  return keys;
}

void StopStage::restore_first_frame(const RectifiedPair& frame, double nearest_m) {
  for (Stop& stop : stops_) {
    if (!stop.first_frame_is_pending || stop.stamp != frame.stamp) continue;
    stop.first_frame_is_pending = false;
    stop.first_frame.emplace(frame);
    stop.first_frame_nearest_m = nearest_m;
  }
}

Status StopStage::restore_view(const std::string& pair, const RectifiedPair& frame, double nearest_m,
                               std::int64_t position_id, BackEnd& back_end) {
  const auto is_it = [&](const FrameKey& key) { return key.pair == pair && key.left_stamp == frame.stamp; };
  const auto stop = std::find_if(stops_.begin(), stops_.end(), [&](const Stop& s) {
    return s.position_id == position_id && std::any_of(s.pending.begin(), s.pending.end(), is_it);
  });
  if (Status valid = StopMapper::check(frame, nearest_m); !valid) return valid;
  if (stop == stops_.end()) {
    std::erase_if(pending_early_, is_it);
    return add_view(position_id, pair, frame, nearest_m, back_end);
  }
  std::erase_if(stop->pending, is_it);
  add_to(*stop, {pair, frame.stamp}, StoredPair(frame), nearest_m, back_end);
  if (stop->departed && stop->pending.empty()) merge(*stop, back_end);
  return {};
}

void StopStage::abandon_pending_frames() {
  std::erase_if(stops_, [](const Stop& stop) { return stop.first_frame_is_pending || !stop.pending.empty(); });
  pending_early_.clear();
}

void StopStage::save(ArchiveWriter& out) const {
  const auto put_keys = [&out](const std::vector<FrameKey>& keys) {
    std::vector<std::int64_t> stamps;
    stamps.reserve(keys.size());
    for (const FrameKey& key : keys) stamps.push_back(key.left_stamp.ns);
    out.put_array(stamps.data(), stamps.size());
    for (const FrameKey& key : keys) out.put(key.pair);
  };
  out.put(static_cast<std::uint32_t>(stops_.size()));
  for (const Stop& stop : stops_) {
    out.put(stop.position_id);
    out.put(stop.stamp.ns);
    out.put(stop.world_from_body.pose);
    out.put(stop.world_from_body.covariance);
    stop.chain.save(out);
    out.put(stop.departed);
    out.put(stop.age);
    put_keys(stop.views);
  }
  std::vector<FrameKey> early;
  early.reserve(early_.size());
  for (const EarlyView& view : early_) early.push_back(view.key);
  put_keys(early);
}

void StopStage::restore(ArchiveReader& in) {
  const auto get_keys = [&in] {
    std::vector<FrameKey> keys;
    for (const std::int64_t stamp : in.get_array<std::int64_t>()) keys.push_back({in.get_string(), Stamp{stamp}});
    return keys;
  };
  mapper_.leave();
  stops_.clear();
  early_.clear();
  const auto count = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    Stop& stop = stops_.emplace_back();
    stop.position_id = in.get<std::int64_t>();
    stop.stamp = in.get_stamp();
    stop.world_from_body.pose = in.get_pose();
    stop.world_from_body.covariance = in.get_matrix6();
    stop.chain.restore(in);
    stop.departed = in.get<bool>();
    stop.age = in.get<std::int32_t>();
    stop.pending = get_keys();
    stop.first_frame_is_pending = true;
  }
  pending_early_ = get_keys();
}

}  // namespace spartan::internal
