// Test fixture of this module: a rover that drives straight ahead, with rendered images.
#pragma once

#include <vector>

#include "spartan/storage/database.h"
#include "spartan/system/pipeline.h"
#include "spartan/testing/synthetic_world.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan::rendered_drive {

using testing::SyntheticFrame;

inline const RectifiedStereo kStereo{{320, 240}, 246.0, {159.5, 119.5}, 0.12};
inline constexpr double kHeight_m = 0.5, kTilt_rad = 0.55, kStep_m = 0.05;

inline Camera camera(const std::string& name) {
  Camera made;
  made.name = name;
  made.size = kStereo.size;
  made.model = PinholeModel{kStereo.focal_px, kStereo.focal_px, kStereo.centre_px.x(), kStereo.centre_px.y()};
  return made;
}

/// The narrow pair looks down by kTilt_rad from a height of half a metre; the wide pair is for stops only.
inline Rig rover() {
  const Pose body_from_left =
      Pose(exp_so3({0, kTilt_rad, 0}), {0.1, 0, kHeight_m}) * Pose(optical_from_forward().inverse());
  Rig rig;
  rig.name = "rover";
  rig.cameras = {camera("left"), camera("right"), camera("wide_left"), camera("wide_right")};
  for (std::size_t i = 0; i < 4; ++i) {
    rig.cameras[i].mount_from_camera =
        body_from_left * Pose::from_translation({i % 2 == 0 ? 0 : kStereo.baseline_m, 0, 0});
  }
  rig.pairs = {{"wide", "wide_left", "wide_right", 0, false}, {"narrow", "left", "right", 0.4, true}};
  return rig;
}

inline Pose world_from_body(int index) {
  return Pose::from_translation({kStep_m * index, 0, 0});
}

/// Rendered once: the rover drives straight ahead over gentle terrain.
inline const std::vector<SyntheticFrame>& rendered_frames() {
  static const std::vector<SyntheticFrame> made = [] {
    const testing::SyntheticWorld world(testing::SyntheticWorldOptions{});
    const Pose body_from_left = rover().body_from_camera("left");
    std::vector<SyntheticFrame> rendered;
    rendered.reserve(5);
    for (int i = 0; i < 5; ++i) {
      rendered.push_back(world.render(kStereo, world_from_body(i) * body_from_left, static_cast<std::uint64_t>(i)));
    }
    return rendered;
  }();
  return made;
}

inline StereoFrame frame_at(int index) {
  StereoFrame frame;
  frame.frame_id = index;
  frame.pair = "narrow";
  frame.left_stamp = frame.right_stamp = Stamp{index * 1'000'000'000LL};
  const SyntheticFrame& images = rendered_frames()[static_cast<std::size_t>(index)];
  frame.left = FrameImage::borrow(images.left.view(), {});
  frame.right = FrameImage::borrow(images.right.view(), {});
  return frame;
}

inline Pipeline pipeline_of(const RunOptions& options = {}, int threads = 1) {
  return Pipeline::create(rover(), options, ThreadPool(threads)).value();
}

/// An empty map store.
struct EmptyMaps {
  testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
};

inline FrameResult push(Pipeline& pipeline, int index) {
  return pipeline.add(frame_at(index)).value().value();
}

}  // namespace spartan::rendered_drive
