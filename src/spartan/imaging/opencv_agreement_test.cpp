// Comparison of the rectification with OpenCV on real cameras.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/imaging/imager.h"
#include "spartan/imaging/internal/remap.h"
#include "spartan/testing/real_data.h"

namespace spartan {

using namespace internal;

namespace {

cv::Mat to_mat(const Eigen::Matrix3d& m) {
  cv::Mat result(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) result.at<double>(r, c) = m(r, c);
  }
  return result;
}

Eigen::Matrix3d to_eigen(const cv::Mat& m) {
  Eigen::Matrix3d result;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) result(r, c) = m.at<double>(r, c);
  }
  return result;
}

cv::Mat pinhole_matrix(double fx, double fy, double cx, double cy) {
  return (cv::Mat_<double>(3, 3) << fx, 0, cx, 0, fy, cy, 0, 0, 1);
}

struct OpenCvMaps {
  cv::Mat x, y;
};

// The maps of cv::initUndistortRectifyMap for the same camera, rotation and new camera matrix.
OpenCvMaps opencv_maps(const Camera& camera, const RectifiedStereo& view, const Eigen::Matrix3d& from_rectified) {
  const auto& model = std::get<RadialTangentialModel>(camera.model);
  const PinholeModel& p = model.pinhole();
  const cv::Mat distortion(1, 8, CV_64F, const_cast<double*>(model.coefficients().data()));
  OpenCvMaps maps;
  cv::initUndistortRectifyMap(pinhole_matrix(p.fx, p.fy, p.cx, p.cy), distortion, to_mat(from_rectified.transpose()),
                              pinhole_matrix(view.focal_px, view.focal_px, view.centre_px.x(), view.centre_px.y()),
                              {view.size.width, view.size.height}, CV_32FC1, maps.x, maps.y);
  return maps;
}

// Largest distance between RemapTable and the maps of OpenCV, over all valid pixels of the table.
double largest_map_difference(const Camera& camera, const RectifiedStereo& view,
                              const Eigen::Matrix3d& from_rectified) {
  const RemapTable table(camera.model, camera.size, view, from_rectified, {}, ThreadPool(2));
  const OpenCvMaps maps = opencv_maps(camera, view, from_rectified);
  double largest = 0;
  int valid = 0;
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      const Eigen::Vector2d theirs(maps.x.at<float>(y, x), maps.y.at<float>(y, x));
      const bool inside = theirs.x() >= 0.01 && theirs.y() >= 0.01 && theirs.x() <= camera.size.width - 1.01 &&
                          theirs.y() <= camera.size.height - 1.01;
      const bool ours_inside = table.mask().empty() || table.mask()(x, y) != 0;
      EXPECT_TRUE(ours_inside || !inside) << "a hole at " << x << ", " << y;
      if (!ours_inside) continue;
      ++valid;
      largest = std::max(largest, (table.source_of(x, y) - theirs).norm());
    }
  }
  EXPECT_GT(valid, view.size.width * view.size.height * 3 / 4);
  return largest;
}

void expect_maps_agree(const Rig& rig, const std::string& name) {
  const StereoPair& pair = rig.pairs.front();
  const Camera &left = *rig.find_camera(pair.left), &right = *rig.find_camera(pair.right);
  const auto plan = plan_rectification(left, right, rig.right_from_left(pair), name);
  ASSERT_TRUE(plan) << plan.error().message();
  const double left_px = largest_map_difference(left, plan->geometry, plan->left_from_rectified);
  const double right_px = largest_map_difference(right, plan->geometry, plan->right_from_rectified);
  fmt::print(
      "{}: largest difference from OpenCV's maps {:.4f} px left, {:.4f} px right; f {:.2f} px, centre {:.2f} "
      "{:.2f}, baseline {:.4f} m\n",
      name, left_px, right_px, plan->geometry.focal_px, plan->geometry.centre_px.x(), plan->geometry.centre_px.y(),
      plan->geometry.baseline_m);
  EXPECT_LE(left_px, 0.1);
  EXPECT_LE(right_px, 0.1);
}

