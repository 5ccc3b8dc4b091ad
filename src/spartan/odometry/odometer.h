// Visual odometry: the motion of the rover from one stereo frame to the next.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "spartan/core/archive.h"
#include "spartan/core/options.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/core/time.h"
#include "spartan/imaging/imager.h"

namespace spartan {

/// Options of the SURF detector and descriptors.
struct SurfOptions {
  int octaves = 3;         ///< octaves of the scale space
  double threshold = 0.3;  ///< minimum determinant of the Hessian, gray levels²
  bool upright = true;     ///< U-SURF: no orientation is assigned
  bool refine = false;     ///< places by Gaussian derivatives

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "octaves", octaves,
        "Number of octaves of the scale space, each with four box filters, the smallest 9 px wide; raising it finds "
        "larger blobs (three octaves: filters up to 99 px) and costs little time.",
        between(1, 5));
    v.field(
        "threshold", threshold,
        "Minimum determinant of the Hessian for a feature, in squared gray levels; raising it keeps fewer, stronger "
        "features.",
        at_least(0));
    v.field("upright", upright,
            "True skips the orientation assignment (U-SURF): faster and more distinctive, for rovers that do not roll "
            "over; set false where the image rotates by more than about 15 degrees between frames.");
    v.field("refine", refine,
            "True finds place and scale of each feature again by Gaussian derivatives, and takes square roots of the "
            "descriptor's entries: more repeatable under large rotations and changes of scale, at twice the time.");
  }
};

/// Options of Harris corners, which are described by SURF.
struct HarrisOptions {
  int window_px = 5;      ///< side of the window of the structure tensor, pixels
  double quality = 1e-5;  ///< minimum response, fraction of the strongest one of the image
  double scale_px = 2;    ///< scale of the SURF descriptor, pixels
  bool upright = true;    ///< no orientation is assigned

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("window_px", window_px,
            "Side of the window in pixels over which products of gradients are summed; raising it finds larger, fewer "
            "corners.",
            between(2, 31));
    v.field("quality", quality,
            "Minimum corner response as a fraction of the strongest one in the image; raising it keeps fewer, stronger "
            "corners.",
            between(0, 1));
    v.field("scale_px", scale_px,
            "Scale of the corners' SURF descriptors in pixels, each of which covers 20 of them; raising it describes "
            "larger surroundings.",
            between(1, 20));
    v.field("upright", upright, "True assigns no orientation to the descriptors, as surf.upright does.");
  }
};

/// Options of FAST corners on a pyramid with ORB descriptors, by OpenCV.
struct OrbOptions {
  int threshold = 5;          ///< minimum difference of gray levels of FAST
  int levels = 8;             ///< levels of the pyramid
  double scale_factor = 1.2;  ///< ratio of the sizes of two levels

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("threshold", threshold,
            "Minimum difference in gray levels between a FAST corner and the circle around it; raising it keeps fewer, "
            "stronger corners.",
            between(1, 254));
    v.field("levels", levels, "Number of levels of the pyramid; raising it finds larger corners and costs time.",
            between(1, 16));
    v.field("scale_factor", scale_factor,
            "Ratio of the sizes of two consecutive levels; raising it spans more scales with fewer of them.",
            between(1.05, 2));
  }
};

/// Options of SIFT, by OpenCV.
struct SiftOptions {
  int layers = 3;            ///< layers of an octave
  double threshold = 0.005;  ///< minimum contrast, fraction of the range of gray levels
  double edge_ratio = 10;    ///< largest ratio of the principal curvatures

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("layers", layers, "Number of scales in each octave; raising it samples the scale space more finely.",
            between(1, 10));
    v.field("threshold", threshold,
            "Minimum contrast of a feature, relative to the range of gray levels and divided by the number of layers; "
            "raising it keeps fewer, stronger features.",
            between(0, 1));
    v.field("edge_ratio", edge_ratio,
            "Largest ratio of the principal curvatures of a feature; raising it keeps more features on edges.",
            between(1, 1000));
  }
};

