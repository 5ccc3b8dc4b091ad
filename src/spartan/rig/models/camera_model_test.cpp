#include "spartan/rig/models/camera_model.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <string>
#include <vector>

#include "spartan/testing/camera_model_laws.h"

namespace spartan {
namespace {

constexpr ImageSize kSize{752, 480};
const PinholeModel kPinhole{458.654, 457.296, 367.215, 248.375};

// Almost none, EuRoC's, strong barrel, pincushion, with k3, and the rational form.
const std::vector<RadialTangentialModel::Coefficients> kLenses{
    {1e-9, 0, 0, 0},
    {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05},
    {-0.25, 0.08, 0.001, -0.002, -0.005},
    {0.15, 0.02, -0.001, 0.0005},
    {0.1, -0.2, 0.0004, -0.0007, 0.05},
    {0.3, 0.1, 0.0005, -0.0003, 0.01, 0.5, 0.15, 0.02},
};

CameraModel lens(std::size_t i) {
  return RadialTangentialModel(kPinhole, kLenses[i]);
}

TEST(Pinhole, SatisfiesTheModelLaws) {
  testing::expect_round_trips(kPinhole, kSize);
  testing::expect_true_jacobians(kPinhole, kSize);
  testing::expect_defined_limits(kPinhole);
}

TEST(RadialTangential, SatisfiesTheModelLaws) {
  for (std::size_t i = 0; i < kLenses.size(); ++i) {
    SCOPED_TRACE(i);
    testing::expect_round_trips(lens(i), kSize);
    testing::expect_true_jacobians(lens(i), kSize);
    testing::expect_defined_limits(lens(i));
  }
}

TEST(RadialTangential, ProjectsAsOpenCv) {
  const cv::Matx33d k(kPinhole.fx, 0, kPinhole.cx, 0, kPinhole.fy, kPinhole.cy, 0, 0, 1);
  for (std::size_t i = 0; i < kLenses.size(); ++i) {
    const std::vector<double> d(kLenses[i].begin(), kLenses[i].end());
    for (const Eigen::Vector2d& pixel : testing::image_grid(kSize, 8)) {
      const Eigen::Vector3d point = 2.5 * unproject(lens(i), pixel)->direction;
      std::vector<cv::Point2d> seen;
      cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(), cv::Vec3d(), k, d,
                        seen);
      const Eigen::Vector2d ours = *project(lens(i), point);
      EXPECT_LE(std::hypot(ours.x() - seen[0].x, ours.y() - seen[0].y), 1e-9) << "lens " << i;
    }
  }
}

// Beyond the radius where the map stops increasing a pixel would have two rays: the domain ends there.
TEST(RadialTangential, DomainEndsWhereTheMapStopsIncreasing) {
  const RadialTangentialModel barrel(kPinhole, {-0.3, 0, 0, 0});
  // d(r − 0.3 r³)/dr = 0 at r = 1/√0.9
  EXPECT_NEAR(barrel.largest_radius(), 1 / std::sqrt(0.9), 1e-9);
  EXPECT_TRUE(barrel.project({1.05, 0, 1}));
  EXPECT_FALSE(barrel.project({1.06, 0, 1}));
  const double farthest = 1 / std::sqrt(0.9) * (1 - 0.3 / 0.9);
  EXPECT_TRUE(barrel.unproject({kPinhole.cx + 0.999 * farthest * kPinhole.fx, kPinhole.cy}));
  EXPECT_FALSE(barrel.unproject({kPinhole.cx + 1.001 * farthest * kPinhole.fx, kPinhole.cy}));
}

// A narrow lens, a fisheye with more than 180°, and one whose map folds back inside the image.
TEST(Equidistant, SatisfiesTheModelLaws) {
  const std::vector<std::pair<EquidistantModel::Coefficients, double>> lenses{
      {{0, 0, 0, 0}, 0.33}, {{-0.013, 0.032, -0.024, 0.006}, 1}, {{0.05, 0.01, 0.002, 1e-4}, 1}};
  for (const auto& [k, share] : lenses) {
    const EquidistantModel model({190.9, 190.2, 367.2, 248.4}, k);
    testing::expect_round_trips(model, kSize);
    testing::expect_true_jacobians(model, kSize);
    testing::expect_defined_limits(model, true);
    EXPECT_GE(testing::expect_consistent_answers(model, kSize), share);
  }
}

TEST(Equidistant, DomainEndsWhereTheMapStopsIncreasing) {
  const PinholeModel pinhole{200, 200, 376, 240};
  // d(θ − 0.2 θ³)/dθ = 0 at θ = 1/√0.6
  const EquidistantModel folds(pinhole, {-0.2, 0, 0, 0});
  EXPECT_NEAR(folds.largest_angle(), 1 / std::sqrt(0.6), 1e-12);
  const auto at = [](double angle) { return Eigen::Vector3d(std::sin(angle), 0, std::cos(angle)); };
  EXPECT_TRUE(folds.project(at(1.29)));
  EXPECT_FALSE(folds.project(at(1.30)));
  const double farthest = 200 / std::sqrt(0.6) * (1 - 0.2 / 0.6);
  EXPECT_TRUE(folds.unproject({376 + 0.999 * farthest, 240}));
  EXPECT_FALSE(folds.unproject({376 + 1.001 * farthest, 240}));
  // Without coefficients every direction but the one straight behind projects.
  const EquidistantModel whole(pinhole, {});
  EXPECT_NEAR(whole.project(at(3.0))->x(), 376 + 200 * 3.0, 1e-9);
  EXPECT_FALSE(whole.unproject({376 + 200 * 3.15, 240}));
  EXPECT_FALSE(whole.project({0, 0, -1}));
}

// Published parameters (ξ, α) of wide-angle lenses, the special cases ξ = 0 and α = 0, and one with |ξ| > 1.
const std::vector<DoubleSphereModel> kSpheres{
    {{313.0, 313.5, 367.2, 248.4}, -0.18, 0.59}, {{190.0, 190.5, 367.2, 248.4}, -0.27, 0.55},
    {{400.0, 401.0, 367.2, 248.4}, 0, 0},        {{300.0, 301.0, 367.2, 248.4}, 0.6, 0.3},
    {{600.0, 601.0, 367.2, 248.4}, 1.4, 0.2},    {{300.0, 301.0, 367.2, 248.4}, 0.1, 1},
};

TEST(DoubleSphere, SatisfiesTheModelLaws) {
  const std::vector<double> shares{0.5, 0.33, 1, 1, 0.29, 0.08};
  ASSERT_EQ(shares.size(), kSpheres.size());
  for (std::size_t i = 0; i < kSpheres.size(); ++i) {
    const DoubleSphereModel& model = kSpheres[i];
    SCOPED_TRACE(model.xi);
    EXPECT_GE(testing::expect_consistent_answers(model, kSize), shares[i]);
    if (model.alpha == 1) continue;  // the image corners are outside of the domain
    testing::expect_round_trips(model, kSize);
    testing::expect_true_jacobians(model, kSize);
    testing::expect_defined_limits(model, model.alpha > 0 || model.xi > 0);
  }
}

// ξ = α = 0: the pinhole. ξ = 0: the unified camera model x/(α d + (1 − α) z) in closed form.
TEST(DoubleSphere, ContainsTheSimplerModels) {
  for (const Eigen::Vector2d& pixel : testing::image_grid(kSize, 8)) {
    const Eigen::Vector3d p = 2 * kPinhole.unproject(pixel)->direction;
    EXPECT_LE((*DoubleSphereModel{kPinhole, 0, 0}.project(p) - pixel).norm(), 1e-10);
    const double alpha = 0.4, denominator = alpha * p.norm() + (1 - alpha) * p.z();
    const Eigen::Vector2d unified(kPinhole.fx * p.x() / denominator + kPinhole.cx,
                                  kPinhole.fy * p.y() / denominator + kPinhole.cy);
    EXPECT_LE((*DoubleSphereModel{kPinhole, 0, alpha}.project(p) - unified).norm(), 1e-10);
  }
}

// The end of the domain equals the angle at which the image radius stops increasing, found by stepping outwards.
TEST(DoubleSphere, DomainEndsWhereTheMapStopsIncreasing) {
  for (const DoubleSphereModel& model : kSpheres) {
    const auto radius = [&](double angle) {
      const double d2 = std::sqrt(1 + 2 * model.xi * std::cos(angle) + model.xi * model.xi);
      const double denominator = model.alpha * d2 + (1 - model.alpha) * (model.xi + std::cos(angle));
      return denominator > 0 ? std::sin(angle) / denominator : std::numeric_limits<double>::infinity();
    };
    double end = 0;
    while (end < 3.14 && radius(end + 1e-4) > radius(end) && std::isfinite(radius(end + 1e-4))) end += 1e-4;
    const auto seen = [&](double angle) { return model.project({std::sin(angle), 0, std::cos(angle)}).has_value(); };
    EXPECT_TRUE(seen(end - 1e-3)) << model.xi << " " << model.alpha;
    EXPECT_EQ(seen(end + 1e-3), end >= 3.1399) << model.xi << " " << model.alpha;
  }
}

TEST(Cahv, SatisfiesTheModelLaws) {
  const CahvModel model{kPinhole, 0.37};
  testing::expect_round_trips(model, kSize);
  testing::expect_true_jacobians(model, kSize);
  testing::expect_defined_limits(model);
  // u = P·H/P·A, v = P·V/P·A, computed with the vectors.
  const Eigen::Vector3d p(0.3, -0.2, 1.7);
  EXPECT_LE((*model.project(p) - Eigen::Vector2d(p.dot(model.h()), p.dot(model.v())) / p.z()).norm(), 1e-12);
}

const Eigen::Vector3d kOpticalAxis = Eigen::Vector3d(0.013, -0.021, 1).normalized();

TEST(Cahvor, SatisfiesTheModelLaws) {
  for (const CahvorModel::Radial& radial :
       {CahvorModel::Radial{0, 0, 0}, {1e-3, -0.12, 0.04}, {-4e-4, 0.2, 0.05}, {0, -0.3, 0.11}}) {
    const CahvorModel model({kPinhole, -0.2}, kOpticalAxis, radial);
    testing::expect_round_trips(model, kSize);
    testing::expect_true_jacobians(model, kSize);
    testing::expect_defined_limits(model);
    EXPECT_EQ(testing::expect_consistent_answers(model, kSize), 1);
  }
  // √τ (1 − 0.3 τ) increases up to √τ = 1/√0.9.
  EXPECT_NEAR(CahvorModel({kPinhole, 0}, kOpticalAxis, {0, -0.3, 0}).largest_radius(), 1 / std::sqrt(0.9), 1e-9);
}

TEST(Cahvore, SatisfiesTheModelLaws) {
  const CahvModel wide{{230.5, 231.0, 367.2, 248.4}, 0.1};
  const std::vector<std::pair<double, double>> linearities{{1.0, 1}, {0.8, 1}, {0.37, 1}, {0.0, 0.6}, {-0.3, 0.39}};
  for (const auto& [linearity, share] : linearities) {
    SCOPED_TRACE(linearity);
    const CahvoreModel model(wide, kOpticalAxis, {5e-4, -0.03, 0.006}, {0.004, 0.002, -3e-4}, linearity);
    testing::expect_round_trips(model, kSize, 1e-9, 0.02);
    EXPECT_GE(testing::expect_consistent_answers(model, kSize), share);
    testing::expect_true_jacobians(model, kSize);
    testing::expect_defined_limits(model, linearity < 1);
  }
  // On the axis and very close to it.
  const CahvoreModel model(wide, kOpticalAxis, {5e-4, -0.03, 0.006}, {0.004, 0.002, -3e-4}, 0.2);
  for (const double off : {0.0, 1e-12, 1e-8, 1e-5}) {
    const Eigen::Vector3d point = 1.5 * kOpticalAxis + off * kOpticalAxis.unitOrthogonal();
    const auto analytic = model.project_with_jacobian(point);
    ASSERT_TRUE(analytic);
    const Eigen::Matrix<double, 2, 3> numeric =
        testing::numeric_jacobian<2, 3>([&](const Eigen::Vector3d& p) { return *model.project(p); }, point, 1e-4);
    EXPECT_LE((analytic->by_point - numeric).norm(), 1e-6 * numeric.norm()) << off;
  }
}

// The entrance pupil moves: rays do not intersect in one point. Only near points reveal it.
TEST(Cahvore, IsNotCentral) {
  const CahvoreModel model({{230.5, 231.0, 367.2, 248.4}, 0}, Eigen::Vector3d::UnitZ(), {0, 0, 0}, {0.01, 0, 0}, 0);
  const auto ray = model.unproject({367.2 + 230.5 * 1.2, 248.4});
  ASSERT_TRUE(ray);
  EXPECT_NEAR(ray->origin.z(), (1.2 / std::sin(1.2) - 1) * 0.01, 1e-12);
  EXPECT_NEAR(std::atan2(ray->direction.x(), ray->direction.z()), 1.2, 1e-12);
}

// Near the pupil several rays pass through one point, so its pixel is ambiguous.
TEST(Cahvore, ProjectsNothingWhereRaysIntersect) {
  const CahvModel wide{{230.5, 231.0, 367.2, 248.4}, 0.1};
  const CahvoreModel model(wide, kOpticalAxis, {5e-4, -0.03, 0.006}, {0.004, 0.002, -3e-4}, 0);
  EXPECT_GT(model.nearest_m(), 0.005);
  EXPECT_LT(model.nearest_m(), 0.02);
  // Every ray of a fine grid at every depth projects to its own pixel or not at all.
  int none = 0, own = 0;
  for (const Eigen::Vector2d& pixel : testing::image_grid(kSize, 40)) {
    const auto ray = model.unproject(pixel);
    ASSERT_TRUE(ray);
    for (double depth = 1e-4; depth < 0.03; depth *= 1.1) {
      const auto back = model.project(ray->origin + depth * ray->direction);
      (back ? own : none) += 1;
      if (back) {
        EXPECT_LE((*back - pixel).norm(), 1e-9) << pixel.transpose() << " at " << depth << " m";
      }
    }
  }
  EXPECT_GT(own, none / 10);
  // θ/sin θ diverges: rays far behind the camera must not exclude near points for all other rays.
  const CahvoreModel plain(wide, kOpticalAxis, {0, 0, 0}, {0.004, 0, 0}, 0);
  EXPECT_LT(plain.nearest_m(), 0.03);
  EXPECT_GT(plain.largest_angle(), 2.5);
  EXPECT_TRUE(plain.project(0.03 * kOpticalAxis));
  // If the pupil moves backwards, neighbouring rays diverge.
  EXPECT_EQ(CahvoreModel(wide, kOpticalAxis, {0, 0, 0}, {-0.004, 0, 0}, 1).nearest_m(), 0);
}

// L = 1 with a fixed pupil is CAHVOR; L = 0 with a fixed pupil and μ = 0 is equidistant.
TEST(Cahvore, ContainsTheSimplerModels) {
  const CahvorModel::Radial radial{1e-3, -0.12, 0.04};
  const CahvoreModel perspective({kPinhole, 0}, kOpticalAxis, radial, {0, 0, 0}, 1);
  const CahvorModel cahvor({kPinhole, 0}, kOpticalAxis, radial);
  const PinholeModel wide{230.5, 230.5, 367.2, 248.4};
  const CahvoreModel fisheye({wide, 0}, Eigen::Vector3d::UnitZ(), {0, 0, 0}, {0, 0, 0}, 0);
  const EquidistantModel equidistant(wide, {});
  for (const Eigen::Vector2d& pixel : testing::image_grid(kSize, 8)) {
    const Eigen::Vector3d p = 2 * cahvor.unproject(pixel)->direction;
    EXPECT_LE((*perspective.project(p) - pixel).norm(), 1e-9);
    const auto seen = fisheye.unproject(pixel);
    ASSERT_TRUE(seen) << pixel.transpose();
    EXPECT_LE((*equidistant.project(seen->direction) - pixel).norm(), 1e-9);
  }
}

TEST(CameraModel, IsFoundByItsName) {
  EXPECT_EQ(camera_model_names(), (std::vector<std::string_view>{"pinhole", "radial_tangential", "equidistant",
                                                                 "double_sphere", "cahv", "cahvor", "cahvore"}));
  EXPECT_FALSE(camera_model_named("fisheye"));
  for (const std::string_view name : camera_model_names()) EXPECT_EQ(name_of(*camera_model_named(name)), name);
}

TEST(CameraModel, ParametersRoundTrip) {
  for (std::size_t i = 0; i < kLenses.size(); ++i) {
    EXPECT_EQ(with_parameters(*camera_model_named("radial_tangential"), parameters(lens(i))), lens(i)) << i;
  }
  EXPECT_EQ(with_parameters(PinholeModel{}, parameters(CameraModel(kPinhole))), CameraModel(kPinhole));
  // Trailing zeros are omitted.
  EXPECT_EQ(parameters(lens(1))[2].size(), 4u);
  EXPECT_EQ(parameters(lens(2))[2].size(), 5u);
  EXPECT_EQ(parameters(lens(5))[2].size(), 8u);
}

}  // namespace
}  // namespace spartan
