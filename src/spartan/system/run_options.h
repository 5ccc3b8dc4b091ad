// Every option of a run, as one tree (`spartan config dump`).
#pragma once

#include <string>

#include "spartan/core/options.h"
#include "spartan/imaging/imager.h"
#include "spartan/localization/localization_options.h"
#include "spartan/odometry/odometry_options.h"
#include "spartan/reconstruction/disparity_options.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/slam/slam_options.h"

namespace spartan {

/// When and how the ground is reconstructed along the way.
struct TerrainOptions {
  bool enabled = true;
  double every_m = 5.0;
  int point_step_px = 2;
  double largest_range_error = 0.05;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "false: the trajectory only");
    v.field("every_m", every_m, "distance between two terrain pictures; the first frame always gives one", at_least(0));
    v.field("point_step_px", point_step_px, "every so many columns and rows give a point of the cloud", between(1, 64));
    v.field("largest_range_error", largest_range_error,
            "points whose range is off by more than this share at 0.3 px of disparity are left out", between(0.001, 1));
  }
};

struct RunOptions {
  double gravity_m_s2 = 0;
  bool noise_as_stated = true;
  std::string odometry_pair;
  bool odometry_only = false;
  ImagingOptions imaging;
  OdometryOptions odometry;
  DisparityOptions reconstruction;
  MappingOptions mapping;
  bool maps = true;
  SlamOptions slam;
  LocalizationOptions localization;
  TerrainOptions terrain;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("gravity_m_s2", gravity_m_s2,
            "9.81 on Earth, 3.71 on Mars; the IMU's mean must agree within 5 %; 0: as the recording says, else 9.81",
            between(0, 30));
    v.field(
        "noise_as_stated", noise_as_stated,
        "what the recording states of its sensors' noise and biases stands in the place of localization's defaults");
    v.field("odometry_pair", odometry_pair, "which pair drives the odometry; empty: the rig's first one made for it");
    v.field("odometry_only", odometry_only,
            "true runs the visual odometry alone: no localization, no maps, no SLAM and no terrain; the start attitude "
            "is still measured");
    v.group("imaging", imaging);
    v.group("odometry", odometry);
    v.group("reconstruction", reconstruction);
    v.field("maps", maps, "a map wherever the rover stands and further pairs look around; false: none");
    v.group("mapping", mapping);
    v.group("slam", slam);
    v.group("localization", localization);
    v.group("terrain", terrain);
  }
};

}  // namespace spartan
