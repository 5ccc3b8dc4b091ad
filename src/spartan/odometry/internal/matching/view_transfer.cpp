#include "spartan/odometry/internal/matching/view_transfer.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>

namespace spartan::internal {
namespace {

double distance_from_line(const Eigen::Vector3d& line, const Eigen::Vector2d& point) {
  const double length = line.head<2>().norm();
  return length > 0 ? std::abs(line.dot(point.homogeneous())) / length : std::numeric_limits<double>::infinity();
}

}  // namespace

std::optional<Eigen::Vector2d> transferred(const Eigen::Matrix3d& homography, const Eigen::Vector2d& point) {
  const Eigen::Vector3d p = homography * point.homogeneous();
  if (!(p.z() > 1e-9 * p.head<2>().cwiseAbs().maxCoeff())) return std::nullopt;
  return p.hnormalized();
}

ViewTransfer::ViewTransfer(const ImageRelation& geometry) : geometry_(geometry) {
  if (geometry.kind == ImageRelation::Kind::homography) {
    back_ = geometry.matrix.inverse();
  } else {
    back_ = geometry.matrix.transpose();
  }
}

double ViewTransfer::error(const Eigen::Vector2d& first, const Eigen::Vector2d& second) const {
  if (geometry_.kind == ImageRelation::Kind::epipolar) {
    return std::max(distance_from_line(geometry_.matrix * first.homogeneous(), second),
                    distance_from_line(back_ * second.homogeneous(), first));
  }
  const auto there = transferred(geometry_.matrix, first), here = transferred(back_, second);
  if (!there || !here) return std::numeric_limits<double>::infinity();
  return std::max((*there - second).norm(), (*here - first).norm());
}

}  // namespace spartan::internal
