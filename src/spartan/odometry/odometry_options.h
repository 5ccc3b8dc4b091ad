// Options of the odometry, one struct a sub-step. One set of defaults serves all recordings.
#pragma once

#include <string>

#include "spartan/core/options.h"

namespace spartan {

struct SurfOptions {
  int octaves = 3;
  double threshold = 0.3;
  bool upright = true;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("octaves", octaves, "octaves of the scale space, filters from 9 px up", between(1, 5));
    v.field("threshold", threshold, "least determinant of the Hessian, gray levels squared", at_least(0));
    v.field("upright", upright, "no orientation is assigned (U-SURF): for rovers that do not roll over");
  }
};

struct DetectionOptions {
  std::string detector = "surf";
  int landmarks = 1200;
  double spacing_px = 5;
  SurfOptions surf;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("detector", detector, "which detector finds the landmarks", {"surf"});
    v.field("landmarks", landmarks, "at most so many landmarks an image, spread over it", between(20, 100000));
    v.field("spacing_px", spacing_px, "least distance between two landmarks", between(0, 100));
    v.group("surf", surf);
  }
};

struct LandmarkReconstructionOptions {
  std::string source = "row";
  double max_disparity_share = 0.3;
  double min_disparity_px = 0.0;
  double min_correlation = 0.7;
  double uniqueness = 0.05;
  bool left_right_check = true;
  bool slant = true;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("source", source, "where disparities come from: a search along the row, or the dense disparity image",
            {"row", "dense"});
    v.field("max_disparity_share", max_disparity_share, "largest disparity over the image width", between(0.01, 1));
    v.field("min_disparity_px", min_disparity_px, "smallest disparity", between(-100, 1000));
    v.field("min_correlation", min_correlation, "least normalised correlation of the two patches", between(0, 1));
    v.field("uniqueness", uniqueness, "by how much the best correlation must exceed that of any other place",
            between(0, 1));
    v.field("left_right_check", left_right_check, "the match must be the best one seen from the right eye too");
    v.field("slant", slant, "the surface patch may be slanted: its disparity changes linearly");
  }
};

struct LandmarkMatchingOptions {
  bool descriptors = true;
  double gate_px = 40;
  double max_descriptor_distance = 0.35;
  double descriptor_ratio = 0.85;
  bool correlation = true;
  double min_correlation = 0.7;
  double correlation_reach_px = 4;
  double max_scale_change = 1.35;
  double narrow_stereo_px = 3;
  bool rigidity = true;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("descriptors", descriptors, "match by descriptors first; false: trust the predicted motion");
    v.field("gate_px", gate_px, "descriptors are compared within this distance of the predicted place", at_least(1));
    v.field("max_descriptor_distance", max_descriptor_distance, "of unit vectors", between(0, 2));
    v.field("descriptor_ratio", descriptor_ratio, "best over second best distance", between(0, 1));
    v.field("correlation", correlation, "re-establish the place of a landmark by correlating its image patch");
    v.field("min_correlation", min_correlation, "least normalised correlation with the landmark's patch",
            between(0, 1));
    v.field("correlation_reach_px", correlation_reach_px, "how far from the expected place a patch may be found",
            between(0.5, 100));
    v.field("max_scale_change", max_scale_change, "a landmark that looks larger or smaller by more gets a new patch",
            between(1, 4));
    v.field("narrow_stereo_px", narrow_stereo_px, "stereo search around the predicted disparity, to either side",
            between(1, 100));
    v.field("rigidity", rigidity, "drop matches whose 3D distances to others have changed");
  }
};

struct MotionEstimationOptions {
  int ransac_rounds = 200;
  double coarse_tolerance_px = 3.0;
  double pixel_sigma_px = 0.10;
  double disparity_sigma_px = 0.10;
  double inlier_sigmas = 4.0;
  bool robust = true;
  double offset_sigma_px = 0.15;
  double offset_drift_px = 0.005;
  int min_inliers = 12;
  int few_inliers = 40;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("ransac_rounds", ransac_rounds, "samples of three landmarks for the first 3D-3D fit", between(1, 100000));
    v.field("coarse_tolerance_px", coarse_tolerance_px, "largest residual of an inlier of that fit", at_least(0.1));
    v.field("pixel_sigma_px", pixel_sigma_px, "least standard deviation of a correlated position", between(0.001, 10));
    v.field("disparity_sigma_px", disparity_sigma_px, "least standard deviation of a disparity", between(0.001, 10));
    v.field("inlier_sigmas", inlier_sigmas, "largest normalised residual of an inlier", between(1, 100));
    v.field("robust", robust, "Cauchy weights instead of least squares");
    v.field("offset_sigma_px", offset_sigma_px,
            "how wrong the calibration may be in all disparities alike; estimated along with the motion; 0: right",
            between(0, 10));
    v.field("offset_drift_px", offset_drift_px, "by how much that may change from shot to shot", between(0, 10));
    v.field("min_inliers", min_inliers, "with fewer the rover is lost", between(6, 10000));
    v.field("few_inliers", few_inliers, "with fewer the estimate is degraded", between(6, 10000));
  }
};

struct StandingOptions {
  bool detect = true;
  double max_flow_px = 0.25;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("detect", detect, "hold the pose while the rover stands");
    v.field("max_flow_px", max_flow_px, "largest mean shift of the landmarks since the rover stopped", between(0, 10));
  }
};

struct OdometryOptions {
  DetectionOptions detection;
  LandmarkReconstructionOptions reconstruction;
  LandmarkMatchingOptions matching;
  MotionEstimationOptions motion;
  StandingOptions standing;

  template <class Visitor>
  void describe(Visitor& v) {
    v.group("detection", detection);
    v.group("reconstruction", reconstruction);
    v.group("matching", matching);
    v.group("motion", motion);
    v.group("standing", standing);
  }
};

}  // namespace spartan
