// All options of a run as one tree (`spartan config dump --all`).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "spartan/core/options.h"
#include "spartan/imaging/exposure_control.h"
#include "spartan/imaging/imager.h"
#include "spartan/localization/localization_options.h"
#include "spartan/odometry/odometer.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/rig/rig.h"
#include "spartan/slam/slam_options.h"

namespace spartan {

/// When the terrain along the path is reconstructed, and which points its clouds contain.
struct TerrainOptions {
  bool enabled = true;            ///< write terrain files
  double every_m = 5.0;           ///< path length between two terrain views, m; 0: every frame
  int point_step_px = 2;          ///< subsampling of the point cloud, px
  double max_range_error = 0.05;  ///< maximum relative range error of a point at 0.3 px of disparity error
  double max_range_m = 0;         ///< maximum distance of a point from the camera, m; 0: no limit
  int delay_frames = 10;          ///< frames from a view to the one with which it is delivered

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled,
            "True writes a disparity image and a point cloud of the terrain along the path; false omits them.");
    v.field("every_m", every_m,
            "Path length between two terrain views in metres, starting with the first frame; raising it writes fewer "
            "files and saves time, 0 writes one for every frame.",
            at_least(0));
    v.field("point_step_px", point_step_px,
            "Column and row step between the pixels that become points of the cloud, in pixels; raising it makes the "
            "point clouds smaller and sparser.",
            between(1, 64));
    v.renamed("largest_range_error", "max_range_error");
    v.field("max_range_error", max_range_error,
            "Maximum relative range error of a point of the cloud, for a disparity error of 0.3 px; raising it keeps "
            "more distant, less accurate points.",
            between(0.001, 1));
    v.field("max_range_m", max_range_m,
            "Maximum distance of a point of the cloud from the camera in metres; raising it keeps more distant points, "
            "0 keeps all that max_range_error allows.",
            at_least(0));
    v.field("delay_frames", delay_frames,
            "The back end computes the disparities of a view while the odometry goes on; they are delivered at most so "
            "many frames later. Raising it lets slow cores keep up; 0 waits for them.",
            between(0, 100));
  }
};

/// Of which frames local maps are made.
enum class MapSource : std::uint8_t {
  automatic,  ///< of stops where the rig (in run(): the recording) has another pair than that of the odometry, else of
              ///< keyframes
  stops,      ///< of the views of each stop
  keyframes,  ///< of single frames of the odometry pair while the rover drives
};
constexpr auto enum_names(MapSource) {
  return std::array{EnumName{MapSource::automatic, "auto"}, EnumName{MapSource::stops, "stops"},
                    EnumName{MapSource::keyframes, "keyframes"}};
}

/// When a frame of the odometry pair becomes a keyframe, of which a local map is made.
struct KeyframeOptions {
  double every_m = 0;       ///< distance from the last keyframe, m; 0: a quarter of the side of the map
  double turn_deg = 20;     ///< rotation since the last keyframe, degrees
  double new_ground = 0.4;  ///< fraction of the visible ground that the last keyframe did not see
  int delay_frames = 10;    ///< most frames between a keyframe and the frame whose pose its map corrects

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("every_m", every_m,
            "Distance from the last keyframe in metres at which a frame becomes a keyframe; raising it makes fewer "
            "maps that overlap less, and 0 takes a quarter of the side of the map.",
            at_least(0));
    v.field("turn_deg", turn_deg,
            "Rotation since the last keyframe in degrees at which a frame becomes a keyframe; raising it makes fewer "
            "maps in turns.",
            between(1, 180));
    v.field("new_ground", new_ground,
            "Fraction of the visible ground, as far as half of the side of the map, that the last keyframe did not see "
            "at which a frame becomes a keyframe; raising it makes fewer maps that overlap less.",
            between(0.01, 1));
    v.field(
        "delay_frames", delay_frames,
        "The map of a keyframe is made by one thread while the odometry goes on; its correction is applied to the pose "
        "at most so many frames after the keyframe. Raising it lets slow cores keep up, and corrects the pose later.",
        between(0, 100));
  }
};

