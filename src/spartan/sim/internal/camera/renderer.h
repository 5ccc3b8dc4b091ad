// Renders the luminance and the true depth that a camera sees.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/internal/camera/ground_scene.h"
#include "spartan/sim/internal/camera/light.h"
#include "spartan/sim/internal/camera/rover_body.h"
#include "spartan/sim/internal/camera/sky_light.h"
#include "spartan/sim/internal/world/soil.h"

namespace spartan::sim::internal {

/// Geometry, light and materials around one place of a drive. Borrowed.
struct LitScene {
  const GroundScene& scene;
  const SkyLight& sky;
  const Sun& sun;
  const Soil& soil;
  double sky_lux = 0;
};

/// Poses of a frame at kTimes times of the exposure: the middle of each quarter. Rays use them in turn, which gives
/// motion blur. All are equal where the frame is stationary.
inline constexpr int kTimes = 4;
using ExposurePoses = std::array<Pose, kTimes>;

/// Poses while a shutter runs over the rows of an image; both are equal where it opens for all rows at once.
struct ShutterPoses {
  ExposurePoses top, bottom;
  bool rolls = false;
  /// At a fraction of the image's height, interpolated.
  ExposurePoses at(double part) const;
};
/// The same for the middle of the exposure alone.
struct ShutterPose {
  Pose top, bottom;
  bool rolls = false;
  Pose at(double part) const;
};

/// What moves during an exposure: the camera, and the rover where it is visible.
struct Exposing {
  ShutterPoses world_from_camera;
  const RoverBody* rover = nullptr;  ///< borrowed; none: not visible
  ShutterPoses world_from_body;
};

/// A camera at rest that does not see the rover.
Exposing at_rest(const Pose& world_from_camera);

/// What a sample shows; each material has its own colour.
enum class Material : std::uint8_t { soil, rock, sky, rover };
inline constexpr int kMaterials = 4;

/// Luminance in cd/m²: one plane per material where colour is needed, else all in the first plane.
struct LuminanceImage {
  std::array<Image<float>, kMaterials> by_material;
  bool split = false;
  float total(int x, int y) const {
    float sum = by_material[0](x, y);
    for (std::size_t m = 1; split && m < kMaterials; ++m) sum += by_material[m](x, y);
    return sum;
  }
};

/// Rays per pixel: a fixed grid of `side` × `side` (no random offsets), or every other one of them in a checkerboard.
struct Sampling {
  int side = 2;
  bool every_other = false;
  int per_pixel() const { return every_other ? side * side / 2 : side * side; }
  /// For 1, 2, 4, 9 or 16 rays per pixel; throws std::invalid_argument otherwise.
  static Sampling of(int per_pixel);
};

/// Renders the images of one camera. The supersampled image is filtered with a Gaussian of kPointSpread_px, the point
/// spread function of optics and pixel together as a slanted edge shows it.
class Renderer {
 public:
  static constexpr double kPointSpread_px = 0.5;  ///< px; standard deviation

  Renderer(const Camera& camera, const Sampling& sampling);

  LuminanceImage render(const LitScene& scene, const Exposing& exposing, bool split_materials,
                        const ThreadPool& workers) const;
  /// The same, at_rest().
  LuminanceImage render(const LitScene& scene, const Pose& world_from_camera, bool split_materials,
                        const ThreadPool& workers) const;
  /// Mean luminance over every `step`-th row, as an exposure meter measures it.
  double mean_luminance(const LitScene& scene, const Exposing& exposing, int step) const;

  /// Number of rays of an image.
  std::int64_t rays() const;
  const Camera& camera() const { return camera_; }

 private:
  struct Row;
  struct RowPoses;
  RowPoses poses_of_row(const LitScene& s, const Exposing& exposing, int row) const;
  void shade_row(const LitScene& s, const Exposing& exposing, int row, Row& out) const;
  Image<float> filtered(const Image<float>& fine, const ThreadPool& workers) const;

  Camera camera_;
  Sampling sampling_;
  int border_ = 0;                           // rays around the image within reach of the point spread function
  int width_ = 0, height_ = 0;               // of the supersampled image, border included
  std::vector<Eigen::Vector3f> directions_;  // camera frame, row by row
  double radians_per_ray_ = 0;
};

/// Depth along the optical axis at pixel centres in metres; NaN for the sky.
Image<float> render_depth(const Camera& camera, const GroundScene& scene, const Pose& world_from_camera,
                          const ThreadPool& workers);

}  // namespace spartan::sim::internal
