#include "spartan/system/internal/terrain_stage.h"

#include <utility>

namespace spartan::internal {
namespace {

// All of a view but its disparities.
TerrainView view_of(const RectifiedPair& frame, const Pose& world_from_left) {
  TerrainView view;
  view.pair = frame.pair;
  view.stamp = frame.stamp;
  view.geometry = frame.geometry;
  view.left = Image<std::uint8_t>::copy_of(frame.left);
  view.world_from_left = world_from_left;
  return view;
}

void set_disparities(TerrainView& view, const DisparityImage& computed) {
  view.disparity = Image<float>::copy_of(computed.disparity);
  view.sigma = Image<float>::copy_of(computed.sigma);
}

}  // namespace

void TerrainStage::mark(const RectifiedPair& frame, const Pose& world_from_left, double distance_m) {
  last_m_ = distance_m;
  pending_ = true;
  age_ = 0;
  stamp_ = frame.stamp;
  world_from_left_ = world_from_left;
  job_ = std::make_shared<Job>();
  job_->view = view_of(frame, world_from_left);
}

void TerrainStage::begin(const RectifiedPair& frame, const Pose& world_from_left, double distance_m, double nearest_m,
                         DisparityComputer& computer, BackEnd& back_end) {
  mark(frame, world_from_left, distance_m);
  compute(frame, nearest_m, computer, back_end);
}

void TerrainStage::begin(const RectifiedPair& frame, const Pose& world_from_left, double distance_m,
                         const DisparityImage& known) {
  mark(frame, world_from_left, distance_m);
  set_disparities(job_->view, known);
  ticket_ = 0;
}

// StopMapper::check() has accepted the frame, so it can be computed.
void TerrainStage::compute(const RectifiedPair& frame, double nearest_m, DisparityComputer& computer,
                           BackEnd& back_end) {
  ticket_ = back_end.submit("terrain view", [&computer, job = job_, nearest_m,
                                             images = std::make_shared<const StoredPair>(frame)] {
    const RectifiedPair pair = images->view();
    const DisparityImage computed = job->clock.measure("reconstruction", [&] {
      return computer
          .compute(pair.left, pair.right, disparity_range(pair.geometry, nearest_m), pair.left_mask, pair.right_mask)
          .value();
    });
    set_disparities(job->view, computed);
  });
}

TerrainView TerrainStage::take(StageClock& clock) {
  pending_ = false;
  const std::shared_ptr<Job> job = std::exchange(job_, nullptr);
  clock.add(job->clock.take());
  return std::move(job->view);
}

void TerrainStage::restore_frame(const RectifiedPair& frame, double nearest_m, DisparityComputer& computer,
                                 BackEnd& back_end) {
  job_ = std::make_shared<Job>();
  job_->view = view_of(frame, world_from_left_);
  compute(frame, nearest_m, computer, back_end);
}

void TerrainStage::save(ArchiveWriter& out) const {
  out.put(last_m_);
  out.put(pending_);
  out.put(age_);
  out.put(stamp_.ns);
  out.put(world_from_left_);
}

void TerrainStage::restore(ArchiveReader& in) {
  last_m_ = in.get_finite();
  pending_ = in.get<bool>();
  age_ = in.get<std::int32_t>();
  stamp_ = in.get_stamp();
  world_from_left_ = in.get_pose();
  job_ = nullptr;
}

}  // namespace spartan::internal