/// Panoramas of a live run with a pan-tilt unit.
struct PanoramaOptions {
  double every_m = 0;  ///< m; path length from one to the next, the first at the start; 0: none
  std::vector<double> pans_deg = {-35, 0, 35};  ///< deg; positive to the left
  std::vector<double> tilts_deg;                ///< deg; positive downwards; empty: the rest angle of the unit
  double settle_s = 0.3;                        ///< s; from the end of a motion to the exposure
  double timeout_s = 30;                        ///< s; longest motion
  double frame_timeout_s = 2;                   ///< s; longest time to wait for a frame

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "every_m", every_m,
        "Path length in metres after which a live run takes a panorama as soon as the rover is stationary, the first "
        "at the start; 0 takes none by itself. Raising it gives fewer maps.",
        at_least(0));
    v.field("pans_deg", pans_deg,
            "Pan angles of a panorama in degrees, positive to the left; neighbouring views should overlap.",
            between(-180, 180));
    v.field(
        "tilts_deg", tilts_deg,
        "Tilt angles of a panorama in degrees, positive downwards, each with all pans; empty is the rest angle of the "
        "unit.",
        between(-90, 90));
    v.field(
        "settle_s", settle_s,
        "Seconds from the end of a motion to the exposure, at least the time that an image takes to arrive; raising "
        "it lets the mast stop swinging.",
        between(0, 60));
    v.field("timeout_s", timeout_s, "Seconds after which a motion of the unit has failed.", between(0.1, 600));
    v.field("frame_timeout_s", frame_timeout_s, "Seconds after which a frame that was triggered is triggered again.",
            between(0.1, 600));
  }
};

/// When run() writes to the disk, on a thread of its own.
struct CommitOptions {
  double every_s = 1;         ///< most seconds from a result to the end of its transaction
  double every_m = 0;         ///< path length after which results are committed at once, m; 0: no limit
  bool at_maps = true;        ///< commit at once where a map was applied
  double state_every_s = 30;  ///< seconds between two states from which the run can be resumed

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("every_s", every_s,
            "Seconds after which results are committed to run.sqlite at the latest; raising it writes less to the disk "
            "and loses more when the power fails, 0 commits each frame.",
            between(0, 3600));
    v.field("every_m", every_m,
            "Path length in metres after which results are committed before every_s has passed; raising it writes less "
            "to the disk, 0 sets no limit.",
            at_least(0));
    v.field("at_maps", at_maps,
            "True commits as soon as the map of a stop or keyframe is in the global map; false waits for every_s.");
    v.field("state_every_s", state_every_s,
            "Seconds between two states (about 1 MB) from which --resume continues; raising it writes less to the disk "
            "and lets a resumed run process more frames again.",
            between(0, 3600));
  }
};

