// Exposure control of a live run.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/log.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/imaging/exposure_control.h"
#include "spartan/rig/rig.h"
#include "spartan/system/internal/exposure_lag.h"

namespace spartan::internal {

/// Of all frames so far.
struct ExposureStatistics {
  std::int64_t frames = 0;
  std::int64_t changes = 0;           ///< settings sent to the cameras
  std::int64_t saturated_frames = 0;  ///< more than kSaturated of the ground at full scale
  std::int64_t dark_frames = 0;       ///< the median of the ground below kDark of its level

  static constexpr double kSaturated = 0.05, kDark = 0.25;
};

/// Sets the exposure of each pair by the ground in its frames.
class ExposureStage {
 public:
  /// `control` is borrowed. Errors: GroundMeter::create().
  static Result<ExposureStage> create(const Rig& rig, const ExposureOptions& options, const std::string& mask_folder,
                                      CameraControl& control, const Log& log);

  /// `body_velocity`: as Pipeline::body_velocity(). Where the cameras refuse a setting, the first refusal is logged.
  void update(const StereoFrame& frame, const Eigen::Vector3d& up_in_body, const Vector6d& body_velocity);
  const ExposureStatistics& statistics() const { return statistics_; }

 private:
  ExposureStage(const Rig& rig, const ExposureOptions& options, CameraControl& control, const Log& log)
      : rig_(rig), options_(options), exposure_(options), control_(control), log_(log) {}

  ExposureSettings taken_with(const std::string& pair, const GroundBrightness& ground, const ExposureSettings& stated);

  Rig rig_;
  ExposureOptions options_;
  ExposureControl exposure_;
  CameraControl& control_;
  Log log_;
  std::map<std::string, GroundMeter> meters_;  // of each pair
  std::map<std::string, ExposureLag> lags_;
  ExposureStatistics statistics_;
  bool refused_ = false;
};

}  // namespace spartan::internal
