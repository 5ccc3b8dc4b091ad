// Odometry by Lucas-Kanade tracking and PnP with OpenCV, the usual cheap frame-to-frame method, as a rival in
// benchmarks.
#pragma once

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/imaging/imager.h"

namespace spartan {

/// Each frame: corners are topped up to `corners`, matched in the right image by pyramid Lucas-Kanade with a check of
/// rows, tracked into the next left image, and the motion is solved by PnP in RANSAC and refined on its inliers.
class LucasKanadeOdometry {
 public:
  explicit LucasKanadeOdometry(int corners = 1200) : corners_(corners) {}

  /// previous_from_current; the identity for the first frame and where PnP fails.
  Pose add(const RectifiedPair& pair) {
    const cv::Mat left = as_mat(pair.left), right = as_mat(pair.right);
    Pose motion;
    std::vector<cv::Point2f> tracked;
    if (!previous_.empty() && pixels_.size() >= 6) motion = track(left, pair.geometry, tracked);
    top_up(left, tracked);
    triangulate(left, right, pair.geometry, tracked);
    left.copyTo(previous_);
    return motion;
  }

 private:
  Pose track(const cv::Mat& left, const RectifiedStereo& g, std::vector<cv::Point2f>& tracked) {
    std::vector<cv::Point2f> found;
    std::vector<unsigned char> status;
    cv::calcOpticalFlowPyrLK(previous_, left, pixels_, found, status, cv::noArray(), {21, 21}, 3);
    std::vector<cv::Point3f> points;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (status[i] == 0) continue;
      points.push_back(points_[i]);
      tracked.push_back(found[i]);
    }
    if (points.size() < 6) return {};
    const cv::Matx33d k(g.focal_px, 0, g.centre_px.x(), 0, g.focal_px, g.centre_px.y(), 0, 0, 1);
    cv::Mat r, t;
    std::vector<int> inliers;
    if (!cv::solvePnPRansac(points, tracked, k, cv::noArray(), r, t, false, 200, 1.5F, 0.999, inliers)) return {};
    std::vector<cv::Point3f> inlier_points;
    std::vector<cv::Point2f> inlier_pixels;
    for (const int i : inliers) {
      inlier_points.push_back(points[static_cast<std::size_t>(i)]);
      inlier_pixels.push_back(tracked[static_cast<std::size_t>(i)]);
    }
    cv::solvePnPRefineLM(inlier_points, inlier_pixels, k, cv::noArray(), r, t);
    tracked = inlier_pixels;
    const Eigen::Vector3d rotation(r.at<double>(0), r.at<double>(1), r.at<double>(2));
    const Pose current_from_previous(Eigen::Quaterniond(exp_so3(rotation)),
                                     Eigen::Vector3d(t.at<double>(0), t.at<double>(1), t.at<double>(2)));
    return current_from_previous.inverse();
  }

  void top_up(const cv::Mat& left, std::vector<cv::Point2f>& pixels) const {
    if (static_cast<int>(pixels.size()) > corners_ * 3 / 4) return;
    cv::Mat mask(left.size(), CV_8UC1, cv::Scalar(255));
    for (const cv::Point2f& p : pixels) cv::circle(mask, p, 8, cv::Scalar(0), -1);
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(left, corners, corners_ - static_cast<int>(pixels.size()), 0.005, 8, mask);
    pixels.insert(pixels.end(), corners.begin(), corners.end());
  }

  void triangulate(const cv::Mat& left, const cv::Mat& right, const RectifiedStereo& g,
                   const std::vector<cv::Point2f>& pixels) {
    points_.clear();
    pixels_.clear();
    if (pixels.empty()) return;
    std::vector<cv::Point2f> matched;
    std::vector<unsigned char> status;
    cv::calcOpticalFlowPyrLK(left, right, pixels, matched, status, cv::noArray(), {21, 21}, 4);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double disparity = pixels[i].x - matched[i].x;
      if (status[i] == 0 || std::abs(pixels[i].y - matched[i].y) > 1 || disparity < 1) continue;
      const Eigen::Vector3d p = g.triangulate(pixels[i].x, pixels[i].y, disparity);
      points_.emplace_back(p.x(), p.y(), p.z());
      pixels_.push_back(pixels[i]);
    }
  }

  int corners_;
  cv::Mat previous_;
  std::vector<cv::Point2f> pixels_;  // in the previous left image
  std::vector<cv::Point3f> points_;  // in the previous left optical frame
};

}  // namespace spartan
