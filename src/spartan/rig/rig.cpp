#include "spartan/rig/rig.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

namespace spartan {
namespace {

bool equal_bits(const Pose& a, const Pose& b) {
  return a.rotation().coeffs() == b.rotation().coeffs() && a.translation() == b.translation();
}

template <class T>
const T* find_named(const std::vector<T>& all, const std::string& name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const T& item) { return item.name == name; });
  return found == all.end() ? nullptr : &*found;
}

// Interpolation needs two pixels; the 16-bit tables of the rectification address at most 32767.
constexpr int kSmallestSide = 2, kLargestSide = 32767;
// Larger than any distance to the Earth's centre: a file with such a position is damaged.
constexpr double kMaxDistance_m = 1e9;

class FaultFinder {
 public:
  explicit FaultFinder(const Rig& rig) : rig_(rig) {}

  std::vector<RigValidationError> run() && {
    check_names("pan_tilt_units", rig_.pan_tilt_units);
    check_names("cameras", rig_.cameras);
    check_names("pairs", rig_.pairs);
    if (rig_.pairs.empty()) add("pairs", "there is no stereo pair");
    check(rig_.rover);
    check_sensors();
    for (const PanTiltUnit& unit : rig_.pan_tilt_units) check(unit);
    for (const Camera& camera : rig_.cameras) check(camera);
    for (const StereoPair& pair : rig_.pairs) check(pair);
    return std::move(faults_);
  }

 private:
  void add(const std::string& key, const std::string& what) { faults_.push_back({key, what}); }

