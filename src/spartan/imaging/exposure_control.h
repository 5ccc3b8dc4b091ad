// Exposure control: chooses exposure time and gain of a stereo pair by the ground in its images.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/options.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan {

struct ExposureOptions {
  bool enabled = true;            ///< of a live stream whose cameras can be controlled
  double level_percent = 30;      ///< median of the ground, % of full scale
  double highlight_percent = 95;  ///< most for the 98th percentile of the ground, % of full scale
  double most_blur_px = 1;        ///< px; largest motion during an exposure, where gain can replace it
  double shortest_us = 20;        ///< µs
  double longest_us = 20000;      ///< µs
  double largest_gain = 16;       ///< beyond it only a longer exposure makes images brighter
  double tolerance_percent = 12;  ///< of the brightness; smaller deviations change nothing

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled,
            "True chooses exposure and gain of live cameras that can be controlled; false leaves them to the cameras.");
    v.field("level_percent", level_percent,
            "Level in % of full scale that the median of the ground is brought to; raising it gives less noise and "
            "saturates more of the image.",
            between(1, 90));
    v.field("highlight_percent", highlight_percent,
            "Level in % of full scale that the 98th percentile of the ground does not exceed, as long as the median is "
            "not below a third of level_percent; lowering it keeps more of bright stones.",
            between(1, 100));
    v.field("most_blur_px", most_blur_px,
            "Motion in px of the nearest ground during an exposure above which the gain is raised instead; raising it "
            "gives less noise and more motion blur.",
            between(0.01, 100));
    v.field("shortest_us", shortest_us, "Shortest exposure of the cameras in microseconds.", between(1, 1e6));
    v.field("longest_us", longest_us, "Longest exposure of the cameras in microseconds.", between(1, 1e7));
    v.check("longest_us", longest_us >= shortest_us, "must be at least shortest_us");
    v.field(
        "largest_gain", largest_gain,
        "Gain above which the exposure is extended beyond most_blur_px; raising it gives more noise and less motion "
        "blur in the dark.",
        between(1, 1000));
    v.field(
        "tolerance_percent", tolerance_percent,
        "Deviation of the brightness in % up to which exposure and gain stay the same; raising it changes them less "
        "often.",
        between(0, 100));
  }
};

/// Brightness of the ground in both images of a frame, as fractions of full scale.
struct GroundBrightness {
  double median = 0, high = 0;  ///< the 98th percentile
  double saturated = 0;         ///< share of the pixels at full scale
  double ground = 0;            ///< share of the image that is ground
};

/// Measures pixels of the ground: those that look at least 3° below the horizon and are not in the camera's self-mask;
/// all unmasked ones where that are less than 5 %.
class GroundMeter {
 public:
  /// Code `configuration`: the self-mask cannot be read or has not the camera's size.
  static Result<GroundMeter> create(const Rig& rig, const StereoPair& pair, const std::string& mask_folder);

  /// `up_in_body`: unit vector.
  GroundBrightness measure(const StereoFrame& frame, const Eigen::Vector3d& up_in_body) const;

 private:
  struct Probe {
    int x = 0, y = 0;
    Eigen::Vector3f direction;  // in the camera
  };
  struct Side {
    std::string camera;
    std::vector<Probe> probes;
  };

  Rig rig_;
  Side left_, right_;
};

/// Settings that bring the ground of the next image to its level. The product of exposure time and gain follows from
/// that of the measured frame itself, so frames that are still on their way when a setting changes do not make it
/// oscillate. It relies on the settings that are stated for a frame: where they are later ones, it does.
class ExposureControl {
 public:
  explicit ExposureControl(const ExposureOptions& options) : options_(options) {}

  /// `taken`: the settings of the frame that was measured; `motion_px_s`: image motion of the nearest ground; `bounds`:
  /// of the cameras, beside those of the options. Empty: no change.
  std::optional<ExposureSettings> update(const GroundBrightness& ground, const ExposureSettings& taken,
                                         double motion_px_s, const ExposureBounds& bounds = {}) const;

 private:
  double brightness_factor(const GroundBrightness& ground) const;
  ExposureSettings split(double product_us, double motion_px_s, const ExposureBounds& cameras) const;

  ExposureOptions options_;
};

/// Image motion in px/s of ground at the nearest distance of a pair, by speed and turning rate of the body:
/// f (v / nearest + ω).
double ground_motion_px_s(const Rig& rig, const StereoPair& pair, const Vector6d& body_velocity);

}  // namespace spartan