TEST(AgreementWithOpenCv, EurocMaps) {
  const std::string folder = testing::data_folder() + "/euroc_v101/mav0";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no euroc_v101 in $SPARTAN_DATA";
  const auto rig = read_euroc_calib(folder);
  ASSERT_TRUE(rig) << rig.error().message();
  expect_maps_agree(*rig, "euroc_v101");
}

TEST(AgreementWithOpenCv, EurocImages) {
  const std::string folder = testing::data_folder() + "/euroc_v101/mav0";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no euroc_v101 in $SPARTAN_DATA";
  const auto rig = read_euroc_calib(folder);
  ASSERT_TRUE(rig) << rig.error().message();
  const StereoPair& pair = rig->pairs.front();
  const Camera& camera = *rig->find_camera(pair.left);
  const auto plan = plan_rectification(camera, *rig->find_camera(pair.right), rig->right_from_left(pair), "euroc");
  ASSERT_TRUE(plan);
  const auto image = read_gray8(std::filesystem::directory_iterator(folder + "/cam0/data")->path().string());
  ASSERT_TRUE(image);
  const RemapTable table(camera.model, camera.size, plan->geometry, plan->left_from_rectified, {}, ThreadPool(1));
  Image<std::uint8_t> ours(plan->geometry.size);
  table.apply(*image, ours, ThreadPool(1));
  const OpenCvMaps maps = opencv_maps(camera, plan->geometry, plan->left_from_rectified);
  cv::Mat theirs;
  cv::remap(as_mat(*image), theirs, maps.x, maps.y, cv::INTER_LINEAR);
  double sum = 0;
  int count = 0;
  for (int y = 0; y < ours.height(); ++y) {
    for (int x = 0; x < ours.width(); ++x) {
      if (!table.mask().empty() && table.mask()(x, y) == 0) continue;
      sum += std::abs(ours(x, y) - theirs.at<std::uint8_t>(y, x));
      ++count;
    }
  }
  fmt::print("euroc_v101: mean difference from cv::remap {:.3f} gray levels\n", sum / count);
  EXPECT_LT(sum / count, 0.5);  // cv::remap has a resolution of 1/32 px
}

using Corners = std::vector<cv::Point2f>;
const cv::Size kBoard(9, 6);
constexpr double kSquare_m = 0.025;

std::optional<Corners> find_corners(const cv::Mat& image) {
  Corners corners;
  if (!cv::findChessboardCorners(image, kBoard, corners, cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return std::nullopt;
  }
  cv::cornerSubPix(image, corners, {5, 5}, {-1, -1}, {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-3});
  return corners;
}

struct Chessboards {
  std::vector<Image<std::uint8_t>> left, right;
  std::vector<Corners> left_corners, right_corners;
};

Chessboards load_chessboards(const std::string& folder) {
  Chessboards boards;
  for (int i = 1; i <= 14; ++i) {
    auto left = read_gray8(fmt::format("{}/left{:02}.jpg", folder, i));
    auto right = read_gray8(fmt::format("{}/right{:02}.jpg", folder, i));
    if (!left || !right) continue;
    auto left_corners = find_corners(as_mat(*left)), right_corners = find_corners(as_mat(*right));
    if (!left_corners || !right_corners) continue;
    boards.left.push_back(std::move(*left));
    boards.right.push_back(std::move(*right));
    boards.left_corners.push_back(std::move(*left_corners));
    boards.right_corners.push_back(std::move(*right_corners));
  }
  return boards;
}

Camera to_camera(const std::string& name, const cv::Mat& k, const cv::Mat& distortion) {
  Camera camera;
  camera.name = name;
  camera.size = {640, 480};
  RadialTangentialModel::Coefficients coefficients{};
  for (int i = 0; i < 5; ++i) coefficients[static_cast<std::size_t>(i)] = distortion.at<double>(i);
  camera.model = RadialTangentialModel({k.at<double>(0, 0), k.at<double>(1, 1), k.at<double>(0, 2), k.at<double>(1, 2)},
                                       coefficients);
  return camera;
}

Rig calibrate(const Chessboards& boards) {
  std::vector<cv::Point3f> board;
  for (int y = 0; y < kBoard.height; ++y) {
    for (int x = 0; x < kBoard.width; ++x) board.emplace_back(kSquare_m * x, kSquare_m * y, 0);
  }
  const std::vector<std::vector<cv::Point3f>> points(boards.left.size(), board);
  cv::Mat k1, d1, k2, d2, r, t, e, f;
  std::vector<cv::Mat> rs, ts;
  cv::calibrateCamera(points, boards.left_corners, {640, 480}, k1, d1, rs, ts);
  cv::calibrateCamera(points, boards.right_corners, {640, 480}, k2, d2, rs, ts);
  cv::stereoCalibrate(points, boards.left_corners, boards.right_corners, k1, d1, k2, d2, {640, 480}, r, t, e, f,
                      cv::CALIB_USE_INTRINSIC_GUESS, {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-6});
  const Pose right_from_left(to_eigen(r), {t.at<double>(0), t.at<double>(1), t.at<double>(2)});
  return rig_of_one_pair("opencv_chessboard", to_camera("left", k1, d1), to_camera("right", k2, d2), right_from_left);
}

struct RowErrors {
  double sum = 0, largest = 0;
  int count = 0;
  void add(double error) {
    sum += std::abs(error);
    largest = std::max(largest, std::abs(error));
    ++count;
  }
  double mean() const { return count > 0 ? sum / count : 1e9; }
};

class Chessboard : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string folder = testing::data_folder() + "/opencv_chessboard";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no opencv_chessboard in $SPARTAN_DATA";
    boards_ = load_chessboards(folder);
    ASSERT_EQ(boards_.left.size(), 13U);
    rig_ = calibrate(boards_);
  }
  Chessboards boards_;
  Rig rig_;
};

