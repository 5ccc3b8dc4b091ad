// A scenario: everything that defines a simulated drive.
#pragma once

#include <string>

#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/drive.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim {

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
  TerrainShapeOptions terrain;
  RockFieldOptions rocks;
  SoilOptions soil;
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
    v.field("rig", rig, "Name of a shipped rig, or of a file beside the scenario.");
    v.field("gravity_m_s2", gravity_m_s2, "Gravity in metres per second squared (Mars: 3.71).", between(0.1, 30));
    v.field("extent_m", extent_m, "Side in metres of the square of terrain around the start.", between(20, 20000));
    v.renamed("believed", "nominal_rig");
    v.group("nominal_rig", nominal_rig);
    v.group("terrain", terrain);
    v.group("rocks", rocks);
    v.group("soil", soil);
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
    v.group("truth", truth);
  }
};

/// Reads a scenario. Reports all faults of keys at once, then inconsistent values: a number of samples that is no
/// grid, faults that end before they begin, no light at all. Errors: `configuration`, each with its line.
Result<Scenario> parse_scenario(const std::string& text, const std::string& name);
/// Plans the drive and checks what depends on the rig: pairs named by faults, stops beyond the path, a path that leaves
/// the terrain. Errors: `configuration`, with the line in `text`.
Result<Drive> plan_drive(const Scenario& scenario, const Rig& rig, const std::string& text, const std::string& name);

/// The nominal rig that the recording states: the true one with the errors of the options.
Rig nominal_rig(const Rig& true_rig, const NominalRigOptions& options);

}  // namespace spartan::sim
