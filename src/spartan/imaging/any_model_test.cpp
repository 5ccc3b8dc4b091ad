// Every pair of camera models from one end of imaging to the other: a wall drawn into both eyes by their models comes
// out of the rectified view where two pinholes would see it.
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

// A hundred pixels lie between the middle and a corner: the three fisheyes see more than 90° to the side there. The
// pupil of the last one moves by up to 6 cm.
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

// A wall across the left rectified view's axis, painted by the direction to its points, so that its far parts are as
// smooth as its middle.
struct Wall {
  Pose rectified_from_body;
  double depth_m;

  static double level_towards(const Vector3d& direction) {
    const Vector3d n = direction.normalized();
    return 128 + 60 * std::sin(6 * n.x() + 1) + 50 * std::cos(5 * n.y());
  }

  /// What a pixel sees; mid gray where it does not see the wall.
  double level_at(const Camera& camera, const Pose& body_from_camera, const Vector2d& pixel) const {
    const auto ray = unproject(camera.model, pixel);
    if (!ray) return 128;
    const Pose rectified_from_camera = rectified_from_body * body_from_camera;
    const Vector3d origin = rectified_from_camera * ray->origin;
    const Vector3d direction = rectified_from_camera.rotation() * ray->direction;
    if (direction.z() <= 0) return 128;
    return level_towards(origin + (depth_m - origin.z()) / direction.z() * direction);
  }

  FrameImage picture(const Camera& camera, const Pose& body_from_camera) const {
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
                double eye_x_m, double depth_m) {
  Outcome outcome;
  for (int y = 0; y < seen.height(); ++y) {
    for (int x = 0; x < seen.width(); ++x) {
      if (!mask.empty() && mask(x, y) == 0) {
        ++outcome.masked;
        continue;
      }
      const Vector3d direction((x - view.centre_px.x()) / view.focal_px, (y - view.centre_px.y()) / view.focal_px, 1);
      const double expected = Wall::level_towards(Vector3d(eye_x_m, 0, 0) + depth_m * direction);
      outcome.largest_error = std::max(outcome.largest_error, std::abs(seen(x, y) - expected * 200 / 257));
      ++outcome.compared;
    }
  }
  return outcome;
}

/// Both eyes' pictures of a wall through the imager; nothing where there is no such view.
std::optional<std::pair<Outcome, Outcome>> outcomes_of(const NamedModel& left, const NamedModel& right,
                                                       const ImagingOptions& options, double wall_depth_m) {
  Camera eyes[] = {camera_with("left", left.model), camera_with("right", right.model)};
  for (Camera& eye : eyes) eye.pixel_format = {PixelLayout::gray, 16};
  const Rig rig =
      rig_of_one_pair("test", eyes[0], eyes[1], Pose(exp_so3({0.02, -0.03, 0.04}), {kBaseline_m, 0, 0}).inverse());
  auto imager = Imager::create(rig, options, Workers(2));
  if (!imager) return std::nullopt;
  StereoFrame frame;
  frame.pair = rig.pairs[0].name;
  const auto blank = FrameImage::own(Image<std::uint16_t>(kSize), eyes[0].pixel_format);
  frame.left = frame.right = blank;
  const Wall wall{imager->process(frame)->body_from_left.inverse(), wall_depth_m};
  frame.left = wall.picture(eyes[0], rig.body_from_camera("left"));
  frame.right = wall.picture(eyes[1], rig.body_from_camera("right"));
  const auto pair = imager->process(frame);
  EXPECT_TRUE(pair) << pair.error().message();
  return std::pair{compare(pair->left, pair->left_mask, pair->geometry, 0, wall_depth_m),
                   compare(pair->right, pair->right_mask, pair->geometry, kBaseline_m, wall_depth_m)};
}

ImagingOptions plain_options(const std::string& policy) {
  ImagingOptions options;
  options.contrast = options.balance = false;
  options.view.policy = policy;
  options.view.depth_m = kDepth_m;
  return options;
}

bool is_fisheye(const NamedModel& named) {
  return project(named.model, Vector3d(1, 0, -0.02)).has_value();
}

// Off by the rounding of 16 to 8 bits, of the places and of the interpolation between pixels.
constexpr double kTolerance = 1.2;

class AnyModel : public ::testing::TestWithParam<std::tuple<int, int>> {
 protected:
  const NamedModel& left() const { return kModels[std::size_t(std::get<0>(GetParam()))]; }
  const NamedModel& right() const { return kModels[std::size_t(std::get<1>(GetParam()))]; }
};

TEST_P(AnyModel, IsSeenAsByAPinhole) {
  for (const std::string policy : {"keep_resolution", "all_valid", "whole_view"}) {
    SCOPED_TRACE(policy);
    const auto outcomes = outcomes_of(left(), right(), plain_options(policy), kDepth_m);
    const bool no_plane_shows_it = policy == "whole_view" && (is_fisheye(left()) || is_fisheye(right()));
    ASSERT_EQ(outcomes.has_value(), !no_plane_shows_it);
    if (!outcomes) continue;
    for (const Outcome& eye : {outcomes->first, outcomes->second}) {
      EXPECT_LT(eye.largest_error, kTolerance);
      EXPECT_GT(eye.compared, 0.45 * kSize.width * kSize.height);
      EXPECT_TRUE(eye.masked == 0 || policy != "all_valid");
    }
  }
}

std::string pair_name(const ::testing::TestParamInfo<std::tuple<int, int>>& tested) {
  const auto [left, right] = tested.param;
  return kModels[std::size_t(left)].name + "_and_" + kModels[std::size_t(right)].name;
}

const auto kEveryModel = ::testing::Range(0, int(kModels.size()));
INSTANTIATE_TEST_SUITE_P(Pairs, AnyModel, ::testing::Combine(kEveryModel, kEveryModel), pair_name);

// Where the rays of a camera do not meet in one point, a view is right for one depth.
TEST(MovingPupil, TheViewIsRightForTheDepthItIsMadeFor) {
  const NamedModel& cahvore = kModels.back();
  ImagingOptions options = plain_options("keep_resolution");
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

// Where a side of the picture looks beyond all planes and the other one nearly, the view stays between the two.
TEST(Fisheye, TheViewStaysInTheMiddleOfThePicture) {
  for (const Vector2d& centre : {Vector2d(79.5, 59.5), Vector2d(74, 63), Vector2d(88, 54)}) {
    const Camera left = camera_with("left", EquidistantModel({58, 58, centre.x(), centre.y()}, {}));
    const Camera right = camera_with("right", left.model);
    const Rig rig = rig_of_one_pair("test", left, right, Pose(Eigen::Quaterniond::Identity(), {0.1, 0, 0}).inverse());
    const auto imager = Imager::create(rig, plain_options("keep_resolution"), Workers(1));
    ASSERT_TRUE(imager);
    const RectifiedStereo view = imager->geometry(rig.pairs[0].name);
    EXPECT_LT((view.centre_px - Vector2d(79.5, 59.5)).norm(), 1.5 * (centre - Vector2d(79.5, 59.5)).norm() + 1e-6)
        << view.centre_px.transpose();
  }
}

}  // namespace
}  // namespace spartan
