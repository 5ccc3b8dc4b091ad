// A short drive over the synthetic world in KITTI's layout, for tests of the whole program.
#pragma once

#include <array>
#include <string>

namespace spartan::testing {

/// With which `spartan run` makes the finished run of the drive.
inline constexpr std::array<const char*, 2> kSmallDriveOptions{"--set", "terrain.every_m=0.15"};

struct SmallDrive {
  int frames = 14;
  double step_m = 0.04;  ///< forward, each frame
  double period_s = 0.5;
};

/// Writes calib.txt, times.txt, poses.txt (truth), image_0/ and image_1/ into a new folder.
void write_small_drive(const std::string& folder, const SmallDrive& drive = {});

/// A gray image of one level.
void write_gray_png(const std::string& path, int width, int height);

/// Rotates both images of a rectified pair by 180° and exchanges them, which gives a valid pair of another scene.
void turn_upside_down(const std::string& left, const std::string& right);

}  // namespace spartan::testing