/// Options of AKAZE, by OpenCV.
struct AkazeOptions {
  double threshold = 3e-5;  ///< minimum determinant of the Hessian, gray levels from 0 to 1
  int octaves = 4;          ///< octaves of the nonlinear scale space
  int layers = 4;           ///< layers of an octave

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("threshold", threshold,
            "Minimum determinant of the Hessian for a feature, with gray levels from 0 to 1; raising it keeps fewer, "
            "stronger features.",
            between(0, 1));
    v.field("octaves", octaves, "Number of octaves of the scale space; raising it finds larger features.",
            between(1, 8));
    v.field("layers", layers, "Number of scales in each octave; raising it costs time in proportion.", between(1, 10));
  }
};

/// Which landmark detector runs.
enum class DetectorType {
  surf,    ///< blobs of the Hessian in scale space, SURF descriptors
  harris,  ///< corners at one scale, SURF descriptors
  orb,     ///< FAST corners on a pyramid, ORB descriptors
  sift,    ///< differences of Gaussians, SIFT descriptors
  akaze,   ///< blobs of the Hessian in a nonlinear scale space, M-LDB descriptors
};
constexpr auto enum_names(DetectorType) {
  return std::array{
      EnumName<DetectorType>{DetectorType::surf, "surf"}, EnumName<DetectorType>{DetectorType::harris, "harris"},
      EnumName<DetectorType>{DetectorType::orb, "orb"}, EnumName<DetectorType>{DetectorType::sift, "sift"},
      EnumName<DetectorType>{DetectorType::akaze, "akaze"}};
}

struct DetectionOptions {
  DetectorType detector = DetectorType::surf;  ///< which detector finds the landmarks
  int landmarks = 1200;                        ///< maximum number of features of an image and of tracked landmarks
  double spacing_px = 5;                       ///< minimum distance between two landmarks, pixels
  SurfOptions surf;
  HarrisOptions harris;
  OrbOptions orb;
  SiftOptions sift;
  AkazeOptions akaze;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("detector", detector,
            "Detector that finds the landmarks: `surf`, `harris` (corners at one scale), `orb` (FAST corners on a "
            "pyramid), `sift` or `akaze`; docs/benchmarks/odometry.md compares them.");
    v.field("landmarks", landmarks,
            "Maximum number of features detected in an image, and of landmarks tracked, spread evenly over the image; "
            "raising it lowers the noise of the motion and costs time in proportion.",
            between(20, 100000));
    v.field("spacing_px", spacing_px,
            "Minimum distance between two landmarks in pixels; raising it spreads them more evenly and keeps fewer.",
            between(0, 100));
    v.group("surf", surf);
    v.group("harris", harris);
    v.group("orb", orb);
    v.group("sift", sift);
    v.group("akaze", akaze);
  }
};

/// Where the disparities of landmarks come from.
enum class DisparitySource {
  row,    ///< search along the image row of each landmark
  dense,  ///< read from the dense disparity image, where one is given
};
constexpr auto enum_names(DisparitySource) {
  return std::array{EnumName<DisparitySource>{DisparitySource::row, "row"},
                    EnumName<DisparitySource>{DisparitySource::dense, "dense"}};
}

