#include "spartan/sim/scenario.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "spartan/core/pose.h"

namespace spartan::sim {
namespace {

constexpr double kEdge_m = 10;  // minimum distance of the path from the edge of the terrain

// Collects errors with the line of their key.
class KeyErrors {
 public:
  KeyErrors(const std::string& text, const std::string& name) : text_(text), name_(name) {}
  void add(const std::string& key, const std::string& what) {
    if (!lines_.empty()) lines_ += '\n';
    lines_ += option_location(text_, name_, key);
    lines_ += ": ";
    lines_ += what;
  }
  Status status() const { return lines_.empty() ? Status{} : Status(failure(ErrorCode::configuration, lines_)); }

 private:
  const std::string& text_;
  const std::string& name_;
  std::string lines_;
};

}  // namespace

Result<OptionsRead<Scenario>> read_scenario(const std::string& text, const std::string& name) {
  auto scenario = read_options<Scenario>(text, name);
  if (!scenario) {
    scenario.error().hint =
        "docs/reference/scenario.md has an example; truth/scenario.yaml of a simulated recording lists every key";
  }
  return scenario;
}

Result<Scenario> parse_scenario(const std::string& text, const std::string& name) {
  auto read = read_scenario(text, name);
  if (!read) return failure(read);
  return std::move(read->options);
}

Result<Drive> plan_drive(const Scenario& scenario, const Rig& rig, const std::string& text, const std::string& name) {
  KeyErrors errors(text, name);
  for (const CameraFault& fault : scenario.camera_faults) {
    if (!fault.pair.empty() && !rig.find_pair(fault.pair))
      errors.add("camera_faults", fmt::format("the rig '{}' has no pair named '{}'", rig.name, fault.pair));
  }
  if (Status s = errors.status(); !s) return failure(s);
  auto drive = Drive::plan(scenario.path, scenario.capture, rig);
  if (!drive) {
    const std::string key =
        drive.error().where.find('.') == std::string::npos ? "path." + drive.error().where : drive.error().where;
    return failure(ErrorCode::configuration, drive.error().what, option_location(text, name, key));
  }
  const double limit = scenario.extent_m / 2 - kEdge_m;
  for (const PlanarPose& at : drive->track()) {
    if (std::abs(at.x) <= limit && std::abs(at.y) <= limit) continue;
    errors.add(
        "path",
        fmt::format("leaves the terrain at ({:.1f}, {:.1f}) m: it reaches {} m from the start, less a margin of {} m "
                    "(shorten the path or raise extent_m)",
                    at.x, at.y, scenario.extent_m / 2, kEdge_m));
    break;
  }
  if (Status s = errors.status(); !s) return failure(s);
  return drive;
}

namespace {

// The model with its focal lengths scaled and its principal point moved, where it has such parameters.
CameraModel with_errors(const CameraModel& model, double focal_factor, double row_offset_px) {
  ModelParameters values = parameters(model);
  const std::vector<ModelParameterSpec> kinds = parameter_specs(model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i].key == "focal_px") {
      for (double& f : values[i]) f *= focal_factor;
    }
    if (kinds[i].key == "centre_px") values[i].back() += row_offset_px;
  }
  return with_parameters(model, values);
}

}  // namespace

Rig nominal_rig(const Rig& true_rig, const NominalRigOptions& options) {
  Rig rig = true_rig;
  for (const StereoPair& pair : true_rig.pairs) {
    for (Camera& camera : rig.cameras) {
      const bool right = camera.name == pair.right;
      if (!right && camera.name != pair.left) continue;
      camera.model = with_errors(camera.model, 1 + options.focal_percent / 100, right ? options.row_offset_px : 0);
      if (!right || options.yaw_deg == 0) continue;
      const Eigen::Quaterniond yaw(Eigen::AngleAxisd(options.yaw_deg * kRadiansPerDegree, Eigen::Vector3d::UnitY()));
      camera.mount_from_camera = camera.mount_from_camera * Pose::from_rotation(yaw);
    }
  }
  return rig;
}

}  // namespace spartan::sim
