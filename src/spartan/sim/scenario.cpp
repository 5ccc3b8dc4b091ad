#include "spartan/sim/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <type_traits>
#include <vector>

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

// Visitor that lists the numbers of a group, or sets those that were not given.
class Numbers {
 public:
  void field(std::string_view, double& value, std::string_view, Bounds = {}) { values_.push_back(value); }
  template <class Other, class... Rest>
    requires(!std::is_same_v<Other, double>)
  void field(std::string_view, Other&, std::string_view, Rest&&...) {}
  void check(std::string_view, bool, std::string_view) {}
  const std::vector<double>& values() const { return values_; }

 private:
  std::vector<double> values_;
};

class Completion {
 public:
  Completion(const GivenKeys& given, const std::vector<double>& values) : given_(given), next_(values.begin()) {}
  void field(std::string_view key, double& value, std::string_view, Bounds = {}) {
    if (!given_.contains(std::string(key))) value = *next_;
    ++next_;
  }
  template <class Other, class... Rest>
    requires(!std::is_same_v<Other, double>)
  void field(std::string_view, Other&, std::string_view, Rest&&...) {}
  void check(std::string_view, bool, std::string_view) {}

 private:
  const GivenKeys& given_;
  std::vector<double>::const_iterator next_;
};

// The numbers of `group` that were not given become those of `preset`.
template <class Group>
void complete(Group& group, Group preset, const GivenKeys& given) {
  Numbers numbers;
  preset.describe(numbers);
  Completion completion(given, numbers.values());
  group.describe(completion);
}

// What was not given follows from the grade of the rover.
void complete_rover(Scenario& scenario, const GivenKeys& given) {
  complete(scenario.rover_errors, rover_errors(scenario.rover), given.in_group("rover_errors"));
  if (!given.contains("sensor.jpeg_quality")) scenario.sensor.jpeg_quality = jpeg_quality(scenario.rover);
}

void complete_imu(Scenario& scenario, const GivenKeys& given) {
  if (scenario.imu.grade == ImuGrade::given) return;
  ImuOptions preset = imu_of_grade(scenario.imu.grade);
  preset.rate_hz = scenario.imu.rate_hz;
  complete(scenario.imu, preset, given.in_group("imu"));
}

}  // namespace

Result<OptionsRead<Scenario>> read_scenario(const std::string& text, const std::string& name) {
  auto read = read_options<Scenario>(text, name);
  if (!read) {
    read.error().hint =
        "docs/reference/scenario.md has an example; truth/scenario.yaml of a simulated recording lists every key";
    return read;
  }
  complete_rover(read->options, read->given);
  complete_imu(read->options, read->given);
  return read;
}

Result<Scenario> set_scenario_option(Scenario scenario, const std::string& assignment) {
  auto read = read_assignment(assignment, std::move(scenario));
  if (!read) return failure(read);
  if (read->given.contains("rover")) complete_rover(read->options, {});
  if (read->given.contains("imu.grade")) complete_imu(read->options, {});
  return std::move(read->options);
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

}  // namespace spartan::sim