struct LandmarkReconstructionOptions {
  DisparitySource source = DisparitySource::row;  ///< where disparities come from
  double max_disparity_fraction = 0.3;            ///< largest disparity, fraction of the image width
  double min_disparity_px = 0.0;                  ///< smallest disparity, pixels
  double min_correlation = 0.7;                   ///< minimum normalized cross-correlation, −1 … 1
  double uniqueness = 0.05;                       ///< minimum lead of the best correlation peak over all others
  bool left_right_check = true;                   ///< the match must also be the best one from right to left
  bool slant = true;                              ///< estimate the disparity gradient of the surface patch

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "source", source,
        "Source of the landmarks' disparities: `row` searches along the image row of each landmark, `dense` computes "
        "the dense disparity image of every frame and reads it there, which takes more time.");
    v.renamed("max_disparity_share", "max_disparity_fraction");
    v.field("max_disparity_fraction", max_disparity_fraction,
            "Largest disparity of the row search as a fraction of the image width; raising it finds nearer landmarks "
            "and costs time in proportion.",
            between(0.01, 1));
    v.field("min_disparity_px", min_disparity_px,
            "Smallest accepted disparity in pixels; raising it discards distant landmarks, a negative value accepts "
            "points beyond infinity of a pair whose cameras are slightly miscalibrated.",
            between(-100, 1000));
    v.field("min_correlation", min_correlation,
            "Minimum normalized cross-correlation of the left and right patch; raising it keeps fewer, more reliable "
            "disparities.",
            between(0, 1));
    v.field("uniqueness", uniqueness,
            "Minimum difference between the best correlation along the row and that of any other peak; raising it "
            "rejects more ambiguous matches on repetitive texture.",
            between(0, 1));
    v.field("left_right_check", left_right_check,
            "True requires that the search from right to left returns to the same pixel within 1 px; false saves a "
            "search and accepts more occluded points.");
    v.field(
        "slant", slant,
        "True estimates the disparity gradient of the surface together with the disparity, as needed on ground that "
        "is seen at a low angle; false assumes fronto-parallel patches.");
  }
};

struct LandmarkMatchingOptions {
  bool descriptors = true;                ///< match descriptors first, for a coarse motion
  double gate_px = 40;                    ///< half side of the descriptor search window around the prediction, pixels
  double max_descriptor_distance = 0.35;  ///< maximum Euclidean distance of two unit descriptors
  double descriptor_ratio = 0.85;         ///< maximum ratio of best to second best descriptor distance
  bool correlation = true;                ///< locate landmarks to sub-pixel accuracy by patch alignment
  double min_correlation = 0.7;           ///< minimum normalized cross-correlation with the landmark's patch
  double correlation_radius_px = 4;       ///< maximum distance of the aligned patch from its predicted position, pixels
  double max_scale_change = 1.35;         ///< relative change of size at which a landmark is re-anchored
  double disparity_radius_px = 3;         ///< half range of the stereo search around the predicted disparity, pixels
  bool rigidity = true;                   ///< reject matches whose distances to other landmarks have changed

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("descriptors", descriptors,
            "True matches descriptors first and computes a coarse motion from them; false relies on the predicted "
            "motion alone, which suffices where it is good to correlation_radius_px.");
    v.field("gate_px", gate_px,
            "Half side of the window around a landmark's predicted position in which descriptors are compared, in "
            "pixels; raising it tolerates larger prediction errors at the cost of more false matches.",
            at_least(1));
    v.field(
        "max_descriptor_distance", max_descriptor_distance,
        "Maximum Euclidean distance between two descriptors (unit vectors, so 0 to 2); raising it accepts more, less "
        "similar matches. Distances of other descriptors than SURF are scaled to the same range.",
        between(0, 2));
    v.field("descriptor_ratio", descriptor_ratio,
            "Maximum ratio of the best to the second best descriptor distance (ratio test); raising it accepts more "
            "ambiguous matches.",
            between(0, 1));
    v.field("correlation", correlation,
            "True locates each landmark to sub-pixel accuracy by aligning its image patch; false uses the positions of "
            "the matched features, which is faster and several times less accurate.");
    v.field("min_correlation", min_correlation,
            "Minimum normalized cross-correlation with the landmark's patch; raising it keeps fewer, more reliable "
            "matches.",
            between(0, 1));
    v.renamed("correlation_reach_px", "correlation_radius_px");
    v.field(
        "correlation_radius_px", correlation_radius_px,
        "Maximum distance between the predicted and the aligned position of a patch in pixels; raising it tolerates "
        "a worse coarse motion and accepts more false matches.",
        between(0.5, 100));
    v.field("max_scale_change", max_scale_change,
            "Factor by which a landmark may appear larger or smaller than in its anchor frame before it is re-anchored "
            "with a new patch; raising it keeps anchors longer, which lowers drift but weakens the alignment.",
            between(1, 4));
    v.renamed("narrow_stereo_px", "disparity_radius_px");
    v.field("disparity_radius_px", disparity_radius_px,
            "Half range in pixels of the stereo search around the predicted disparity of a landmark; raising it "
            "tolerates worse predictions and accepts more false disparities.",
            between(1, 100));
    v.field("rigidity", rigidity,
            "True discards matches whose 3D distances to most other landmarks have changed, such as points on moving "
            "objects, before the motion is estimated.");
  }
};

