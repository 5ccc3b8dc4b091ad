#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "spartan/rig/describe.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {
namespace {

constexpr double kSameNumber = 1e-12, kSamePose = 1e-11;

bool same(const Pose& a, const Pose& b) {
  const Pose apart = a.inverse() * b;
  return apart.translation().norm() <= kSamePose * std::max(1.0, a.translation().norm()) &&
         rotation_angle(apart) <= kSamePose;
}

class Comparison {
 public:
  Comparison(const Rig& wanted, const Rig& result) : wanted_(wanted), result_(result) { match_cameras(); }

  std::vector<RigDifference> run() && {
    compare("name", "the name", wanted_.name, result_.name);
    compare("pose_convention", "the pose convention of the recording", text_of(wanted_.convention),
            text_of(result_.convention));
    compare("rover.track_m", "the distance between the wheels", wanted_.rover.track_m, result_.rover.track_m);
    compare("rover.wheel_radius_m", "the wheel radius", wanted_.rover.wheel_radius_m, result_.rover.wheel_radius_m);
    compare("rover.clearance_m", "the ground clearance", wanted_.rover.clearance_m, result_.rover.clearance_m);
    compare("rover.turning_centre_m", "the turning centre of the wheels", text_of(wanted_.turning_centre_m),
            text_of(result_.turning_centre_m));
    if (wanted_.imu != result_.imu) add("imu", "the IMU has another pose or time offset");
    compare_units();
    compare_body();
    for (const Camera& camera : wanted_.cameras) compare_camera(camera);
    for (std::size_t i = 0; i < wanted_.pairs.size(); ++i) compare_pair(i);
    find_additions();
    return std::move(differences_);
  }

 private:
  void add(const std::string& key, const std::string& text) { differences_.push_back({key, text}); }

  static std::string text_of(PoseConvention convention) {
    return convention == PoseConvention::body ? "body" : "left camera";
  }

  static std::string text_of(const Eigen::Vector3d& v) { return fmt::format("{}, {}, {} m", v.x(), v.y(), v.z()); }

  template <class T>
  void compare(const std::string& key, const std::string& subject, const T& wanted, const T& result) {
    if (wanted != result) add(key, fmt::format("{}: {}, now {}", subject, quoted(wanted), quoted(result)));
  }
  static std::string quoted(const std::string& text) { return text.empty() ? "none" : text; }
  static std::string quoted(double value) { return fmt::format("{}", value); }
  static std::string quoted(int value) { return fmt::format("{}", value); }
  static std::string quoted(bool value) { return value ? "yes" : "no"; }

  // Assigns to each camera of the wanted rig at most one of the resulting rig.
  void match_cameras() {
    const auto assign = [&](const std::string& wanted, const std::string& result) {
      const bool taken =
          std::any_of(partner_.begin(), partner_.end(), [&](const auto& entry) { return entry.second == result; });
      if (!taken && result_.find_camera(result)) partner_.try_emplace(wanted, result);
    };
    for (std::size_t i = 0; i < std::min(wanted_.pairs.size(), result_.pairs.size()); ++i) {
      assign(wanted_.pairs[i].left, result_.pairs[i].left);
      assign(wanted_.pairs[i].right, result_.pairs[i].right);
    }
    for (const Camera& camera : wanted_.cameras) assign(camera.name, camera.name);
    for (const Camera& camera : wanted_.cameras) {
      for (const Camera& other : result_.cameras) assign(camera.name, other.name);
    }
  }

  const Camera* partner_of(const std::string& camera) const {
    const auto found = partner_.find(camera);
    return found == partner_.end() ? nullptr : result_.find_camera(found->second);
  }

  void compare_units() {
    for (const PanTiltUnit& unit : wanted_.pan_tilt_units) {
      const auto equal = std::find(result_.pan_tilt_units.begin(), result_.pan_tilt_units.end(), unit);
      if (equal != result_.pan_tilt_units.end()) continue;
      const bool exists = std::any_of(result_.pan_tilt_units.begin(), result_.pan_tilt_units.end(),
                                      [&](const PanTiltUnit& other) { return other.name == unit.name; });
      add("pan_tilt_units." + unit.name,
          exists ? "the pan-tilt unit has another pose or other rest angles"
                 : "the pan-tilt unit is missing: its cameras are fixed at its rest angles");
    }
  }

  // The pose of the first camera in the body frame; the relative poses of the cameras are compared separately.
  void compare_body() {
    const Camera& first = wanted_.cameras.front();
    const Camera* other = partner_of(first.name);
    if (!other) return;
    const Pose was = wanted_.body_from_camera(first.name), is = result_.body_from_camera(other->name);
    if (same(was, is)) return;
    const Pose moved = optical_from_forward() * is * was.inverse() * optical_from_forward().inverse();
    add("body", fmt::format("the body frame differs: relative to the new one, the old one is {}",
                            describe_relative_pose(moved)));
  }

  void compare_camera(const Camera& camera) {
    const std::string key = "cameras." + camera.name;
    const Camera* other = partner_of(camera.name);
    if (!other) return add(key, "the camera is missing");
    const auto field = [&](const char* name) { return fmt::format("{}.{}", key, name); };
    compare(field("name"), "the camera's name", camera.name, other->name);
    const auto size = [](const Camera& c) { return fmt::format("{} x {}", c.size.width, c.size.height); };
    compare(field("size_px"), "the image size", size(camera), size(*other));
    compare_model(key, camera.model, other->model);
    compare(field("pixel_layout"), "the pixel layout", std::string(name_of(camera.pixel_format.layout)),
            std::string(name_of(other->pixel_format.layout)));
    compare(field("bits"), "the significant bits", camera.pixel_format.bits, other->pixel_format.bits);
    const auto alignment = [](const Camera& c) {
      return std::string(c.pixel_format.alignment == BitAlignment::high ? "high" : "low");
    };
    compare(field("bit_alignment"), "the bit alignment", alignment(camera), alignment(*other));
    compare_vignetting(key, camera.vignetting, other->vignetting);
    compare(field("self_mask"), "the self-mask", camera.self_mask, other->self_mask);
    compare_pose(key, camera, *other);
  }

