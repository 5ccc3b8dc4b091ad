#include "spartan/odometry/internal/detection/opencv_detector.h"

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/odometry/internal/detection/feature_spread.h"

namespace spartan::internal {
namespace {

/// Side of the patch of ORB at the first level; a corner must be so far from the border of its level.
constexpr int kOrbPatch_px = 31;
/// ORB keeps so many times the wanted features, of which the spreading selects.
constexpr int kOrbCandidates = 8;
/// A SURF descriptor covers 20 scales; ORB's patch as many.
constexpr float kScalesOfPatch = 20;
/// OpenCV's SIFT enlarges the image twice with the convention of pixel corners, but maps positions back without it.
constexpr float kSiftShift_px = 0.25f;
constexpr double kSiftSigma_px = 1.6;  // of the first layer (Lowe, §3.3)
/// Smaller images have no features: the first level would be empty.
constexpr int kMinSiftSide_px = 32, kMinAkazeWidth_px = 80, kMinAkazeHeight_px = 40;

cv::Ptr<cv::Feature2D> make_method(const DetectionOptions& options) {
  switch (options.detector) {
    case DetectorType::orb:
      return cv::ORB::create(kOrbCandidates * options.landmarks, static_cast<float>(options.orb.scale_factor),
                             options.orb.levels, kOrbPatch_px, 0, 2, cv::ORB::HARRIS_SCORE, kOrbPatch_px,
                             options.orb.threshold);
    case DetectorType::sift:
      return cv::SIFT::create(0, options.sift.layers, options.sift.threshold, options.sift.edge_ratio, kSiftSigma_px,
                              CV_8U);
    case DetectorType::akaze:
      return cv::AKAZE::create(cv::AKAZE::DESCRIPTOR_MLDB, 0, 3, static_cast<float>(options.akaze.threshold),
                               options.akaze.octaves, options.akaze.layers);
    case DetectorType::surf:
    case DetectorType::harris:
      break;
  }
  throw std::invalid_argument("OpencvDetector: not a detector of OpenCV");
}

DescriptorKind kind_made_by(DetectorType detector) {
  if (detector == DetectorType::sift) return DescriptorKind::sift;
  return detector == DetectorType::akaze ? DescriptorKind::akaze : DescriptorKind::orb;
}

bool is_too_small(DescriptorKind kind, ImageSize size) {
  const int side = std::min(size.width, size.height);
  if (kind == DescriptorKind::orb) return side <= 2 * kOrbPatch_px;
  if (kind == DescriptorKind::sift) return side < kMinSiftSide_px;
  return size.width < kMinAkazeWidth_px || size.height < kMinAkazeHeight_px;
}

}  // namespace

OpencvDetector::OpencvDetector(const DetectionOptions& options)
    : options_(options), kind_(kind_made_by(options.detector)), method_(make_method(options)) {}

Feature OpencvDetector::to_feature(const cv::KeyPoint& keypoint) const {
  constexpr float kDegree = 0.0174532925f;
  Feature f;
  f.x = keypoint.pt.x;
  f.y = keypoint.pt.y;
  f.scale = keypoint.size / 2;
  f.angle = keypoint.angle * kDegree;
  f.strength = keypoint.response;
  if (kind_ == DescriptorKind::sift) {
    f.x -= kSiftShift_px;
    f.y -= kSiftShift_px;
  } else if (kind_ == DescriptorKind::orb) {
    // OpenCV multiplies the position in the level by its scale, as if corners of pixels had integer coordinates.
    const auto level_scale = static_cast<float>(std::pow(options_.orb.scale_factor, keypoint.octave));
    f.x += 0.5f * (level_scale - 1);
    f.y += 0.5f * (level_scale - 1);
    f.scale = keypoint.size / kScalesOfPatch;
  }
  return f;
}

/// Descriptors of the selected features. SIFT makes them after the selection, which costs a second pyramid, because
/// each takes more time than a hundredth of the pyramid; the other two have made those of all keypoints.
void OpencvDetector::describe(ImageView<const std::uint8_t> image, const std::vector<std::uint32_t>& selected) {
  const bool late = kind_ == DescriptorKind::sift;
  if (late) {
    std::vector<cv::KeyPoint> chosen;
    chosen.reserve(selected.size());
    for (const std::uint32_t index : selected) chosen.push_back(keypoints_[keypoint_of_[index]]);
    method_->compute(as_mat(image), chosen, descriptors_);
    if (chosen.size() != selected.size()) throw std::logic_error("OpencvDetector: SIFT has discarded a keypoint");
  }
  features_.clear();
  features_.reserve(selected.size());
  for (std::size_t i = 0; i < selected.size(); ++i) {
    Feature f = found_[selected[i]];
    f.descriptor.kind = kind_;
    const auto row = static_cast<int>(late ? i : keypoint_of_[selected[i]]);
    std::memcpy(f.descriptor.bytes.data(), descriptors_.ptr(row), bytes_of(kind_));
    features_.push_back(f);
  }
}

const std::vector<Feature>& OpencvDetector::detect(ImageView<const std::uint8_t> image,
                                                   ImageView<const std::uint8_t> mask, const WantedFeatures& wanted) {
  keypoints_.clear();
  found_.clear();
  keypoint_of_.clear();
  features_.clear();
  if (is_too_small(kind_, image.size())) return features_;
  if (kind_ == DescriptorKind::sift) {
    method_->detect(as_mat(image), keypoints_);
  } else {
    method_->detectAndCompute(as_mat(image), cv::noArray(), keypoints_, descriptors_);
  }
  for (std::size_t i = 0; i < keypoints_.size(); ++i) {
    const Feature f = to_feature(keypoints_[i]);
    if (!is_allowed(f, mask)) continue;
    found_.push_back(f);
    keypoint_of_.push_back(i);
  }
  describe(image, spread_indices(found_, image.size(), wanted.count.value_or(options_.landmarks), options_.spacing_px,
                                 wanted.taken));
  return features_;
}

}  // namespace spartan::internal