/// The options of all modules, and which of them run.
struct RunOptions {
  double gravity_m_s2 = 0;          ///< magnitude of gravity, m/s²; 0: as the recording specifies, else 9.81
  bool use_specified_noise = true;  ///< sensor noise of the recording replaces defaults of `localization`
  std::string odometry_pair;        ///< name of the pair that drives the odometry; empty: the rig's choice
  bool odometry_only = false;       ///< run only the visual odometry
  bool align_rows = true;           ///< run(): correct pitch and roll between the cameras of a pair where rows differ
  ImagingOptions imaging;
  OdometryOptions odometry;
  DisparityOptions reconstruction;             ///< dense disparities of terrain and stops
  MappingOptions mapping;                      ///< local maps of stops or keyframes
  bool maps = true;                            ///< make local maps
  MapSource maps_from = MapSource::automatic;  ///< of which frames
  KeyframeOptions keyframes;
  int stop_delay_frames = 3;  ///< most frames from leaving a stop to the frame whose pose its map corrects
  SlamOptions slam;           ///< map matching and the global map
  LocalizationOptions localization;
  bool smoothed_trajectory = true;  ///< run(): smooth the localization after the last frame
  TerrainOptions terrain;
  double longest_wait_s = 2;  ///< of images of live cameras until they are processed, s; 0: no limit
  ExposureOptions exposure;   ///< of live cameras
  PanoramaOptions panorama;
  CommitOptions commit;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("gravity_m_s2", gravity_m_s2,
            "Magnitude of gravity in m/s² (9.81 on Earth, 3.71 on Mars), with which the mean of the accelerometer must "
            "agree within 5 %; 0 takes the value of the recording, or 9.81 if it has none.",
            between(0, 30));
    v.renamed("noise_as_stated", "use_specified_noise");
    v.field("use_specified_noise", use_specified_noise,
            "True lets the sensor noise and biases that the recording specifies replace the defaults of localization "
            "(not values that are set explicitly); false ignores them.");
    v.field("odometry_pair", odometry_pair,
            "Name of the stereo pair used for visual odometry; empty selects the first pair with "
            "`for_odometry: true` in the rig file.");
    v.field("odometry_only", odometry_only,
            "True runs the visual odometry alone, without localization, maps, SLAM and terrain (initial roll and "
            "pitch are still taken from the IMU); false runs all stages.");
    v.field("align_rows", align_rows,
            "True estimates pitch and roll between the cameras of each stereo pair from the first frames of the "
            "recording, and corrects the calibration where rows of the two images differ by more than 0.3 px; false "
            "keeps the calibration as given.");
    v.group("imaging", imaging);
    v.group("odometry", odometry);
    v.group("reconstruction", reconstruction);
    v.field("maps", maps,
            "True builds local maps and merges them into the global map; false makes no maps, so map matching never "
            "corrects the poses.");
    v.field("maps_from", maps_from,
            "Frames of which local maps are made: stops merges all views of each stop that has views of a stereo pair "
            "other than the odometry pair, keyframes maps single frames of the odometry pair while the rover drives, "
            "auto takes stops where the recording has frames of another pair, else keyframes.");
    v.group("keyframes", keyframes);
    v.field("stop_delay_frames", stop_delay_frames,
            "The back end makes the map of a stop while the odometry goes on; its correction is applied to the pose at "
            "most so many frames after the rover left the stop. Raising it lets slow cores keep up, and corrects the "
            "pose later.",
            between(0, 1000));
    v.group("mapping", mapping);
    v.group("slam", slam);
    v.group("localization", localization);
    v.field("smoothed_trajectory", smoothed_trajectory,
            "True smooths the localization after the last frame, by all measurements of the run "
            "(trajectory_smoothed.tum); false saves the time and the memory for it (1 kB for each frame, 60 bytes for "
            "each sample of the IMU).");
    v.group("terrain", terrain);
    v.field(
        "longest_wait_s", longest_wait_s,
        "Seconds for which images of live cameras wait to be processed, at most; beyond them views of other pairs are "
        "dropped, and then frames of the odometry, so that poses are not older than this. Raising it drops fewer "
        "frames on a computer that is too slow for a time; 0 sets no limit but 256 MB of images. Replays and "
        "simulations drop nothing by it.",
        between(0, 3600));
    v.group("exposure", exposure);
    v.group("panorama", panorama);
    v.group("commit", commit);
  }
};

/// The options for a rig, with each quantity that is stated once copied to the modules that use it: the geometry of the
/// rover (Rig::rover) to traversal costs and wheel odometry, and with_shared_values(); no error of pan and tilt where
/// no pair is on a pan-tilt unit. Values of the modules that differ from their defaults (set in code or under a former
/// key) are retained.
RunOptions resolved_options(RunOptions options, const Rig& rig);

/// The stereo pair for visual odometry, borrowed from the rig; null where there is none.
const StereoPair* odometry_pair_of(const Rig& rig, const RunOptions& options);

/// "odometry.detection.landmarks was 1200, is 800; …": what differs, at most five options.
std::string option_differences(const RunOptions& before, const RunOptions& now);

/// Keys of the options that an operator needs, at most 30; the others are for experts.
std::span<const std::string_view> basic_options();

/// YAML of the basic options, and of the others that differ from their defaults, with descriptions as comments.
std::string dump_basic_options(const RunOptions& options);

}  // namespace spartan
