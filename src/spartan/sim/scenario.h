// A scenario: everything a simulated drive is made from.
#pragma once

#include <string>

#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/body_motion.h"
#include "spartan/sim/drive.h"
#include "spartan/sim/faults.h"
#include "spartan/sim/light.h"
#include "spartan/sim/motion_sensors.h"
#include "spartan/sim/path.h"
#include "spartan/sim/rock_field.h"
#include "spartan/sim/sensor.h"
#include "spartan/sim/soil.h"
#include "spartan/sim/terrain_shape.h"

namespace spartan::sim {

/// How far the rig as believed is from the true one. Errors of the right eye relative to the left one, but for the
/// focal length, which is wrong in both.
struct BelievedOptions {
  double yaw_deg = 0;
  double rows_px = 0;
  double focal_percent = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("yaw_deg", yaw_deg, "turn of the right eye about its y axis", between(-5, 5));
    v.field("rows_px", rows_px, "shift of the right eye's centre in rows", between(-50, 50));
    v.field("focal_percent", focal_percent, "of the focal lengths", between(-20, 20));
  }
};

struct TruthOptions {
  bool disparity = true;
  double cell_m = 0.02;
  double obstacle_m = 0.1;
  double cavity_m = 0.1;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("disparity", disparity, "write the true disparity of every shot");
    v.field("cell_m", cell_m, "of elevation.tif and obstacles.tif", between(0.005, 1));
    v.field("obstacle_m", obstacle_m, "what stands higher over the rock-free ground is an obstacle", between(0.01, 5));
    v.field("cavity_m", cavity_m, "what lies deeper below the ground without cavities is one", between(0.01, 5));
  }
};

struct Scenario {
  int schema = 1;
  std::string name;
  std::string description;
  int seed = 1;
  int samples = 4;
  std::string rig = "rover_square";
  double gravity_m_s2 = 3.71;
  double extent_m = 240;
  BelievedOptions believed;
  TerrainShapeOptions terrain;
  RockFieldOptions rocks;
  SoilOptions soil;
  LightOptions light;
  SensorOptions sensor;
  PathOptions path;
  ShotOptions shots;
  ChassisOptions chassis;
  ImuOptions imu;
  WheelOptions wheels;
  CompassOptions compass;
  InclinometerOptions inclinometer;
  SensorFaults sensor_faults;
  CameraFaults camera_faults;
  TruthOptions truth;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("schema", schema, "version of this format", between(1, 1));
    v.field("name", name, "a name for people");
    v.field("description", description, "what it is for");
    v.field("seed", seed, "of all chance", at_least(0));
    v.field("samples", samples, "rays a pixel: 1, 2, 4, 9 or 16", between(1, 16));
    v.field("rig", rig, "a shipped rig's name, or a file beside the scenario");
    v.field("gravity_m_s2", gravity_m_s2, "of the planet", between(0.1, 30));
    v.field("extent_m", extent_m, "side of the square of terrain around the start", between(20, 20000));
    v.group("believed", believed);
    v.group("terrain", terrain);
    v.group("rocks", rocks);
    v.group("soil", soil);
    v.group("light", light);
    v.group("sensor", sensor);
    v.group("path", path);
    v.group("shots", shots);
    v.group("chassis", chassis);
    v.group("imu", imu);
    v.group("wheels", wheels);
    v.group("compass", compass);
    v.group("inclinometer", inclinometer);
    v.list("sensor_faults", sensor_faults, "sensors that fail for a while");
    v.list("camera_faults", camera_faults, "pictures that go wrong");
    v.group("truth", truth);
  }
};

/// Reads a scenario; all faults of keys at once, then what does not fit together: samples that are no grid, faults that
/// end before they begin or name no pair of the rig, a path that leaves the terrain. Code `configuration`, with the
/// line.
Result<Scenario> parse_scenario(const std::string& text, const std::string& name);
/// What needs the rig: its pairs, the drive.
Result<Drive> plan_drive(const Scenario& scenario, const Rig& rig, const std::string& text, const std::string& name);

/// The rig that the rover believes it has.
Rig believed_rig(const Rig& true_rig, const BelievedOptions& believed);

}  // namespace spartan::sim