  // Names are used as folders of a recording and as names of coordinate frames.
  template <class T>
  void check_names(const std::string& key, const std::vector<T>& items) {
    std::set<std::string> seen;
    for (const T& item : items) {
      const bool plain = std::all_of(item.name.begin(), item.name.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
      });
      if (item.name.empty() || !plain) {
        add(fmt::format("{}.{}", key, item.name), "a name must consist of letters, digits, _ and -");
      } else if (!seen.insert(item.name).second) {
        add(fmt::format("{}.{}", key, item.name), "this name is used twice");
      }
    }
  }

  void check_pose(const std::string& key, const Pose& pose) {
    if (!pose.all_finite()) {
      add(key, "the pose has values that are not finite");
    } else if (!(pose.translation().norm() <= kMaxDistance_m)) {
      add(key, fmt::format("the position is farther than {} m from the mount", kMaxDistance_m));
    } else if (std::abs(pose.rotation().norm() - 1) > 1e-6) {
      add(key, "the quaternion does not have unit length");
    }
  }

  void check(const PanTiltUnit& unit) {
    const std::string key = "pan_tilt_units." + unit.name;
    if (unit.name == "body") add(key, "'body' is the name of the rover's own frame");
    check_pose(key, unit.body_from_base);
    if (!std::isfinite(unit.rest_pan_rad) || !std::isfinite(unit.rest_tilt_rad)) {
      add(key + ".rest_angles_rad", "must be finite");
    }
  }

  void check_model(const std::string& key, const CameraModel& model) {
    const std::size_t before = faults_.size();
    const auto kinds = parameter_specs(model);
    const ModelParameters numbers = parameters(model);
    for (std::size_t i = 0; i < kinds.size(); ++i) {
      check_numbers(fmt::format("{}.{}", key, kinds[i].key), kinds[i], numbers[i]);
    }
    if (faults_.size() == before && !project(model, Eigen::Vector3d::UnitZ())) {
      add(key, "with these parameters the camera model cannot project its optical axis");
    }
  }

  void check_numbers(const std::string& key, const ModelParameterSpec& kind, const std::vector<double>& numbers) {
    for (const double v : numbers) {
      if (!std::isfinite(v)) return add(key, "must be finite");
      if (kind.positive && v <= 0) return add(key, fmt::format("holds {}, must be above zero", v));
      if (kind.positive && v > kind.most) {
        return add(key, fmt::format("holds {}, must be above zero and at most {}", v, kind.most));
      }
      if (v < kind.least || v > kind.most) {
        return add(key, fmt::format("holds {}, must be between {} and {}", v, kind.least, kind.most));
      }
    }
    const double length = Eigen::Map<const Eigen::VectorXd>(numbers.data(), std::ssize(numbers)).norm();
    if (kind.unit_length && !(std::abs(length - 1) <= 1e-3)) {
      add(key, fmt::format("has length {:.6g}, must have length 1", length));
    }
  }

  void check(const RoverGeometry& rover) {
    const auto check_length = [&](const char* key, double value, double low, double high) {
      if (!(value >= low && value <= high))
        add(std::string("rover.") + key, fmt::format("is {}, must be between {} and {} m", value, low, high));
    };
    check_length("track_m", rover.track_m, 0.05, 10);
    check_length("wheel_radius_m", rover.wheel_radius_m, 0.01, 5);
    check_length("clearance_m", rover.clearance_m, 0.01, 5);
  }

  // A lever arm of more than 10 m is one in other units.
  void check_sensors() {
    constexpr double kMaxArm_m = 10, kMaxOffset_s = 10;
    const auto check_point = [&](const char* key, const Eigen::Vector3d& point) {
      if (!(point.cwiseAbs().maxCoeff() <= kMaxArm_m)) add(key, fmt::format("must be within {} m", kMaxArm_m));
    };
    check_point("rover.turning_centre_m", rig_.turning_centre_m);
    check_point("imu.translation_m", rig_.imu.body_from_imu.translation());
    if (!(std::abs(rig_.imu.time_offset_s) <= kMaxOffset_s))
      add("imu.time_offset_s", fmt::format("must be within {} s", kMaxOffset_s));
  }

  void check(const Camera& camera) {
    const std::string key = "cameras." + camera.name;
    const auto [width, height] = camera.size;
    if (std::min(width, height) < kSmallestSide || std::max(width, height) > kLargestSide) {
      add(key + ".size_px",
          fmt::format("is {} × {}, must be between {} and {} each", width, height, kSmallestSide, kLargestSide));
    }
    check_model(key, camera.model);
    if (camera.pixel_format.bits < 8 || camera.pixel_format.bits > 16) {
      add(key + ".bits", fmt::format("is {}, must be between 8 and 16", camera.pixel_format.bits));
    }
    for (const double v : camera.vignetting.coefficients) {
      if (!std::isfinite(v)) add(key + ".vignetting", "must be finite");
    }
    if (camera.vignetting.centre_px && !camera.vignetting.centre_px->allFinite()) {
      add(key + ".vignetting_centre_px", "must be finite");
    }
    if (camera.mount != "body" && !find_named(rig_.pan_tilt_units, camera.mount)) {
      add(key + ".mount", fmt::format("'{}' is neither 'body' nor a pan-tilt unit of this rig", camera.mount));
    }
    check_pose(key, camera.mount_from_camera);
    if (camera.driver) check_driver(key + ".driver", camera);
  }

  void check_driver(const std::string& key, const Camera& camera) {
    if (camera.driver->source.empty()) add(key + ".source", "must name a camera, e.g. aravis:ID");
    if (camera.driver->trigger.empty()) add(key + ".trigger", "must be free, software, or an input of the camera");
    if (!(camera.driver->black_level < camera.pixel_format.full_scale()))
      add(key + ".black_level", fmt::format("must be below {}, the largest value", camera.pixel_format.full_scale()));
  }

  const Camera* find_pair_camera(const std::string& key, const std::string& name) {
    const Camera* camera = rig_.find_camera(name);
    if (!camera) add(key, fmt::format("there is no camera '{}'", name));
    return camera;
  }

  void check(const StereoPair& pair) {
    const std::string key = "pairs." + pair.name;
    if (!std::isfinite(pair.nearest_m) || pair.nearest_m < 0) {
      add(key + ".nearest_m", fmt::format("is {}, must be a finite distance, or 0 for none", pair.nearest_m));
    }
    const Camera* left = find_pair_camera(key + ".left", pair.left);
    const Camera* right = find_pair_camera(key + ".right", pair.right);
    if (!left || !right) return;
    if (left == right) return add(key + ".right", "left and right are the same camera");
    if (left->mount != right->mount) {
      return add(key, fmt::format("the two cameras are on different mounts, '{}' and '{}'", left->mount, right->mount));
    }
    const double baseline = (left->mount_from_camera.translation() - right->mount_from_camera.translation()).norm();
    if (baseline < 1e-9) add(key, "both cameras are at the same position: the baseline is zero");
  }

  const Rig& rig_;
  std::vector<RigValidationError> faults_;
};

}  // namespace

