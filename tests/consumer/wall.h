// Stands for the cameras of somebody else: their images are of a textured wall 3 m away.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/rig/rig.h"

inline constexpr int kWidth = 640, kHeight = 480;
inline constexpr double kFocal_px = 300, kWall_m = 3, kBaseline_m = 0.12;

inline double noise(int x, int y) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x9E3779B1u + static_cast<std::uint32_t>(y) * 0x85EBCA77u;
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return (h ^ (h >> 15)) / 4294967296.0;
}

inline double texture(double x, double y, double size) {
  const double u = x / size, v = y / size;
  const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
  const double a = u - i, b = v - j;
  return (1 - b) * ((1 - a) * noise(i, j) + a * noise(i + 1, j)) +
         b * ((1 - a) * noise(i, j + 1) + a * noise(i + 1, j + 1));
}

/// The image of a camera that is `camera_m` to the right of the start.
inline std::vector<std::uint8_t> render_wall(double camera_m) {
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double on_wall_px = x + camera_m * kFocal_px / kWall_m;
      const double level = 0.6 * texture(on_wall_px, y, 13) + 0.4 * texture(on_wall_px, y, 5);
      pixels[static_cast<std::size_t>(y * kWidth + x)] = static_cast<std::uint8_t>(20 + 215 * level);
    }
  }
  return pixels;
}

inline spartan::Camera camera(const char* name) {
  spartan::Camera camera;
  camera.name = name;
  camera.size = {kWidth, kHeight};
  camera.model = spartan::PinholeModel{kFocal_px, kFocal_px, 0.5 * (kWidth - 1), 0.5 * (kHeight - 1)};
  return camera;
}

inline spartan::Rig wall_rig() {
  return spartan::rig_of_one_pair("front", camera("left"), camera("right"),
                                  spartan::Pose::from_translation({-kBaseline_m, 0, 0}));
}