struct MotionEstimationOptions {
  int ransac_iterations = 200;       ///< maximum number of RANSAC samples of the coarse motion
  double ransac_threshold_px = 3.0;  ///< largest reprojection residual of a RANSAC inlier, pixels
  double pixel_sigma_px = 0.10;      ///< noise floor of an image position, standard deviation, pixels
  double disparity_sigma_px = 0.10;  ///< noise floor of a disparity, standard deviation, pixels
  double inlier_sigmas = 4.0;        ///< largest normalized residual of an inlier, standard deviations
  bool robust = true;                ///< Cauchy loss instead of least squares
  double offset_sigma_px = 0.15;     ///< prior standard deviation of the disparity offset, pixels
  double offset_drift_px = 0.005;    ///< random walk of the disparity offset, pixels per frame
  int min_inliers = 12;              ///< with fewer inliers the status is `lost`
  int min_tracking_inliers = 40;     ///< with fewer inliers the status is `degraded`

  template <class Visitor>
  void describe(Visitor& v) {
    v.renamed("ransac_rounds", "ransac_iterations");
    v.field("ransac_iterations", ransac_iterations,
            "Maximum number of RANSAC samples of three landmarks for the coarse motion; fewer are drawn once three "
            "inliers have been sampled with a probability of 0.9999, and raising it tolerates more outliers.",
            between(1, 100000));
    v.renamed("coarse_tolerance_px", "ransac_threshold_px");
    v.field("ransac_threshold_px", ransac_threshold_px,
            "Largest reprojection residual (u, v, disparity) of a RANSAC inlier in pixels; raising it accepts less "
            "accurate features and more outliers.",
            at_least(0.1));
    v.field("pixel_sigma_px", pixel_sigma_px,
            "Standard deviation in pixels that is added to the alignment's own uncertainty of every image position; "
            "raising it enlarges the covariance and lets near and distant landmarks count more alike.",
            between(0.001, 10));
    v.field("disparity_sigma_px", disparity_sigma_px,
            "Standard deviation in pixels that is added to the alignment's own uncertainty of every disparity; raising "
            "it lets image positions determine the motion more than disparities.",
            between(0.001, 10));
    v.field("inlier_sigmas", inlier_sigmas,
            "Largest normalized residual of an inlier, in standard deviations of the observed noise; raising it keeps "
            "more measurements, including outliers.",
            between(1, 100));
    v.field("robust", robust,
            "True minimizes a Cauchy loss, which bounds the influence of outliers; false is plain least squares on the "
            "inliers, for experiments.");
    v.field("offset_sigma_px", offset_sigma_px,
            "Prior standard deviation in pixels of a constant error of all disparities (from the relative yaw of the "
            "cameras), which is estimated along with the motion; raise it for poor calibrations, 0 switches the "
            "estimation off.",
            between(0, 10));
    v.field("offset_drift_px", offset_drift_px,
            "Standard deviation in pixels by which that disparity offset may change from one frame to the next (random "
            "walk); raising it follows thermal changes faster and lowers the accuracy of a constant offset.",
            between(0, 10));
    v.field(
        "min_inliers", min_inliers,
        "Minimum number of inliers of a measured motion; with fewer the status is `lost` and the predicted motion is "
        "returned.",
        between(6, 10000));
    v.renamed("few_inliers", "min_tracking_inliers");
    v.field("min_tracking_inliers", min_tracking_inliers,
            "Minimum number of inliers for the status `tracking`; with fewer the motion is measured but its status is "
            "`degraded`.",
            between(6, 10000));
  }
};

struct StationaryOptions {
  bool detect = true;         ///< detect that the rover is stationary and hold its pose
  double max_flow_px = 0.25;  ///< largest mean image flow of a stationary rover, pixels

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("detect", detect,
            "True holds the pose exactly while the images show no motion, so that noise does not add up to drift.");
    v.field("max_flow_px", max_flow_px,
            "Largest mean image flow in pixels, accumulated since the rover stopped, that still counts as stationary, "
            "unless the covariance of the measured motion excludes that; raising it tolerates vibration and hides slow "
            "motion for longer.",
            between(0, 10));
  }
};

