// End-to-end test of imaging for every pair of camera models: a wall rendered with both models appears in the rectified
// views as two pinhole cameras would see it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "spartan/imaging/imager.h"
#include "spartan/rig/rig.h"

namespace spartan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr ImageSize kSize{160, 120};
constexpr double kDepth_m = 0.7, kBaseline_m = 0.1;

struct NamedModel {
  std::string name;
  CameraModel model;
};

// The corners are 100 px from the centre, where the three fisheye models see beyond 90° from the axis. The entrance
// pupil of the last model moves by up to 6 cm.
const std::vector<NamedModel> kModels{
    {"pinhole", PinholeModel{125, 124, 81, 58}},
    {"radial_tangential", RadialTangentialModel({125, 126, 82, 57}, {-0.25, 0.06, 2e-4, 3e-5})},
    {"equidistant", EquidistantModel({58, 58.2, 78, 61}, {0.01, 0.002, 0, 0})},
    {"double_sphere", DoubleSphereModel{{45, 45.1, 80.5, 59}, -0.25, 0.58}},
    {"cahv", CahvModel{{130, 128, 77, 62}, 0.3}},
    {"cahvor", CahvorModel({{120, 121, 80, 60}, 0}, Vector3d(0.01, -0.02, 1).normalized(), {1e-4, -0.2, 0.05})},
    {"cahvore",
     CahvoreModel({{60, 60.3, 80, 58}, 0}, Vector3d(-0.01, 0.01, 1).normalized(), {0, 0.01, 0}, {0.06, 0.01, 0}, 0)},
};

Camera camera_with(const std::string& name, const CameraModel& model) {
  Camera camera;
  camera.name = name;
  camera.size = kSize;
  camera.model = model;
  return camera;
}

// A wall perpendicular to the optical axis of the left rectified view. Its texture is a function of direction, so that
// distant parts are as smooth as the centre.
struct Wall {
  Pose rectified_from_body;
  double depth_m;

  static double level_towards(const Vector3d& direction) {
    const Vector3d n = direction.normalized();
    return 128 + 60 * std::sin(6 * n.x() + 1) + 50 * std::cos(5 * n.y());
  }

  /// The gray level at a pixel; mid gray where it does not see the wall.
  double level_at(const Camera& camera, const Pose& body_from_camera, const Vector2d& pixel) const {
    const auto ray = unproject(camera.model, pixel);
    if (!ray) return 128;
    const Pose rectified_from_camera = rectified_from_body * body_from_camera;
    const Vector3d origin = rectified_from_camera * ray->origin;
    const Vector3d direction = rectified_from_camera.rotation() * ray->direction;
    if (direction.z() <= 0) return 128;
    return level_towards(origin + (depth_m - origin.z()) / direction.z() * direction);
  }

  FrameImage render(const Camera& camera, const Pose& body_from_camera) const {
    Image<std::uint16_t> image(camera.size);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        image(x, y) = static_cast<std::uint16_t>(std::lround(200 * level_at(camera, body_from_camera, Vector2d(x, y))));
      }
    }
    return FrameImage::own(std::move(image), camera.pixel_format);
  }
};

struct Outcome {
  double largest_error = 0;  ///< gray levels
  int compared = 0, masked = 0;
};

Outcome compare(ImageView<const std::uint8_t> seen, ImageView<const std::uint8_t> mask, const RectifiedStereo& view,
                double camera_x_m, double depth_m) {
  Outcome outcome;
  for (int y = 0; y < seen.height(); ++y) {
    for (int x = 0; x < seen.width(); ++x) {
      if (!mask.empty() && mask(x, y) == 0) {
        ++outcome.masked;
        continue;
      }
      const Vector3d direction((x - view.centre_px.x()) / view.focal_px, (y - view.centre_px.y()) / view.focal_px, 1);
      const double expected = Wall::level_towards(Vector3d(camera_x_m, 0, 0) + depth_m * direction);
      outcome.largest_error = std::max(outcome.largest_error, std::abs(seen(x, y) - expected * 200 / 257));
      ++outcome.compared;
    }
  }
  return outcome;
}

/// Errors of both rectified images of a wall; nothing where the view is impossible.
std::optional<std::pair<Outcome, Outcome>> outcomes_of(const NamedModel& left, const NamedModel& right,
                                                       const ImagingOptions& options, double wall_depth_m) {
  Camera cameras[] = {camera_with("left", left.model), camera_with("right", right.model)};
  for (Camera& camera : cameras) camera.pixel_format = {PixelLayout::gray, 16};
  const Rig rig = rig_of_one_pair("test", cameras[0], cameras[1],
                                  Pose(exp_so3({0.02, -0.03, 0.04}), {kBaseline_m, 0, 0}).inverse());
  auto imager = Imager::create(rig, options, ThreadPool(2));
  if (!imager) return std::nullopt;
  StereoFrame frame;
  frame.pair = rig.pairs[0].name;
  const auto blank = FrameImage::own(Image<std::uint16_t>(kSize), cameras[0].pixel_format);
  frame.left = frame.right = blank;
  const Wall wall{imager->process(frame)->body_from_left.inverse(), wall_depth_m};
  frame.left = wall.render(cameras[0], rig.body_from_camera("left"));
  frame.right = wall.render(cameras[1], rig.body_from_camera("right"));
  const auto pair = imager->process(frame);
  EXPECT_TRUE(pair) << pair.error().message();
  return std::pair{compare(pair->left, pair->left_mask, pair->geometry, 0, wall_depth_m),
                   compare(pair->right, pair->right_mask, pair->geometry, kBaseline_m, wall_depth_m)};
}

