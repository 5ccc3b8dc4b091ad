// Comparison of the camera models with OpenCV (fisheye, omnidir) and mrcal (CAHVOR, CAHVORE).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/ccalib/omnidir.hpp>
#include <string>
#include <vector>

#include "spartan/rig/models/camera_model.h"
#include "spartan/testing/camera_model_laws.h"
#ifdef SPARTAN_HAS_MRCAL
#include "spartan/testing/mrcal_oracle.h"
#endif

namespace spartan {
namespace {

constexpr ImageSize kOracleSize{1024, 768};
const PinholeModel kCore{400.5, 398.25, 517.3, 379.1};

cv::Matx33d matrix_of(const PinholeModel& p) {
  return {p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1};
}
std::vector<cv::Point3d> as_cv(const Eigen::Vector3d& p) {
  return {{p.x(), p.y(), p.z()}};
}

TEST(Equidistant, ProjectsAsOpenCv) {
  for (const EquidistantModel::Coefficients& k :
       {EquidistantModel::Coefficients{0, 0, 0, 0}, {-0.012, 0.031, -0.024, 0.006}, {0.05, 0.01, 0, 0}}) {
    const EquidistantModel model(kCore, k);
    int compared = 0;
    for (const Eigen::Vector2d& pixel : testing::image_grid(kOracleSize, 24)) {
      const auto ray = model.unproject(pixel);
      ASSERT_TRUE(ray);
      if (ray->direction.z() < 0.01) continue;  // OpenCV divides by z
      std::vector<cv::Point2d> seen;
      cv::fisheye::projectPoints(as_cv(3 * ray->direction), seen, cv::Vec3d(), cv::Vec3d(), matrix_of(kCore),
                                 cv::Vec4d(k[0], k[1], k[2], k[3]));
      EXPECT_LE(std::hypot(pixel.x() - seen[0].x, pixel.y() - seen[0].y), 1e-9) << pixel.transpose();
      ++compared;
    }
    EXPECT_GT(compared, 500);
  }
}

// α = 0 is Mei's unified model, OpenCV's omnidir.
TEST(DoubleSphere, WithoutAlphaProjectsAsOmnidirOfOpenCv) {
  for (const double xi : {0.0, 0.4, 0.9}) {
    const DoubleSphereModel model{kCore, xi, 0};
    for (const Eigen::Vector2d& pixel : testing::image_grid(kOracleSize, 24)) {
      const auto ray = model.unproject(pixel);
      ASSERT_TRUE(ray);
      std::vector<cv::Point2d> seen;
      cv::omnidir::projectPoints(as_cv(3 * ray->direction), seen, cv::Vec3d(), cv::Vec3d(), matrix_of(kCore), xi,
                                 cv::Vec4d());
      EXPECT_LE(std::hypot(pixel.x() - seen[0].x, pixel.y() - seen[0].y), 1e-9) << pixel.transpose();
    }
  }
}

#ifdef SPARTAN_HAS_MRCAL

TEST(Cahvor, ProjectsAsMrcal) {
  for (const double tilt : {0.0, 0.02}) {
    const Eigen::Vector3d o = Eigen::Vector3d(tilt, -0.6 * tilt, 1).normalized();
    const CahvorModel model({kCore, 0}, o, {0.002, -0.11, 0.03});
    const testing::MrcalModel oracle(
        "LENSMODEL_CAHVOR",
        {kCore.fx, kCore.fy, kCore.cx, kCore.cy, std::atan2(o.x(), o.z()), std::asin(o.y()), 0.002, -0.11, 0.03});
    for (const Eigen::Vector2d& pixel : testing::image_grid(kOracleSize, 24)) {
      const auto ray = model.unproject(pixel);
      ASSERT_TRUE(ray) << pixel.transpose();
      EXPECT_LE((oracle.project(3 * ray->direction) - pixel).norm(), 1e-9) << pixel.transpose();
    }
  }
}

TEST(Cahvore, ProjectsAsMrcal) {
  const Eigen::Vector3d o = Eigen::Vector3d(0.01, -0.005, 1).normalized();
  for (const double linearity : {1.0, 0.37, 0.0, -0.4}) {
    const CahvoreModel model({kCore, 0}, o, {0.001, -0.02, 0.004}, {0.006, 0.002, -0.0005}, linearity);
    const testing::MrcalModel oracle("LENSMODEL_CAHVORE_linearity=" + std::to_string(linearity),
                                     {kCore.fx, kCore.fy, kCore.cx, kCore.cy, std::atan2(o.x(), o.z()),
                                      std::asin(o.y()), 0.001, -0.02, 0.004, 0.006, 0.002, -0.0005});
    for (const Eigen::Vector2d& pixel : testing::image_grid(kOracleSize, 24)) {
      const auto ray = model.unproject(pixel);
      ASSERT_TRUE(ray) << pixel.transpose() << " linearity " << linearity;
      // mrcal normalizes every point to the distance 1 from C before it projects, so only such points can be compared.
      const double along = ray->origin.dot(ray->direction);
      const double range = std::sqrt(along * along - ray->origin.squaredNorm() + 1) - along;
      EXPECT_LE((oracle.project(ray->origin + range * ray->direction) - pixel).norm(), 1e-9)
          << pixel.transpose() << " linearity " << linearity;
    }
  }
}

#endif

}  // namespace
}  // namespace spartan
