// Matching two images of unknown relative geometry, for the check of a calibration, and comparison of detectors.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/odometry/odometer.h"

namespace spartan {

/// Corresponding points of two images, pixels.
struct ViewMatch {
  Eigen::Vector2d left, right;
  double sigma_px = 0;     ///< standard deviation of `right` along y, from the residual and the gradients
  double correlation = 0;  ///< normalized cross-correlation of the two patches
};

struct ViewMatchingOptions {
  int features = 2000;               ///< maximum number of features of an image, spread over it
  double descriptor_ratio = 0.8;     ///< maximum ratio of the nearest to the second nearest descriptor distance
  double min_correlation = 0.8;      ///< minimum normalized cross-correlation of the aligned patches
  double correlation_radius_px = 3;  ///< maximum distance of the alignment from the detected feature, pixels
};

/// Matches SURF features of both images: mutual nearest neighbours that pass the ratio test (Lowe, IJCV 60, 2004) are
/// aligned to sub-pixel accuracy. Neither rows nor a range of disparities are assumed, so a few of the matches are
/// wrong and callers must be robust against them. In order of the strength of the left features; identical for any
/// number of threads.
std::vector<ViewMatch> match_views(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                   const ViewMatchingOptions& options, const ThreadPool& workers);

/// How the points of a second image correspond to those of a first one; homogeneous pixel coordinates.
struct ImageRelation {
  enum class Kind : std::uint8_t {
    homography,  ///< second ~ matrix · first: the place of each point is known
    epipolar,    ///< secondᵀ · matrix · first = 0 (fundamental matrix): the line of each point is known
  };
  Kind kind = Kind::homography;
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
};

/// A homography from nine numbers, row by row, separated by white space, as in the data set of Mikolajczyk et al., "A
/// comparison of affine region detectors", IJCV 65, 2005. Code `input` where the text is something else or the matrix
/// is singular; `where` is named in the message.
Result<Eigen::Matrix3d> parse_homography(const std::string& text, const std::string& where);

/// An image made from another one.
struct TransformedView {
  Image<std::uint8_t> image;
  ImageRelation geometry;  ///< from the other one to this
};
/// Turns an image clockwise about its centre and scales it, by cubic interpolation; before it is made smaller it is
/// blurred as by the pixels of a camera (σ = √(1/scale² − 1)/2 px). The result holds all of the image; beyond its
/// borders it is mirrored. Throws std::invalid_argument where the scale is not positive or the result is 32767 px wide
/// or more.
TransformedView transform_view(ImageView<const std::uint8_t> image, double clockwise_rad, double scale);

struct FeatureComparisonOptions {
  DetectionOptions detection;     ///< detector, and the number of features of each image
  double descriptor_ratio = 0.8;  ///< maximum ratio of the nearest to the second nearest descriptor distance
  int repetitions = 5;            ///< runs of which the time is the median
};

/// The features that a detector finds in two images, their matches, and how many of these are correct.
struct FeatureComparison {
  struct Match {
    int first = 0, second = 0;  ///< indices
    bool correct = false;
  };
  std::vector<Eigen::Vector2f> first, second;  ///< positions of the features, pixels
  std::vector<Match> matches;                  ///< mutual nearest descriptors that pass the ratio test
  double time_ms = 0;                          ///< to detect and describe the features of the first image
  // By score_features():
  int correct = 0;  ///< matches
  /// Pairs of features at corresponding places, each feature in one pair at most, over the smaller number of features
  /// (Mikolajczyk et al., IJCV 65, 2005); none where only lines are known, or without features.
  std::optional<double> repeatability;
  std::optional<double> precision;       ///< correct matches over matches; none without matches
  std::optional<double> matching_score;  ///< correct matches over the smaller number of features; none without features
};

/// Detects and matches features. With a homography features are detected only where both images show the scene, at
/// least 32 px (an eighth of small images) from the borders, so that the numbers of features of all detectors are
/// comparable.
FeatureComparison match_features(ImageView<const std::uint8_t> first, ImageView<const std::uint8_t> second,
                                 const std::optional<ImageRelation>& geometry, const FeatureComparisonOptions& options,
                                 const ThreadPool& workers);

/// Tells which matches are correct: those whose points are within the tolerance, pixels, of each other (or of their
/// epipolar lines) in both images.
void score_features(const ImageRelation& geometry, double tolerance_px, FeatureComparison& comparison);

/// The epipolar geometry that most of the matches of all comparisons agree on, within the tolerance: RANSAC with the
/// normalized eight-point algorithm (Hartley, IEEE PAMI 19, 1997). None where fewer than 15 agree.
std::optional<ImageRelation> estimate_epipolar_geometry(std::span<const FeatureComparison> comparisons,
                                                        double tolerance_px);

}  // namespace spartan