ImagingOptions plain_options(ViewPolicy policy) {
  ImagingOptions options;
  options.contrast = options.gain_compensation = false;
  options.view.policy = policy;
  options.view.depth_m = kDepth_m;
  return options;
}

bool is_fisheye(const NamedModel& named) {
  return project(named.model, Vector3d(1, 0, -0.02)).has_value();
}

// Gray levels: rounding from 16 to 8 bits, of the table positions and of the interpolation.
constexpr double kTolerance = 1.2;

class AnyModel : public ::testing::TestWithParam<std::tuple<int, int>> {
 protected:
  const NamedModel& left() const { return kModels[std::size_t(std::get<0>(GetParam()))]; }
  const NamedModel& right() const { return kModels[std::size_t(std::get<1>(GetParam()))]; }
};

TEST_P(AnyModel, IsRectifiedToAPinhole) {
  for (const ViewPolicy policy : {ViewPolicy::keep_resolution, ViewPolicy::all_valid, ViewPolicy::whole_view}) {
    SCOPED_TRACE(name_of(policy));
    const auto outcomes = outcomes_of(left(), right(), plain_options(policy), kDepth_m);
    const bool no_plane_shows_it = policy == ViewPolicy::whole_view && (is_fisheye(left()) || is_fisheye(right()));
    ASSERT_EQ(outcomes.has_value(), !no_plane_shows_it);
    if (!outcomes) continue;
    for (const Outcome& camera : {outcomes->first, outcomes->second}) {
      EXPECT_LT(camera.largest_error, kTolerance);
      EXPECT_GT(camera.compared, 0.45 * kSize.width * kSize.height);
      EXPECT_TRUE(camera.masked == 0 || policy != ViewPolicy::all_valid);
    }
  }
}

std::string pair_name(const ::testing::TestParamInfo<std::tuple<int, int>>& tested) {
  const auto [left, right] = tested.param;
  return kModels[std::size_t(left)].name + "_and_" + kModels[std::size_t(right)].name;
}

const auto kEveryModel = ::testing::Range(0, int(kModels.size()));
INSTANTIATE_TEST_SUITE_P(Pairs, AnyModel, ::testing::Combine(kEveryModel, kEveryModel), pair_name);

// The view of a non-central camera is exact at one depth only.
TEST(NonCentralCamera, ViewIsExactAtTheGivenDepth) {
  const NamedModel& cahvore = kModels.back();
  ImagingOptions options = plain_options(ViewPolicy::keep_resolution);
  const auto error = [&](double wall_depth_m) {
    const auto outcomes = outcomes_of(cahvore, cahvore, options, wall_depth_m);
    EXPECT_TRUE(outcomes);
    return outcomes ? outcomes->first.largest_error : 0;
  };
  EXPECT_LT(error(kDepth_m), kTolerance);
  EXPECT_GT(error(kDepth_m / 4), 2 * kTolerance);
  options.view.depth_m = 0;  // far away
  EXPECT_LT(error(1e4), kTolerance);
  EXPECT_GT(error(kDepth_m / 4), 2 * kTolerance);
}

// Where one edge of the image is beyond 90° and the other one near it, the view stays centred.
TEST(Fisheye, ViewIsCentredOnTheImage) {
  for (const Vector2d& centre : {Vector2d(79.5, 59.5), Vector2d(74, 63), Vector2d(88, 54)}) {
    const Camera left = camera_with("left", EquidistantModel({58, 58, centre.x(), centre.y()}, {}));
    const Camera right = camera_with("right", left.model);
    const Rig rig = rig_of_one_pair("test", left, right, Pose(Eigen::Quaterniond::Identity(), {0.1, 0, 0}).inverse());
    const auto imager = Imager::create(rig, plain_options(ViewPolicy::keep_resolution), ThreadPool(1));
    ASSERT_TRUE(imager);
    const RectifiedStereo view = imager->geometry(rig.pairs[0].name);
    EXPECT_LT((view.centre_px - Vector2d(79.5, 59.5)).norm(), 1.5 * (centre - Vector2d(79.5, 59.5)).norm() + 1e-6)
        << view.centre_px.transpose();
  }
}

}  // namespace
}  // namespace spartan
