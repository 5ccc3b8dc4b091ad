#include "small_drive.h"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "spartan/core/files.h"
#include "spartan/core/trajectory.h"
#include "spartan/image_io/image_io.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/synthetic_world.h"

namespace spartan::testing {
namespace {

void must(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message());
}

RectifiedStereo small_camera() {
  return {{320, 240}, 260.0, {159.5, 119.5}, 0.12};
}

// 0.5 m above the ground, looking 25° down, on a gentle curve.
Pose world_from_left(const SmallDrive& drive, int i) {
  const double s = drive.step_m * i, yaw = 0.02 * i;
  const Pose body = Pose(exp_so3({0, 0, yaw}), {s, 0.5 * s * yaw, 0.5});
  const Pose tilted = body * Pose::from_rotation(exp_so3({0, 25 * M_PI / 180, 0}));
  return tilted * optical_from_forward().inverse();
}

std::string calib_text(const RectifiedStereo& c) {
  const auto line = [&](int index, double shift) {
    return fmt::format("P{}: {} 0 {} {} 0 {} {} 0 0 0 1 0\n", index, c.focal_px, c.centre_px.x(), shift, c.focal_px,
                       c.centre_px.y());
  };
  return line(0, 0) + line(1, -c.focal_px * c.baseline_m);
}

}  // namespace

void write_small_drive(const std::string& folder, const SmallDrive& drive) {
  must(make_folder(folder + "/image_0"));
  must(make_folder(folder + "/image_1"));
  const RectifiedStereo camera = small_camera();
  SyntheticWorldOptions options;
  const SyntheticWorld world(options);
  std::string times;
  Trajectory truth;
  const Pose start = world_from_left(drive, 0);
  for (int i = 0; i < drive.frames; ++i) {
    const Pose pose = world_from_left(drive, i);
    const SyntheticFrame frame = world.render(camera, pose, static_cast<std::uint64_t>(i));
    must(write_png(fmt::format("{}/image_0/{:06}.png", folder, i), frame.left));
    must(write_png(fmt::format("{}/image_1/{:06}.png", folder, i), frame.right));
    times += fmt::format("{:.9f}\n", drive.period_s * i);
    truth.push_back({Stamp::from_seconds(drive.period_s * i), start.inverse() * pose});
  }
  must(write_file_atomically(folder + "/calib.txt", calib_text(camera)));
  must(write_file_atomically(folder + "/times.txt", times));
  must(write_file_atomically(folder + "/poses.txt", to_kitti(truth)));
}

void write_gray_png(const std::string& path, int width, int height) {
  must(write_png(path, Image<std::uint8_t>(width, height, 128)));
}

void turn_upside_down(const std::string& left, const std::string& right) {
  const Image<std::uint8_t> old_left = read_gray8(left).value(), old_right = read_gray8(right).value();
  const auto turned = [](const Image<std::uint8_t>& image) {
    Image<std::uint8_t> result(image.size());
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) result(x, y) = image(image.width() - 1 - x, image.height() - 1 - y);
    }
    return result;
  };
  must(write_png(left, turned(old_right)));
  must(write_png(right, turned(old_left)));
}

}  // namespace spartan::testing
