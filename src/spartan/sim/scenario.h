// A scenario: everything that defines a simulated drive.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/scenario_options.h"
#include "spartan/sim/sensor_options.h"

namespace spartan::sim {

/// Position and heading in the world plane; the heading is counter-clockwise from x.
struct PlanarPose {
  double x = 0, y = 0, heading = 0;  ///< m, m, rad
};

/// One uninterrupted motion: driving along a curve, turning in place, or being stationary.
/// The speed profile is twice continuously differentiable and begins and ends at zero.
class Motion {
 public:
  static constexpr double kStep_m = 0.01;  ///< m; spacing of a curve's points
  static Motion stationary(const PlanarPose& at, double seconds);
  static Motion turn(const PlanarPose& at, double angle_rad, double rate_rad_s, double ramp_s);
  /// Along points spaced kStep_m; the last step may be shorter.
  static Motion drive(std::vector<PlanarPose> curve, double speed_m_s, double ramp_s);

  double seconds() const { return seconds_; }
  /// Metres driven, or radians turned, at a time since the start of the motion.
  double progress(double t) const;
  PlanarPose at(double t) const;
  bool drives() const { return !curve_.empty(); }
  /// Metres or radians of the whole motion.
  double amount() const { return amount_; }
  /// The time at which a progress is reached, to 1 µs.
  double time_of(double target_progress) const;

 private:
  PlanarPose start_;
  std::vector<PlanarPose> curve_;
  double amount_ = 0, turn_sign_ = 1;  // metres or radians
  double rate_ = 0, ramp_s_ = 0, seconds_ = 0;
};

/// A curve to drive, a turn in place, or a pause.
struct PathLeg {
  std::vector<PlanarPose> curve;  ///< empty: a turn in place or a pause
  double turn_rad = 0;
  double rest_s = 0;
};
/// The legs of a path in order. Errors: `configuration` for waypoints that make no path.
Result<std::vector<PathLeg>> lay_path(const PathOptions& options);

/// Driven length of a curve.
double curve_length(const std::vector<PlanarPose>& curve);
/// The first `metres` of a curve, and the remainder.
std::pair<std::vector<PlanarPose>, std::vector<PlanarPose>> cut(const std::vector<PlanarPose>& curve, double metres);

/// One stereo frame of one pair.
struct PlannedFrame {
  double time_s = 0;  ///< middle of the exposure
  std::string pair;
  std::int64_t position_id = 0;  ///< shared by all frames taken at one place
  double pan_rad = 0, tilt_rad = 0;
};

/// Planar motion over time and the frames to take. A rover that follows it exactly is simulated by BodyMotion.
class Drive {
 public:
  /// Lays the path and plans the frames of the rig's pairs. Errors: `configuration` for a path that cannot be built, or
  /// that is shorter than the distance of a stop.
  static Result<Drive> plan(const PathOptions& path, const CaptureOptions& capture, const Rig& rig);

  double seconds() const { return seconds_; }
  /// Planar pose at a time, clamped to the drive.
  PlanarPose at(double time_s) const;
  /// In order of time.
  const std::vector<PlannedFrame>& frames() const { return frames_; }
  /// Points along the driven path, at most 2 · Motion::kStep_m apart.
  std::vector<PlanarPose> track() const;

