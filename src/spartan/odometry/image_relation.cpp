// Geometry of two images: made, read and estimated.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <array>
#include <charconv>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/matching/view_transfer.h"
#include "spartan/odometry/view_matching.h"

namespace spartan {

using namespace internal;

namespace {

/// OpenCV maps coordinates as 16-bit integers.
constexpr double kMaxSide_px = 32767;
/// Of a homography whose largest entry is 1: that of a view a thousand times smaller, shifted by 10 000 px.
constexpr double kMinHomographyDeterminant = 1e-20;
constexpr std::size_t kSample = 8;
constexpr int kMaxSamples = 2000;
constexpr std::size_t kMinAgreeing = 15;
constexpr double kProbability = 0.9999;
constexpr int kRefinements = 3;

struct PointPair {
  Eigen::Vector2d first, second;
};

/// Moves points to a centroid of 0 and a mean distance of √2.
Eigen::Matrix3d normalization_of(const std::vector<PointPair>& pairs, Eigen::Vector2d PointPair::*image) {
  const auto count = static_cast<double>(pairs.size());
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const PointPair& pair : pairs) centre += pair.*image / count;
  double distance = 0;
  for (const PointPair& pair : pairs) distance += (pair.*image - centre).norm() / count;
  const double scale = distance > 0 ? std::sqrt(2.0) / distance : 1;
  Eigen::Matrix3d result;
  result << scale, 0, -scale * centre.x(), 0, scale, -scale * centre.y(), 0, 0, 1;
  return result;
}

/// The normalized eight-point algorithm.
Eigen::Matrix3d fundamental_matrix(const std::vector<PointPair>& pairs) {
  const Eigen::Matrix3d first = normalization_of(pairs, &PointPair::first),
                        second = normalization_of(pairs, &PointPair::second);
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (const PointPair& pair : pairs) {
    const Eigen::Vector3d a = first * pair.first.homogeneous(), b = second * pair.second.homogeneous();
    Eigen::Matrix<double, 9, 1> row;
    row << b.x() * a, b.y() * a, b.z() * a;
    normal += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(normal);
  const Eigen::Matrix<double, 9, 1> f = solver.eigenvectors().col(0);
  Eigen::Matrix3d matrix;
  matrix << f.segment<3>(0).transpose(), f.segment<3>(3).transpose(), f.segment<3>(6).transpose();
  Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d values = svd.singularValues();
  values.z() = 0;
  return second.transpose() * svd.matrixU() * values.asDiagonal() * svd.matrixV().transpose() * first;
}

std::vector<PointPair> agreeing_pairs(const std::vector<PointPair>& pairs, const Eigen::Matrix3d& matrix,
                                      double tolerance_px) {
  const ViewTransfer transfer({ImageRelation::Kind::epipolar, matrix});
  std::vector<PointPair> agreeing;
  for (const PointPair& pair : pairs)
    if (transfer.error(pair.first, pair.second) <= tolerance_px) agreeing.push_back(pair);
  return agreeing;
}

/// Samples until one without outliers has been drawn with the probability above.
int needed_samples(std::size_t inliers, std::size_t all) {
  const double good = std::pow(static_cast<double>(inliers) / static_cast<double>(all), kSample);
  if (good >= 1) return 1;
  const double needed = std::log(1 - kProbability) / std::log1p(-good);
  return needed < kMaxSamples ? static_cast<int>(std::ceil(needed)) : kMaxSamples;
}

}  // namespace

Result<Eigen::Matrix3d> parse_homography(const std::string& text, const std::string& where) {
  const auto bad = [&](const std::string& what) {
    return failure(ErrorCode::input, what, where,
                   "write nine numbers, row by row, that map points of the first image to the second one");
  };
  std::array<double, 9> values{};
  std::size_t count = 0;
  for (std::size_t at = 0;;) {
    at = text.find_first_not_of(" \t\r\n", at);
    if (at == std::string::npos) break;
    const std::size_t end = std::min(text.find_first_of(" \t\r\n", at), text.size());
    const std::string word = text.substr(at, end - at);
    double value = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || stop != word.data() + word.size() || !std::isfinite(value))
      return bad(fmt::format("'{}' is not a number", word.substr(0, 40)));
    if (count == values.size()) return bad("has more than nine numbers");
    values[count++] = value;
    at = end;
  }
  if (count != values.size()) return bad(fmt::format("has {} numbers", count));
  Eigen::Matrix3d matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
  // It is determined up to a factor: points of the images have a positive third coordinate.
  matrix /= std::copysign(matrix.cwiseAbs().maxCoeff(), matrix(2, 2));
  if (!matrix.allFinite() || !(std::abs(matrix.determinant()) > kMinHomographyDeterminant))
    return bad("is a singular matrix");
  return matrix;
}