Pose PanTiltUnit::body_from_head(double pan_rad, double tilt_rad) const {
  return body_from_base * Pose::from_rotation(Eigen::AngleAxisd(pan_rad, Eigen::Vector3d::UnitZ()) *
                                              Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitY()));
}

bool operator==(const ImuMount& a, const ImuMount& b) {
  return equal_bits(a.body_from_imu, b.body_from_imu) && a.time_offset_s == b.time_offset_s;
}

bool operator==(const PanTiltUnit& a, const PanTiltUnit& b) {
  return a.name == b.name && equal_bits(a.body_from_base, b.body_from_base) && a.rest_pan_rad == b.rest_pan_rad &&
         a.rest_tilt_rad == b.rest_tilt_rad;
}

int Camera::black_level() const {
  return driver ? static_cast<int>(std::lround(driver->black_level)) : 0;
}

bool operator==(const Camera& a, const Camera& b) {
  return a.name == b.name && a.size == b.size && a.model == b.model && a.pixel_format == b.pixel_format &&
         a.vignetting == b.vignetting && a.self_mask == b.self_mask && a.mount == b.mount &&
         equal_bits(a.mount_from_camera, b.mount_from_camera) && a.driver == b.driver;
}

const Camera* Rig::find_camera(const std::string& camera) const {
  return find_named(cameras, camera);
}

const StereoPair* Rig::find_pair(const std::string& pair) const {
  return find_named(pairs, pair);
}

Pose Rig::body_from_camera(const std::string& name_of_camera, double pan_rad, double tilt_rad) const {
  const Camera* camera = find_camera(name_of_camera);
  if (!camera) throw std::invalid_argument("Rig::body_from_camera: no camera '" + name_of_camera + "'");
  if (camera->mount == "body") return camera->mount_from_camera;
  const PanTiltUnit* unit = find_named(pan_tilt_units, camera->mount);
  if (!unit) throw std::invalid_argument("Rig::body_from_camera: no mount '" + camera->mount + "'");
  return unit->body_from_head(pan_rad, tilt_rad) * camera->mount_from_camera;
}

Pose Rig::body_from_camera(const std::string& name_of_camera) const {
  const Camera* camera = find_camera(name_of_camera);
  const PanTiltUnit* unit = camera ? find_named(pan_tilt_units, camera->mount) : nullptr;
  return body_from_camera(name_of_camera, unit ? unit->rest_pan_rad : 0, unit ? unit->rest_tilt_rad : 0);
}

Pose Rig::right_from_left(const StereoPair& pair) const {
  const Camera* left = find_camera(pair.left);
  const Camera* right = find_camera(pair.right);
  if (!left || !right) throw std::invalid_argument("Rig::right_from_left: pair '" + pair.name + "' misses a camera");
  if (left->mount == right->mount) return right->mount_from_camera.inverse() * left->mount_from_camera;
  return body_from_camera(pair.right).inverse() * body_from_camera(pair.left);
}

std::vector<RigValidationError> Rig::validation_errors() const {
  return FaultFinder(*this).run();
}

Status Rig::validate(const std::string& where) const {
  const std::vector<RigValidationError> faults = validation_errors();
  if (faults.empty()) return {};
  std::vector<std::string> lines;
  lines.reserve(faults.size());
  for (const RigValidationError& fault : faults)
    lines.push_back(fmt::format("{}: {}: {}", where, fault.key, fault.what));
  return failure(ErrorCode::configuration, fmt::format("{}", fmt::join(lines, "\n")));
}

Pose optical_from_forward() {
  // x_optical = −y, y_optical = −z, z_optical = x; as a quaternion all parts are ±1/2, exact in binary.
  return Pose::from_unit_quaternion({0.5, 0.5, -0.5, 0.5}, Eigen::Vector3d::Zero());
}

Rig rig_of_one_pair(const std::string& name, Camera left, Camera right, const Pose& right_from_left) {
  left.mount = right.mount = "body";
  left.mount_from_camera = optical_from_forward().inverse();
  right.mount_from_camera = left.mount_from_camera * right_from_left.inverse();
  Rig rig;
  rig.name = name;
  rig.convention = PoseConvention::left_optical;
  rig.pairs = {{"stereo", left.name, right.name}};
  rig.cameras = {std::move(left), std::move(right)};
  return rig;
}

}  // namespace spartan
