// Rig design: requirements of a rover on its stereo pairs (docs/reference/requirements.md), exhaustive search for the
// pairs that meet them, and evaluation of a published pair.
#pragma once

#include <Eigen/Core>
#include <limits>
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

/// An interval of azimuths, degrees, positive to the left of straight ahead; from < to.
struct AzimuthSector {
  double from_deg = 0, to_deg = 0;
  double width_deg() const { return to_deg - from_deg; }
};

/// A set of azimuths. Intervals and gaps of less than 10⁻⁹ degrees are ignored.
class AzimuthSet {
 public:
  AzimuthSet() = default;  ///< empty
  static AzimuthSet all();
  /// Azimuths within `half_deg` of the middle, modulo 360°; empty for 0 and less, all for 180 and more.
  static AzimuthSet around(double middle_deg, double half_deg);

  /// Disjoint, ascending, within −180 … 180; an interval across ±180 is split there.
  const std::vector<AzimuthSector>& sectors() const { return sectors_; }
  double width_deg() const;
  bool empty() const { return sectors_.empty(); }
  bool contains(double azimuth_deg) const;
  /// Whether the other set is a subset of this one.
  bool covers(const AzimuthSet& other) const;

  /// The union of this set rotated by each of the angles (positive to the left).
  AzimuthSet rotated_by(const std::vector<double>& angles_deg) const;
  /// The intersection of both sets.
  AzimuthSet intersected_with(const AzimuthSet& other) const;

 private:
  explicit AzimuthSet(const std::vector<AzimuthSector>& sectors);  // in any order, possibly overlapping, any range

  std::vector<AzimuthSector> sectors_;
};

/// A pair over level ground: both cameras at the same height, half a baseline left and right of the pan axis, pointing
/// ahead and down by `tilt`.
struct GroundView {
  double height_m = 0;
  double tilt_rad = 0;  ///< of the optical axes below the horizontal
  double hfov_rad = 0, vfov_rad = 0;
  double baseline_m = 0;
};

/// Corners on the ground, counter-clockwise from above, (x ahead, y to the left) of the foot of the pan axis, m.
using GroundPolygon = std::vector<Eigen::Vector2d>;

/// Whether the top row, and with it the whole image, is below the horizon.
bool is_below_horizon(const GroundView& view);

/// Distance of the ground in the middle column, ahead of the foot of the camera, m: of the bottom row, and of the top
/// row (infinite at the horizon).
double near_edge_m(const GroundView& view);
double far_edge_m(const GroundView& view);

/// The ground in the image of one camera, `camera_left_m` to the left of the pan axis, at a pan angle (positive to the
/// left): the image corners projected onto the plane. Throws std::invalid_argument where is_below_horizon() is false.
GroundPolygon footprint(const GroundView& view, double camera_left_m, double pan_rad);
/// The ground that both cameras see; may be empty.
GroundPolygon common_footprint(const GroundView& view, double pan_rad);

/// The intersection of two convex polygons; may be empty.
GroundPolygon intersection(const GroundPolygon& a, const GroundPolygon& b);
double area_m2(const GroundPolygon& polygon);

/// Half of the azimuth that the far edge of a footprint at pan 0 spans from the origin, rad; none for an empty one.
std::optional<double> far_edge_half_azimuth_rad(const GroundPolygon& polygon);
/// The azimuths at which a circle around the origin lies inside a convex polygon.
AzimuthSet azimuths_at(const GroundPolygon& polygon, double distance_m);

/// Overlap of two neighbouring views that are one pan step apart.
struct PanOverlap {
  double view_rad = 0, step_rad = 0;
  double percent() const;  ///< share of the field of view; negative: a gap
  double gap_deg() const;  ///< between the views; negative: an overlap
};

/// A range of distances on the ground from the pan axis.
struct DistanceSpan {
  double from_m = 0, to_m = 0;
};

/// Coverage of all pans together. Azimuths are clipped to the required azimuth, which is centred straight ahead.
struct PanCoverage {
  std::optional<PanOverlap> overlap;             ///< nominal, from the field of view; none for a single pan
  std::optional<PanOverlap> far_overlap;         ///< at the top row, one camera; none for a single pan
  std::optional<PanOverlap> far_overlap_stereo;  ///< the same for both cameras; also none without common ground
  AzimuthSet azimuth_far;                        ///< azimuths at which the far edge (top row) is seen, one camera
  AzimuthSet azimuth_far_stereo;                 ///< the same for both cameras
  /// Distances at which both cameras cover the whole required azimuth: the longest such range; none if there is none.
  std::optional<DistanceSpan> full_coverage;
};

PanCoverage pan_coverage(const GroundView& view, const PanRequirements& pans);

