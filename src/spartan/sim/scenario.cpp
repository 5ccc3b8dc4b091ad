#include "spartan/sim/scenario.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace spartan::sim {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
constexpr double kEdge_m = 10;  // the path keeps so far from the terrain's edge

// Collects complaints with the line of their key.
class Complaints {
 public:
  Complaints(const std::string& text, const std::string& name) : text_(text), name_(name) {}
  void add(const std::string& key, const std::string& what) {
    faults_ += (faults_.empty() ? "" : "\n") + place_of_option(text_, name_, key) + ": " + what;
  }
  Status status() const { return faults_.empty() ? Status{} : Status(failure(ErrorCode::configuration, faults_)); }

 private:
  const std::string& text_;
  const std::string& name_;
  std::string faults_;
};

template <class Faults>
void check_spans(const Faults& faults, const std::string& key, Complaints& complaints) {
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (!(faults[i].to_s > faults[i].from_s)) {
      complaints.add(key, fmt::format("item {} ends at {} s, not after its start at {} s", i + 1, faults[i].to_s,
                                      faults[i].from_s));
    }
  }
}

}  // namespace

Result<Scenario> parse_scenario(const std::string& text, const std::string& name) {
  auto scenario = parse_options<Scenario>(text, name);
  if (!scenario) {
    scenario.error().hint =
        "docs/formats.md has an example; truth/scenario.yaml of a simulated recording lists every key";
    return scenario;
  }
  Complaints complaints(text, name);
  constexpr std::array<int, 5> kGrids{1, 2, 4, 9, 16};
  if (std::find(kGrids.begin(), kGrids.end(), scenario->samples) == kGrids.end())
    complaints.add("samples", fmt::format("is {}, must be 1, 2, 4, 9 or 16", scenario->samples));
  if (scenario->light.sun_lux <= 0 && scenario->light.sky_lux <= 0)
    complaints.add("light", "there is none: sun_lux and sky_lux are both 0");
  if (!(scenario->rocks.largest_m > scenario->rocks.smallest_m)) {
    complaints.add("rocks", fmt::format("largest_m ({}) must be above smallest_m ({})", scenario->rocks.largest_m,
                                        scenario->rocks.smallest_m));
  }
  check_spans(scenario->sensor_faults, "sensor_faults", complaints);
  check_spans(scenario->camera_faults, "camera_faults", complaints);
  if (Status s = complaints.status(); !s) return failure(s);
  return scenario;
}

Result<Drive> plan_drive(const Scenario& scenario, const Rig& rig, const std::string& text, const std::string& name) {
  Complaints complaints(text, name);
  for (const CameraFault& fault : scenario.camera_faults) {
    if (!fault.pair.empty() && !rig.find_pair(fault.pair))
      complaints.add("camera_faults", fmt::format("the rig '{}' has no pair '{}'", rig.name, fault.pair));
  }
  if (Status s = complaints.status(); !s) return failure(s);
  auto drive = Drive::plan(scenario.path, scenario.shots, rig);
  if (!drive) {
    const std::string key =
        drive.error().where.find('.') == std::string::npos ? "path." + drive.error().where : drive.error().where;
    return failure(ErrorCode::configuration, drive.error().what, place_of_option(text, name, key));
  }
  const double reach = scenario.extent_m / 2 - kEdge_m;
  for (const PlanarPose& at : drive->track()) {
    if (std::abs(at.x) <= reach && std::abs(at.y) <= reach) continue;
    complaints.add("path",
                   fmt::format("leaves the terrain at ({:.1f}, {:.1f}) m: {} m around the start, less {} m at the edge "
                               "(shorten the path or raise extent_m)",
                               at.x, at.y, scenario.extent_m / 2, kEdge_m));
    break;
  }
  if (Status s = complaints.status(); !s) return failure(s);
  return drive;
}

namespace {

// The model with its focal lengths scaled and its centre moved, where it has such numbers.
CameraModel changed(const CameraModel& model, double focal_factor, double rows_px) {
  ModelParameters numbers = parameters(model);
  const std::vector<ModelParameterKind> kinds = parameter_kinds(model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i].key == "focal_px") {
      for (double& f : numbers[i]) f *= focal_factor;
    }
    if (kinds[i].key == "centre_px") numbers[i].back() += rows_px;
  }
  return with_parameters(model, numbers);
}

}  // namespace

Rig believed_rig(const Rig& true_rig, const BelievedOptions& believed) {
  Rig rig = true_rig;
  for (const StereoPair& pair : true_rig.pairs) {
    for (Camera& camera : rig.cameras) {
      const bool right = camera.name == pair.right;
      if (!right && camera.name != pair.left) continue;
      camera.model = changed(camera.model, 1 + believed.focal_percent / 100, right ? believed.rows_px : 0);
      if (!right || believed.yaw_deg == 0) continue;
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(believed.yaw_deg * kRadiansPerDegree, Eigen::Vector3d::UnitY()));
      camera.mount_from_camera = camera.mount_from_camera * Pose::from_rotation(turn);
    }
  }
  return rig;
}

}  // namespace spartan::sim
