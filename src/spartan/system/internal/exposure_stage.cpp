#include "spartan/system/internal/exposure_stage.h"

#include <fmt/format.h>

namespace spartan::internal {

Result<ExposureStage> ExposureStage::create(const Rig& rig, const ExposureOptions& options,
                                            const std::string& mask_folder, CameraControl& control, const Log& log) {
  ExposureStage stage(rig, options, control, log);
  for (const StereoPair& pair : rig.pairs) {
    auto meter = GroundMeter::create(rig, pair, mask_folder);
    if (!meter) return failure(meter);
    stage.meters_.emplace(pair.name, std::move(*meter));
  }
  return stage;
}

void ExposureStage::update(const StereoFrame& frame, const Eigen::Vector3d& up_in_body, const Vector6d& body_velocity) {
  const auto meter = meters_.find(frame.pair);
  if (meter == meters_.end()) return;
  const GroundBrightness ground = meter->second.measure(frame, up_in_body);
  ++statistics_.frames;
  statistics_.saturated_frames += ground.saturated > ExposureStatistics::kSaturated;
  statistics_.dark_frames += ground.median < ExposureStatistics::kDark * 0.01 * options_.level_percent;
  const double motion_px_s = ground_motion_px_s(rig_, *rig_.find_pair(frame.pair), body_velocity);
  const ExposureSettings stated{frame.exposure_us, frame.gain};
  const auto settings = exposure_.update(ground, taken_with(frame.pair, ground, stated), motion_px_s,
                                         control_.exposure_bounds(frame.pair));
  // A frame that was taken with older settings than it states may ask again for what is set.
  if (!settings || (settings->exposure_us == stated.exposure_us && settings->gain == stated.gain)) return;
  ++statistics_.changes;
  const Status set = control_.set_exposure(frame.pair, *settings);
  if (!set && !refused_) log_.warning("the exposure is not controlled: " + set.error().message());
  refused_ = refused_ || !set;
}

ExposureSettings ExposureStage::taken_with(const std::string& pair, const GroundBrightness& ground,
                                           const ExposureSettings& stated) {
  ExposureLag& lag = lags_[pair];
  const std::size_t before = lag.lag();
  const ExposureSettings taken = lag.add(ground, stated);
  if (lag.lag() != before) {
    log_.info(
        fmt::format("pair {}: frames state exposure settings {} frames before they have effect", pair, lag.lag()));
  }
  return taken;
}

}  // namespace spartan::internal
