// Requirements of a rover on its stereo pairs, and the candidates to choose from (docs/reference/requirements.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

/// The design parameters of a pair, in the units of the file so that a listed 0.15 stays exactly 0.15.
struct PairParameters {
  double baseline_m = 0;
  double nearest_m = 0;  ///< d_min, the smallest depth to match
  double hfov_deg = 0;
  double pixel_size_um = 0;
  int width_px = 0;
  friend bool operator==(const PairParameters&, const PairParameters&) = default;
};

/// The candidate values; every combination is evaluated.
struct CandidateLists {
  std::vector<double> baselines_m, nearest_m, hfov_deg, pixel_sizes_um;
  std::vector<int> widths_px;
  std::size_t combinations() const;
};
constexpr std::size_t kMostCombinations = 2'000'000;  // bounds time and memory of the search

/// Criteria of the lexicographic order of feasible pairs; values within 10⁻⁹ are equal, and the next criterion decides.
enum class DesignCriterion { range_margin, pan_overlap, shorter_baseline };

/// A pair on a pan unit that takes several views at a stop.
struct PanRequirements {
  std::vector<double> angles_deg;  ///< ascending
  double azimuth_deg = 0;          ///< required over all pans, centred straight ahead
  double smallest_overlap_percent = 0;
  /// Largest step between neighbouring pans; 0 for a single pan. Where 360° are required, the last and the first pan
  /// are neighbours too.
  double widest_step_deg() const;
};

/// A published pair, as its source describes it, to be checked against the requirements.
struct PublishedPair {
  PairParameters parameters;
  std::optional<int> height_px;  ///< default: by PairRequirements::rows_per_column
  std::optional<double> vfov_deg, focal_length_mm, tilt_deg;
};

/// Requirements on one stereo pair.
struct PairRequirements {
  std::string name;                     ///< of the pair
  double range_m = 0;                   ///< range up to which range_resolution_m is required
  double range_resolution_m = 0;        ///< largest depth change of a disparity step of disparity_accuracy_px
  double disparity_accuracy_px = 0;     ///< c, accuracy of the stereo matching
  double largest_stereo_angle_deg = 0;  ///< largest convergence angle at the nearest depth
  std::optional<double> contradicting_stereo_angle_deg;  ///< a second limit that the same source gives
  double largest_search_percent = 0;                     ///< largest disparity search range, of the image width
  double smallest_baseline_m = 0, smallest_height_m = 0;
  double height_m = 0;         ///< of the cameras above the ground
  double tilt_step_deg = 0;    ///< the tilt is a multiple of it
  double rows_per_column = 1;  ///< of the candidate sensors
  CandidateLists lists;
  std::vector<DesignCriterion> order;
  std::optional<PanRequirements> pans;  ///< none: the pair is fixed, looking ahead
  std::optional<PublishedPair> published;

  /// Rows over columns of the published sensor.
  double published_rows_per_column() const;
};

/// Requirements on the pairs of a rover.
struct RigRequirements {
  std::string name;
  std::vector<PairRequirements> pairs;  ///< at least one, with different names
  /// The first pair with pans, whose coverage is computed; the first pair where none has pans.
  std::size_t panned() const;
};

/// Parses requirements. All errors of the text are reported at once, each with its line; code `configuration`.
Result<RigRequirements> parse_requirements(const std::string& text, const std::string& name);
/// The same from a file; code `input` where it cannot be read.
Result<RigRequirements> read_requirements(const std::string& path);

}  // namespace spartan