 private:
  struct Segment {
    double from_s;
    Motion motion;
  };
  class Planner;
  std::vector<Segment> segments_;
  std::vector<PlannedFrame> frames_;
  double seconds_ = 0;
};

/// The contents of scenario.yaml.
struct Scenario {
  int schema = 1;
  std::string name;
  std::string description;
  int seed = 1;
  int samples = 4;                   ///< rays per pixel
  std::string rig = "rover_square";  ///< a shipped rig's name, or a file beside the scenario
  double gravity_m_s2 = 3.71;        ///< m/s²
  double extent_m = 240;             ///< m; side of the square of terrain around the start
  NominalRigOptions nominal_rig;
  RoverGrade rover = RoverGrade::exact;
  RoverErrorOptions rover_errors;  ///< what a file does not give follows from `rover`, as sensor.jpeg_quality
  TerrainShapeOptions terrain;
  RockFieldOptions rocks;
  SoilOptions soil;
  GroundCoverOptions cover;
  LightOptions light;
  SensorOptions sensor;
  PathOptions path;
  CaptureOptions capture;
  ChassisOptions chassis;
  ImuOptions imu;
  WheelOptions wheels;
  CompassOptions compass;
  InclinometerOptions inclinometer;
  SensorFaults sensor_faults;
  CameraFaults camera_faults;
  ArrivalOptions arrival;
  TruthOptions truth;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("schema", schema, "Version of this format.", between(1, 1));
    v.field("name", name, "Name of the scenario, for people.");
    v.field("description", description, "Purpose of the scenario, for people.");
    v.field("seed", seed, "Seed of all random numbers; another one gives another world and other noise.", at_least(0));
    v.field("samples", samples,
            "Rays per pixel: 1, 2, 4, 9 or 16; more rays give less aliasing and take proportionally longer.",
            between(1, 16));
    v.check("samples", samples == 1 || samples == 2 || samples == 4 || samples == 9 || samples == 16,
            "must be 1, 2, 4, 9 or 16");
    v.field("rig", rig, "Name of a shipped rig, or of a file beside the scenario.");
    v.field("gravity_m_s2", gravity_m_s2, "Gravity in metres per second squared (Mars: 3.71).", between(0.1, 30));
    v.field("extent_m", extent_m, "Side in metres of the square of terrain around the start.", between(20, 20000));
    v.renamed("believed", "nominal_rig");
    v.group("nominal_rig", nominal_rig);
    v.field("rover", rover,
            "How well the rover is built and calibrated: sets the values of rover_errors and sensor.jpeg_quality that "
            "are not given.");
    v.group("rover_errors", rover_errors);
    v.group("terrain", terrain);
    v.group("rocks", rocks);
    v.group("soil", soil);
    v.group("cover", cover);
    v.group("light", light);
    v.group("sensor", sensor);
    v.group("path", path);
    v.renamed("shots", "capture");
    v.group("capture", capture);
    v.group("chassis", chassis);
    v.group("imu", imu);
    v.group("wheels", wheels);
    v.group("compass", compass);
    v.group("inclinometer", inclinometer);
    v.list("sensor_faults", sensor_faults, "Intervals in which motion sensors fail.");
    v.list("camera_faults", camera_faults, "Intervals in which cameras fail.");
    v.group("arrival", arrival);
    v.group("truth", truth);
  }
};

/// Reads a scenario; the warnings name former keys. All errors are reported at once, each with its line, inconsistent
/// values included: a number of samples that is no grid, faults that end before they begin, no light at all. Code
/// `configuration`.
Result<OptionsRead<Scenario>> read_scenario(const std::string& text, const std::string& name);
/// The scenario alone.
Result<Scenario> parse_scenario(const std::string& text, const std::string& name);
/// Plans the drive and checks what depends on the rig: pairs named by faults, stops beyond the path, a path that leaves
/// the terrain. Errors: `configuration`, with the line in `text`.
Result<Drive> plan_drive(const Scenario& scenario, const Rig& rig, const std::string& text, const std::string& name);

/// Applies one assignment "group.key=value" of a command line. `rover` and `imu.grade` set all keys that follow from
/// them; single ones are to be assigned after them. Errors have code `usage`.
Result<Scenario> set_scenario_option(Scenario scenario, const std::string& assignment);

/// The nominal rig that the recording states: the rig of the scenario with fixed errors.
Rig nominal_rig(const Rig& rig, const NominalRigOptions& options);
/// What the recording states about the errors of its calibration: the standard deviations of the draws.
CalibrationErrors calibration_errors(const RoverErrorOptions& errors);
/// The rig that takes the images, at the start of the drive: the rig of the scenario with a draw of its errors.
Rig true_rig(const Rig& rig, const RoverErrorOptions& errors, int scenario_seed);
/// The drawn response of a camera of the rig to light; 1 without errors.
double camera_gain(const Rig& rig, const std::string& camera, const RoverErrorOptions& errors, int scenario_seed);

}  // namespace spartan::sim