/// The azimuth that the requirements demand.
AzimuthSet required_azimuth(const PanRequirements& pans);
/// The part of the required azimuth that the pans cover at a distance from the pan axis. `at_pan_0` is a footprint at
/// pan 0, of one camera or of both.
AzimuthSet covered_azimuth(const GroundPolygon& at_pan_0, const PanRequirements& pans, double distance_m);

/// "-58.5 to 58.5 deg", a list of the sectors, or "nowhere".
std::string to_text(const AzimuthSet& set, const std::string& degrees = " deg");
/// "overlap by 30.0 %", or "leave a gap of 30.0 deg".
std::string to_text(const PanOverlap& overlap, const std::string& degrees = " deg");
/// One sentence about the overlap of neighbouring pans, of which there must be at least two.
std::string describe_overlaps(const PanCoverage& pans, const std::string& degrees = " deg");

/// One warning. `value` is the quantity that `text` reports, in the unit of the text.
struct DesignWarning {
  std::string id;  ///< docs/math/rig_design.md, "Warnings"
  std::string pair;
  std::string text;
  double value = 0;
};

/// Margin of a pair to each limit; negative: violated. NaN where nothing is required.
struct PairMargins {
  double range_m = 0, stereo_angle_deg = 0, search_percent = 0, baseline_m = 0;
  double pan_overlap_percent = 0;
};

/// One pair with all values derived from its parameters (docs/math/rig_design.md).
struct PairMetrics {
  PairParameters parameters;
  double range_m = 0;          ///< range up to which the required resolution is met
  double focal_length_mm = 0;  ///< from width, pixel size and field of view
  double stereo_angle_deg = 0;
  double search_percent = 0;
  double pan_overlap_percent = 0;  ///< nominal, of neighbouring pans, share of the field of view; NaN without pans
  double vfov_deg = 0, tilt_deg = 0;
  double view_near_m = 0, view_far_m = 0;  ///< visible ground in the middle column, from the foot of the camera
  PairMargins margins;
  bool feasible = false;          ///< range, stereo angle, search range and baseline are within their limits
  bool with_pan_overlap = false;  ///< feasible, and the overlap of the pans is sufficient; false without pans
};

/// Numbers of combinations.
struct LimitCounts {
  std::size_t range = 0, stereo_angle = 0, search = 0, baseline = 0;
};

/// Result of the search for one pair.
struct PairDesign {
  std::string name;            ///< of the pair
  bool pans_required = false;  ///< PairRequirements::pans
  std::size_t combinations = 0;
  std::vector<PairMetrics> feasible;  ///< ordered, best first
  /// How many of them have sufficient overlap of the pans; none where there are no pans.
  std::optional<std::size_t> with_pan_overlap_count;
  std::size_t equally_good = 0;  ///< how many of them are equal to the best by all criteria, including itself
  std::optional<PairMetrics> best_with_pan_overlap;
  std::optional<PairMetrics> published;
  /// Smallest distance of any value of any combination from its limit, relative to that limit. Far above 10⁻⁹: rounding
  /// has no influence on feasibility.
  double smallest_limit_distance = std::numeric_limits<double>::infinity();
  bool published_is_candidate = false;  ///< whether the published pair is one of the combinations

  /// How many combinations meet each limit by itself.
  LimitCounts meeting;
  /// Where none is feasible: the combination whose largest violation, relative to the limit, is the smallest.
  std::optional<PairMetrics> nearest;

  const PairMetrics* best() const { return feasible.empty() ? nullptr : &feasible.front(); }
  /// The pair for which ground coverage is computed and drawn: the published pair, else the best with sufficient
  /// overlap of the pans, else the best; null where there is none.
  const PairMetrics* selected() const;
};

/// Result of design_rig().
struct RigDesign {
  std::vector<PairDesign> pairs;         ///< in the order of the requirements
  std::optional<PanCoverage> pans;       ///< coverage of the pair RigRequirements::panned(), if it has pans
  std::optional<double> view_overlap_m;  ///< length of ground visible to all selected pairs, middle column
  std::vector<DesignWarning> warnings;
};

/// Searches all combinations of every pair, computes ground coverage, and collects warnings.
RigDesign design_rig(const RigRequirements& requirements);

/// Evaluates one set of parameters. Its tilt is the largest multiple of tilt_step_deg at which the top row still
/// reaches the required range.
PairMetrics metrics_of(const PairParameters& parameters, const PairRequirements& requirements);
/// Evaluates the published pair, which must exist, with its own rows, field of view and tilt where they are given.
PairMetrics published_metrics(const PairRequirements& requirements);

/// Number of feasible combinations.
std::size_t count_feasible(const PairRequirements& requirements);

/// The ground view of a pair at its tilt.
GroundView ground_view(const PairMetrics& pair, const PairRequirements& requirements);

/// All warnings about a design; ignores the field `warnings` of `design`.
std::vector<DesignWarning> find_design_warnings(const RigRequirements& requirements, const RigDesign& design);

}  // namespace spartan
