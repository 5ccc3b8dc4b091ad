// The saved state of all stages, as `run --resume` reads it. An input is a list of edits of a valid state, so that
// mutations reach the values behind versions and lengths. The checksum around the state is not part of it: a stranger
// could compute a valid one.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "spartan/storage/database.h"
#include "spartan/system/pipeline.h"
#include "spartan/testing/synthetic_world.h"
#include "spartan/testing/temporary_folder.h"

namespace {

using namespace spartan;

constexpr std::size_t kMostEdits = 16;
constexpr std::int64_t kSecond_ns = 1'000'000'000;
const RectifiedStereo kStereo{{96, 72}, 74.0, {47.5, 35.5}, 0.12};

// An edit as it stands in the input: `count` % 9 bytes replaced from `at` on, modulo the size; 0: the state ends there.
struct Edit {
  std::uint32_t at;
  std::uint8_t count;
  std::array<std::uint8_t, 8> bytes;
};

Rig rig_of_one_pair() {
  Rig rig;
  rig.name = "rover";
  const Pose body_from_left = Pose(exp_so3({0, 0.55, 0}), {0.1, 0, 0.5}) * Pose(optical_from_forward().inverse());
  for (const char* name : {"left", "right"}) {
    Camera camera;
    camera.name = name;
    camera.size = kStereo.size;
    camera.model = PinholeModel{kStereo.focal_px, kStereo.focal_px, kStereo.centre_px.x(), kStereo.centre_px.y()};
    camera.mount_from_camera =
        body_from_left * Pose::from_translation({rig.cameras.empty() ? 0 : kStereo.baseline_m, 0, 0});
    rig.cameras.push_back(camera);
  }
  rig.pairs = {{"stereo", "left", "right", 0.4, true}};
  return rig;
}

// The rover drives straight ahead and measures by all its sensors.
class Drive {
 public:
  static constexpr int kFrames = 4;
  Drive() {
    const testing::SyntheticWorld world(testing::SyntheticWorldOptions{});
    const Pose body_from_left = rig_of_one_pair().body_from_camera("left");
    for (int i = 0; i < kFrames; ++i) {
      const Pose world_from_body = Pose::from_translation({0.05 * i, 0, 0});
      images_.push_back(world.render(kStereo, world_from_body * body_from_left, static_cast<std::uint64_t>(i)));
    }
  }
  void push(Pipeline& to, int index) const {
    const Stamp stamp{index * kSecond_ns};
    for (int i = 10; i > 0; --i) to.add(ImuSample{{stamp.ns - i * kSecond_ns / 10}, {0, 0, 0}, {0, 0, 9.81}});
    to.add(WheelSample{stamp, 0.05, 0});
    to.add(CompassSample{stamp, 0.1, 0.05});
    to.add(InclinometerSample{stamp, 0.01, 0.02, 0.01});
    StereoFrame frame;
    frame.frame_id = frame.position_id = index;
    frame.pair = "stereo";
    frame.left_stamp = frame.right_stamp = stamp;
    const testing::SyntheticFrame& rendered = images_[static_cast<std::size_t>(index)];
    frame.left = FrameImage::borrow(rendered.left.view(), {});
    frame.right = FrameImage::borrow(rendered.right.view(), {});
    static_cast<void>(to.add(frame));
  }

 private:
  std::vector<testing::SyntheticFrame> images_;
};

Pipeline new_pipeline(bool odometry_only) {
  RunOptions options;
  options.odometry_only = odometry_only;
  options.terrain.enabled = false;
  return Pipeline::create(rig_of_one_pair(), options, ThreadPool(1)).value();
}

Bytes valid_state(const Drive& drive, bool odometry_only) {
  Pipeline pipeline = new_pipeline(odometry_only);
  for (int i = 0; i < Drive::kFrames - 1; ++i) drive.push(pipeline, i);
  return pipeline.save();
}

void apply(Bytes& state, const std::uint8_t* data, std::size_t size) {
  for (std::size_t i = 0; i < std::min(size / sizeof(Edit), kMostEdits) && !state.empty(); ++i) {
    Edit edit{};
    std::memcpy(&edit, data + i * sizeof edit, sizeof edit);
    const std::size_t at = edit.at % state.size(), count = edit.count % 9U;
    if (count == 0) state.resize(at);
    std::copy_n(edit.bytes.begin(), std::min(count, state.size() - std::min(at, state.size())),
                state.begin() + static_cast<std::ptrdiff_t>(std::min(at, state.size())));
  }
}

struct Store {
  testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Drive drive;
  static const std::array<Bytes, 2> valid{valid_state(drive, false), valid_state(drive, true)};
  static Store store;
  if (size == 0) return 0;
  const bool odometry_only = data[0] % 2 == 1;
  Bytes state = valid[odometry_only ? 1 : 0];
  apply(state, data + 1, size - 1);
  Pipeline pipeline = new_pipeline(odometry_only);
  if (!pipeline.restore(state, store.tiles)) return 0;
  const Bytes saved = pipeline.save();
  Pipeline again = new_pipeline(odometry_only);
  if (!again.restore(saved, store.tiles)) __builtin_trap();
  drive.push(pipeline, Drive::kFrames - 1);
  return 0;
}