  void compare_vignetting(const std::string& key, const Vignetting& wanted, const Vignetting& result) {
    const auto list = [](const std::vector<double>& numbers) {
      return numbers.empty() ? std::string() : fmt::format("[{}]", fmt::join(numbers, ", "));
    };
    const auto centre = [&](const Vignetting& v) {
      return v.centre_px ? list({v.centre_px->x(), v.centre_px->y()}) : std::string();
    };
    compare(key + ".vignetting", "the vignetting", list(wanted.coefficients), list(result.coefficients));
    compare(key + ".vignetting_centre_px", "the vignetting centre", centre(wanted), centre(result));
  }

  void compare_pose(const std::string& key, const Camera& camera, const Camera& other) {
    const std::string& first = wanted_.cameras.front().name;
    const Camera* other_first = partner_of(first);
    if (camera.name == first || !other_first) return;
    const Pose was = wanted_.body_from_camera(first).inverse() * wanted_.body_from_camera(camera.name);
    const Pose is = result_.body_from_camera(other_first->name).inverse() * result_.body_from_camera(other.name);
    if (same(was, is)) return;
    add(key + ".place",
        fmt::format("relative to {}: {}, now {}", first, describe_relative_pose(was), describe_relative_pose(is)));
  }

  void compare_model(const std::string& key, const CameraModel& wanted, const CameraModel& result) {
    CameraModel was = simplest_equivalent(wanted);
    const CameraModel is = simplest_equivalent(result);
    // A lost skew is reported as such, not as another camera model.
    if (skew_px(was) != 0 && skew_px(is) == 0) {
      add(key + ".skew_px", fmt::format("[{}], now none", skew_px(was)));
      was = simplest_equivalent(without_skew(was));
    }
    if (name_of(was) != name_of(is)) {
      return add(key + ".model", fmt::format("the camera model: {}, now {}", name_of(was), name_of(is)));
    }
    const auto kinds = parameter_specs(was);
    const ModelParameters a = parameters(was), b = parameters(is);
    for (std::size_t i = 0; i < kinds.size(); ++i) {
      if (agree(kinds[i], a[i], b[i], a.front())) continue;
      add(fmt::format("{}.{}", key, kinds[i].key),
          fmt::format("[{}], now [{}]", fmt::join(a[i], ", "), fmt::join(b[i], ", ")));
    }
  }

  // Trailing zeros of a list may be omitted. Values in pixels are rounded in proportion to the focal length.
  static bool agree(const ModelParameterSpec& kind, std::vector<double> a, std::vector<double> b,
                    const std::vector<double>& focal_px) {
    a.resize(std::max(a.size(), b.size()));
    b.resize(a.size());
    const auto norm = [](const std::vector<double>& v) {
      return Eigen::Map<const Eigen::VectorXd>(v.data(), std::ssize(v)).norm();
    };
    const double a_scale = kind.unit_length ? norm(a) : 1, b_scale = kind.unit_length ? norm(b) : 1;
    const double pixels = kind.key.ends_with("_px") ? *std::max_element(focal_px.begin(), focal_px.end()) : 1;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double scale = std::max(pixels, std::abs(a[i]));
      if (!(std::abs(a[i] / a_scale - b[i] / b_scale) <= kSameNumber * scale)) return false;
    }
    return true;
  }

  void compare_pair(std::size_t i) {
    const StereoPair& pair = wanted_.pairs[i];
    const std::string key = "pairs." + pair.name;
    if (i >= result_.pairs.size()) return add(key, "the pair is missing");
    const StereoPair& other = result_.pairs[i];
    compare(key + ".name", "the pair's name", pair.name, other.name);
    const Camera *left = partner_of(pair.left), *right = partner_of(pair.right);
    if (left && left->name != other.left) add(key + ".left", "the left camera is another one");
    if (right && right->name != other.right) add(key + ".right", "the right camera is another one");
    compare(key + ".nearest_m", "the nearest depth", pair.nearest_m, other.nearest_m);
    compare(key + ".for_odometry", "for odometry", pair.for_odometry, other.for_odometry);
  }

  // What only the result has, for example from files that already existed.
  void find_additions() {
    for (const PanTiltUnit& unit : result_.pan_tilt_units) {
      const bool wanted = std::any_of(wanted_.pan_tilt_units.begin(), wanted_.pan_tilt_units.end(),
                                      [&](const PanTiltUnit& other) { return other.name == unit.name; });
      if (!wanted) add("pan_tilt_units." + unit.name, "an additional pan-tilt unit");
    }
    for (const Camera& camera : result_.cameras) {
      const bool wanted =
          std::any_of(partner_.begin(), partner_.end(), [&](const auto& entry) { return entry.second == camera.name; });
      if (!wanted) add("cameras." + camera.name, "an additional camera");
    }
    for (std::size_t i = wanted_.pairs.size(); i < result_.pairs.size(); ++i) {
      add("pairs." + result_.pairs[i].name, "an additional pair");
    }
  }

  const Rig& wanted_;
  const Rig& result_;
  std::map<std::string, std::string> partner_;
  std::vector<RigDifference> differences_;
};

}  // namespace

std::vector<RigDifference> describe_differences(const Rig& wanted, const Rig& result) {
  return Comparison(wanted, result).run();
}

}  // namespace spartan