struct OdometryOptions {
  DetectionOptions detection;
  LandmarkReconstructionOptions reconstruction;
  LandmarkMatchingOptions matching;
  MotionEstimationOptions motion;
  StationaryOptions stationary;

  template <class Visitor>
  void describe(Visitor& v) {
    v.group("detection", detection);
    v.group("reconstruction", reconstruction);
    v.group("matching", matching);
    v.group("motion", motion);
    v.renamed("standing", "stationary");
    v.group("stationary", stationary);
  }
};

enum class TrackingStatus : std::uint8_t {
  tracking,    ///< the motion is measured
  degraded,    ///< measured from few inliers or against many outliers; its covariance says how well
  lost,        ///< not measured: the motion returned is the prediction
  stationary,  ///< the rover is stationary: the motion returned is the identity
};
std::string_view name_of(TrackingStatus status);

/// Wall-clock milliseconds of each sub-module in one call; for reports only, no result depends on it.
struct OdometryTimes {
  double detect = 0, reconstruct = 0, match = 0, estimate = 0, total = 0;
};

/// The motion between two stereo frames, in rectified left optical frames.
struct MotionEstimate {
  /// `from` is the frame whose landmarks were found: the latest one that was measured, which lost frames do not
  /// replace, or the frame before where that was lost and the older landmarks are out of view.
  Stamp from, to;
  bool keeps_reference = false;  ///< lost or measured in the right image alone: the next motion begins at `from`, too
  bool first = false;            ///< there was no previous frame: the motion is the identity
  Pose previous_from_current;
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation, (translation, rotation), m² rad²
  TrackingStatus status = TrackingStatus::tracking;
  std::string reason;  ///< why the status is not `tracking`; empty otherwise
  int landmarks = 0, matches = 0, inliers = 0;
  double rms_px = 0;  ///< root mean square of the inliers' reprojection residuals per coordinate, pixels
  OdometryTimes times;
};

/// A landmark by which a motion was measured, in the rectified left images at MotionEstimate::from and `to`.
struct LandmarkTrack {
  Eigen::Vector2f previous_px, current_px;
  bool is_inlier = false;
};

/// Stereo visual odometry of the SPARTAN paper (Kostavelis et al., ICCV Workshops 2011): landmark detection → landmark
/// 3D reconstruction → landmark matching → motion estimation. It keeps the landmarks of t−1 (the published "1/z"
/// block). Derivation: docs/math/odometry.md.
class Odometer {
 public:
  /// Code `configuration` where an option is out of bounds.
  static Result<Odometer> create(const OdometryOptions& options, ThreadPool workers);
  Odometer(Odometer&&) noexcept;
  Odometer& operator=(Odometer&&) noexcept;
  ~Odometer();

  /// Processes the next stereo frame. `predicted` (previous_from_current, left optical frames) replaces the
  /// constant-velocity prediction; by `alternative`, the motion that other sensors measured, landmarks are searched
  /// where the prediction fails. Both begin at the frame at which the estimate will begin. `disparity` is the dense
  /// disparity of the left image (pixels, NaN unknown), used where the option reconstruction.source is `dense` and it
  /// is not empty. Never fails: a pair that cannot be used gives the status `lost` with a reason.
  MotionEstimate add(const RectifiedPair& pair, const std::optional<Pose>& predicted = {},
                     ImageView<const float> disparity = {}, const std::optional<Pose>& alternative = {});

  /// Of the latest frame, valid until the next one; none where its motion was not measured in the left image.
  std::span<const LandmarkTrack> tracks() const;

  /// The state as a versioned value; after restore() the following estimates are the same, bit for bit. restore() fails
  /// with code `configuration` where the bytes are of another version, `store_damaged` where they are damaged, and then
  /// changes nothing.
  Bytes save() const;
  Status restore(const Bytes& state);

 private:
  struct State;
  explicit Odometer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