TEST_F(Chessboard, MapsAgree) {
  expect_maps_agree(rig_, "opencv_chessboard");
}

TEST_F(Chessboard, CornersLieOnCommonRows) {
  const Camera &left = *rig_.find_camera("left"), &right = *rig_.find_camera("right");
  const auto plan = plan_rectification(left, right, rig_.right_from_left(rig_.pairs.front()), "chessboard");
  ASSERT_TRUE(plan);
  ImagingOptions options;
  options.contrast = false;
  auto imager = Imager::create(rig_, options, ThreadPool(2));
  ASSERT_TRUE(imager) << imager.error().message();

  RowErrors mapped, detected;
  int boards_seen = 0;
  const auto rectified_row = [&](const Camera& camera, const Eigen::Matrix3d& from_rectified, cv::Point2f corner) {
    const auto ray = unproject(camera.model, {corner.x, corner.y});
    return plan->geometry.project(from_rectified.transpose() * ray.value().direction).y();
  };
  for (std::size_t i = 0; i < boards_.left.size(); ++i) {
    for (std::size_t c = 0; c < boards_.left_corners[i].size(); ++c) {
      mapped.add(rectified_row(left, plan->left_from_rectified, boards_.left_corners[i][c]) -
                 rectified_row(right, plan->right_from_rectified, boards_.right_corners[i][c]));
    }
    StereoFrame frame;
    frame.pair = "stereo";
    frame.left = FrameImage::borrow(std::as_const(boards_.left[i]).view(), {});
    frame.right = FrameImage::borrow(std::as_const(boards_.right[i]).view(), {});
    const auto pair = imager->process(frame);
    ASSERT_TRUE(pair) << pair.error().message();
    const auto left_corners = find_corners(as_mat(pair->left)), right_corners = find_corners(as_mat(pair->right));
    if (!left_corners || !right_corners) continue;
    ++boards_seen;
    for (std::size_t c = 0; c < left_corners->size(); ++c) detected.add((*left_corners)[c].y - (*right_corners)[c].y);
  }
  fmt::print(
      "opencv_chessboard: row error of corners detected in the rectified images of {} boards: mean {:.3f} px, "
      "largest {:.3f} px; of corners mapped from the originals: mean {:.3f} px, largest {:.3f} px\n",
      boards_seen, detected.mean(), detected.largest, mapped.mean(), mapped.largest);
  EXPECT_GE(boards_seen, 10);
  EXPECT_LE(mapped.mean(), 0.2);
  EXPECT_LE(detected.mean(), 0.2);
}

}  // namespace
}  // namespace spartan
