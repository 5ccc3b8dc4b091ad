// A scenario that is simulated in a second or two.
#pragma once

namespace spartan::testing {

/// To be written as small_rig.yaml beside the scenario.
inline constexpr const char* kSmallRig = R"(schema: 1
name: small
pan_tilt_units:
  mast: {translation_m: [0, 0, 0.8], rest_angles_deg: [0, 65]}
cameras:
  wl: {size_px: [96, 96], model: pinhole, focal_px: [130, 130], centre_px: [47.5, 47.5], mount: mast, axes: forward, translation_m: [0, 0.1, 0]}
  wr: {size_px: [96, 96], model: pinhole, focal_px: [130, 130], centre_px: [47.5, 47.5], mount: mast, axes: forward, translation_m: [0, -0.1, 0]}
  nl: {size_px: [96, 72], model: pinhole, focal_px: [100, 100], centre_px: [47.5, 35.5], axes: forward, translation_m: [0, 0.06, 0.3], roll_pitch_yaw_deg: [0, 60, 0]}
  nr: {size_px: [96, 72], model: pinhole, focal_px: [100, 100], centre_px: [47.5, 35.5], axes: forward, translation_m: [0, -0.06, 0.3], roll_pitch_yaw_deg: [0, 60, 0]}
pairs:
  wide: {left: wl, right: wr, nearest_m: 0.6, for_odometry: false}
  narrow: {left: nl, right: nr, nearest_m: 0.25}
)";

inline constexpr const char* kSmallScenario = R"(schema: 1
name: small
samples: 1
rig: small_rig.yaml
path: {length_m: 0.3}
capture: {stops_m: [0]}
rocks: {share: 0.03}
truth: {cell_m: 0.1}
)";

}  // namespace spartan::testing
