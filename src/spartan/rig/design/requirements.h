// What a rover asks of its stereo pairs, and what there is to build them from (docs/formats.md, "Requirements of a
// rig").
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

/// One way to build a pair, in the units of the file: so a list's 0.15 stays 0.15.
struct PairShape {
  double baseline_m = 0;
  double nearest_m = 0;  ///< d_min: nothing nearer has to be matched
  double hfov_deg = 0;
  double pixel_size_um = 0;
  int width_px = 0;
  friend bool operator==(const PairShape&, const PairShape&) = default;
};

/// What is on offer; every combination is tried.
struct ShapeLists {
  std::vector<double> baselines_m, nearest_m, hfov_deg, pixel_sizes_um;
  std::vector<int> widths_px;
  std::size_t combinations() const;
};
constexpr std::size_t kMostCombinations = 2'000'000;

/// What makes one feasible shape better than another; the next one counts where two are equal to 10⁻⁹.
enum class DesignCriterion { range_margin, pan_overlap, shorter_baseline };

/// A pair on a pan unit that looks around at stops.
struct PanRequirements {
  std::vector<double> angles_deg;  ///< rising
  double azimuth_deg = 0;          ///< asked for, over all pans; straight ahead is its middle
  double smallest_overlap_percent = 0;
  /// Between neighbours; 0 for a single pan. Where all around is asked for, the last and the first are neighbours too.
  double widest_step_deg() const;
};

/// A pair that was chosen by others, as they describe it.
struct PublishedPair {
  PairShape shape;
  std::optional<int> height_px;  ///< without it the rows of the requirements
  std::optional<double> vfov_deg, focal_length_mm, tilt_deg;
};

struct PairRequirements {
  double range_m = 0;             ///< up to here …
  double range_resolution_m = 0;  ///< … a step of disparity may not be worth more than this
  double disparity_accuracy_px = 0;
  double largest_stereo_angle_deg = 0;
  std::optional<double> contradicting_stereo_angle_deg;  ///< another limit that the same source states
  double largest_search_percent = 0;
  double smallest_baseline_m = 0, smallest_height_m = 0;
  double height_m = 0;         ///< of the eyes over the ground
  double tilt_step_deg = 0;    ///< tilts are multiples of it
  double rows_per_column = 1;  ///< of the sensors on offer
  ShapeLists lists;
  std::vector<DesignCriterion> order;
  std::optional<PanRequirements> pans;  ///< none: it looks ahead only
  std::optional<PublishedPair> published;

  /// Rows over columns of the published sensor.
  double published_rows_per_column() const;
};

struct RigRequirements {
  std::string name;
  PairRequirements wide;                   ///< on the mast, for maps
  std::optional<PairRequirements> narrow;  ///< at its foot, for odometry
};

/// All faults of a file at once, each with its line; code `configuration`.
Result<RigRequirements> parse_requirements(const std::string& text, const std::string& name);
/// The same; code `input` where the file cannot be read.
Result<RigRequirements> read_requirements(const std::string& path);

}  // namespace spartan
