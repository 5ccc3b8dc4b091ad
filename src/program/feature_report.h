// What `features compare` prints and draws.
#pragma once

#include <string>
#include <vector>

#include "program/json.h"
#include "spartan/core/image.h"
#include "spartan/odometry/view_matching.h"

namespace spartan::program {

/// A detector as it was compared.
struct ComparedDetector {
  std::string name;
  FeatureComparison result;
};

/// The second image of a comparison, and all detectors on it.
struct ComparedView {
  std::string name;      ///< "rotation 10 deg", or the file
  std::string file_tag;  ///< begins the names of its figures; may be empty
  std::string geometry;  ///< "homography", "rectified" or "estimated"
  double rotation_deg = 0, scale = 1;
  bool made = false;  ///< from the first image, by that rotation and scale
  Image<std::uint8_t> image;
  std::vector<ComparedDetector> detectors;
};

struct ComparisonSettings {
  int features = 0;
  double tolerance_px = 0;
};

Json comparison_to_json(const ComparisonSettings& settings, const std::vector<ComparedView>& views);
std::string comparison_to_text(const ComparisonSettings& settings, const std::vector<ComparedView>& views);

/// Both images side by side, wide ones one below the other, with the features (yellow), correct matches (green) and
/// wrong ones (red).
Image<Rgb8> draw_comparison(ImageView<const std::uint8_t> first, ImageView<const std::uint8_t> second,
                            const FeatureComparison& comparison);

}  // namespace spartan::program
