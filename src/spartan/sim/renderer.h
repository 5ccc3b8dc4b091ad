// What a camera sees of the ground: light on its way to the sensor, and the true depth.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/ground_scene.h"
#include "spartan/sim/light.h"
#include "spartan/sim/sky_light.h"
#include "spartan/sim/soil.h"

namespace spartan::sim {

/// Everything that light meets at one place of a drive; all borrowed.
struct Surroundings {
  const GroundScene& scene;
  const SkyLight& sky;
  const Sun& sun;
  const Soil& soil;
  double sky_lux = 0;
};

/// What a sample shows; each has a colour of its own.
enum class Material : std::uint8_t { soil, rock, sky };
inline constexpr int kMaterials = 3;

/// Luminance in cd/m², split by what it comes from where colour is asked for, else all in the first.
struct Radiance {
  std::array<Image<float>, kMaterials> by_material;
  bool split = false;
  float total(int x, int y) const {
    return split ? by_material[0](x, y) + by_material[1](x, y) + by_material[2](x, y) : by_material[0](x, y);
  }
};

/// How many rays a pixel gets: `side` × `side` on a fixed grid (nothing random), or every other one of them.
struct Sampling {
  int side = 2;
  bool every_other = false;
  int per_pixel() const { return every_other ? side * side / 2 : side * side; }
  /// 1, 2, 4, 9 or 16 a pixel.
  static Sampling of(int per_pixel);
};

/// Renders the images of one camera. The rays' finer picture is filtered with a Gaussian of kPointSpread_px: that is
/// the point spread of optics and pixel together, as a slanted edge shows it.
class Renderer {
 public:
  static constexpr double kPointSpread_px = 0.5;  ///< standard deviation
  static constexpr int kTimes = 4;                ///< poses across an exposure

  Renderer(const Camera& camera, const Sampling& sampling);

  /// The camera's poses at the middle of each quarter of the exposure: rays take turns at them. Where the camera
  /// stands still all are the same.
  using Poses = std::array<Pose, kTimes>;
  Radiance render(const Surroundings& surroundings, const Poses& world_from_camera, bool split_materials,
                  const Workers& workers) const;
  /// Mean luminance over every `step`-th row, cheaply: what an exposure meter sees.
  double metered(const Surroundings& surroundings, const Pose& world_from_camera, int step) const;

  /// Rays of one picture.
  std::int64_t rays() const;
  const Camera& camera() const { return camera_; }

 private:
  struct Row;
  void shade_row(const Surroundings& s, std::span<const Pose> poses, int row, Row& out) const;
  Image<float> filtered(const Image<float>& fine, const Workers& workers) const;

  Camera camera_;
  Sampling sampling_;
  int border_ = 0;                           // rays around the picture that the point spread reaches
  int width_ = 0, height_ = 0;               // of the finer picture, border included
  std::vector<Eigen::Vector3f> directions_;  // camera frame, row by row
  double radians_per_ray_ = 0;
};

/// Distance along the optical axis at pixels' centres, metres; NaN where there is only sky.
Image<float> render_depth(const Camera& camera, const GroundScene& scene, const Pose& world_from_camera,
                          const Workers& workers);

}  // namespace spartan::sim