TransformedView transform_view(ImageView<const std::uint8_t> image, double clockwise_rad, double scale) {
  const double c = std::cos(clockwise_rad) * scale, s = std::sin(clockwise_rad) * scale;
  const double width = std::abs(c) * image.width() + std::abs(s) * image.height();
  const double height = std::abs(s) * image.width() + std::abs(c) * image.height();
  if (!(scale > 0) || !(std::max(width, height) < kMaxSide_px))
    throw std::invalid_argument("transform_view: the scale is not possible");
  TransformedView result{Image<std::uint8_t>(std::max(1, static_cast<int>(std::lround(width))),
                                             std::max(1, static_cast<int>(std::lround(height)))),
                         {}};
  const Eigen::Vector2d centre(0.5 * (image.width() - 1), 0.5 * (image.height() - 1));
  const Eigen::Vector2d new_centre(0.5 * (result.image.width() - 1), 0.5 * (result.image.height() - 1));
  Eigen::Matrix2d turn;
  turn << c, -s, s, c;
  result.geometry.matrix.topLeftCorner<2, 2>() = turn;
  result.geometry.matrix.topRightCorner<2, 1>() = new_centre - turn * centre;
  cv::Mat source = as_mat(image);
  if (scale < 1) {
    cv::Mat blurred;
    cv::GaussianBlur(source, blurred, {}, 0.5 * std::sqrt(1 / (scale * scale) - 1), 0, cv::BORDER_REFLECT_101);
    source = blurred;
  }
  const Eigen::Matrix3d& m = result.geometry.matrix;
  const cv::Matx23d affine(m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2));
  cv::Mat target = as_mat(result.image);
  cv::warpAffine(source, target, affine, target.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT_101);
  return result;
}

std::optional<ImageRelation> estimate_epipolar_geometry(std::span<const FeatureComparison> comparisons,
                                                        double tolerance_px) {
  std::vector<PointPair> pairs;
  for (const FeatureComparison& comparison : comparisons) {
    for (const FeatureComparison::Match& match : comparison.matches) {
      pairs.push_back({comparison.first[static_cast<std::size_t>(match.first)].cast<double>(),
                       comparison.second[static_cast<std::size_t>(match.second)].cast<double>()});
    }
  }
  if (pairs.size() < kMinAgreeing) return std::nullopt;
  Random random(1);
  std::vector<PointPair> best;
  int needed = kMaxSamples;
  for (int i = 0; i < needed; ++i) {
    std::vector<PointPair> sample;
    for (std::size_t k = 0; k < kSample; ++k)
      sample.push_back(pairs[random.below(static_cast<std::uint32_t>(pairs.size()))]);
    std::vector<PointPair> agreeing = agreeing_pairs(pairs, fundamental_matrix(sample), tolerance_px);
    if (agreeing.size() <= best.size()) continue;
    best = std::move(agreeing);
    needed = needed_samples(best.size(), pairs.size());
  }
  for (int i = 0; i < kRefinements && best.size() >= kMinAgreeing; ++i) {
    std::vector<PointPair> agreeing = agreeing_pairs(pairs, fundamental_matrix(best), tolerance_px);
    if (agreeing.size() < best.size()) break;
    best = std::move(agreeing);
  }
  if (best.size() < kMinAgreeing) return std::nullopt;
  return ImageRelation{ImageRelation::Kind::epipolar, fundamental_matrix(best)};
}

}  // namespace spartan
