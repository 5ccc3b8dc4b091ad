#include "spartan/rig/rig_differences.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "spartan/rig/describe.h"
#include "spartan/rig/models/model_equivalents.h"

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
  Comparison(const Rig& wanted, const Rig& got) : wanted_(wanted), got_(got) { match_cameras(); }

  std::vector<RigDifference> run() && {
    compare("name", "the name", wanted_.name, got_.name);
    compare("pose_convention", "the poses of the recording", text_of(wanted_.convention), text_of(got_.convention));
    compare_units();
    compare_body();
    for (const Camera& camera : wanted_.cameras) compare_camera(camera);
    for (std::size_t i = 0; i < wanted_.pairs.size(); ++i) compare_pair(i);
    find_surplus();
    return std::move(differences_);
  }

 private:
  void add(const std::string& key, const std::string& text) { differences_.push_back({key, text}); }

  static std::string text_of(PoseConvention convention) {
    return convention == PoseConvention::body ? "those of the body" : "those of the left camera";
  }

  template <class T>
  void compare(const std::string& key, const std::string& subject, const T& wanted, const T& got) {
    if (wanted != got) add(key, fmt::format("{}: {}, now {}", subject, quoted(wanted), quoted(got)));
  }
  static std::string quoted(const std::string& text) { return text.empty() ? "none" : text; }
  static std::string quoted(double value) { return fmt::format("{}", value); }
  static std::string quoted(int value) { return fmt::format("{}", value); }
  static std::string quoted(bool value) { return value ? "yes" : "no"; }

  // Each camera of the wanted rig finds at most one of the other.
  void match_cameras() {
    const auto give = [&](const std::string& wanted, const std::string& got) {
      const bool taken =
          std::any_of(partner_.begin(), partner_.end(), [&](const auto& entry) { return entry.second == got; });
      if (!taken && got_.find_camera(got)) partner_.try_emplace(wanted, got);
    };
    for (std::size_t i = 0; i < std::min(wanted_.pairs.size(), got_.pairs.size()); ++i) {
      give(wanted_.pairs[i].left, got_.pairs[i].left);
      give(wanted_.pairs[i].right, got_.pairs[i].right);
    }
    for (const Camera& camera : wanted_.cameras) give(camera.name, camera.name);
    for (const Camera& camera : wanted_.cameras) {
      for (const Camera& other : got_.cameras) give(camera.name, other.name);
    }
  }

  const Camera* partner_of(const std::string& camera) const {
    const auto found = partner_.find(camera);
    return found == partner_.end() ? nullptr : got_.find_camera(found->second);
  }

  void compare_units() {
    for (const PanTiltUnit& unit : wanted_.pan_tilt_units) {
      const auto kept = std::find(got_.pan_tilt_units.begin(), got_.pan_tilt_units.end(), unit);
      if (kept != got_.pan_tilt_units.end()) continue;
      const bool there = std::any_of(got_.pan_tilt_units.begin(), got_.pan_tilt_units.end(),
                                     [&](const PanTiltUnit& other) { return other.name == unit.name; });
      add("pan_tilt_units." + unit.name,
          there ? "the pan-tilt unit stands elsewhere"
                : "the pan-tilt unit is gone: its cameras stand still, at its angles of rest");
    }
  }

  // The frame that all cameras are in; how they stand to each other is compared apart from it.
  void compare_body() {
    const Camera& first = wanted_.cameras.front();
    const Camera* other = partner_of(first.name);
    if (!other) return;
    const Pose was = wanted_.body_from_camera(first.name), is = got_.body_from_camera(other->name);
    if (same(was, is)) return;
    const Pose moved = optical_from_forward() * is * was.inverse() * optical_from_forward().inverse();
    add("body", fmt::format("the body's frame is another one; seen from the new one, the old one is {}",
                            describe_relative_pose(moved)));
  }

  void compare_camera(const Camera& camera) {
    const std::string key = "cameras." + camera.name;
    const Camera* other = partner_of(camera.name);
    if (!other) return add(key, "the camera is gone");
    const auto field = [&](const char* name) { return fmt::format("{}.{}", key, name); };
    compare(field("name"), "the camera's name", camera.name, other->name);
    const auto size = [](const Camera& c) { return fmt::format("{} x {}", c.size.width, c.size.height); };
    compare(field("size_px"), "the image size", size(camera), size(*other));
    compare_model(key, camera.model, other->model);
    compare(field("pixel_layout"), "the pixels", std::string(name_of(camera.pixel_format.layout)),
            std::string(name_of(other->pixel_format.layout)));
    compare(field("bits"), "bits that carry signal", camera.pixel_format.bits, other->pixel_format.bits);
    const auto alignment = [](const Camera& c) {
      return std::string(c.pixel_format.alignment == BitAlignment::high ? "high" : "low");
    };
    compare(field("bit_alignment"), "their end of the sample", alignment(camera), alignment(*other));
    compare_vignetting(key, camera.vignetting, other->vignetting);
    compare(field("self_mask"), "the self-mask", camera.self_mask, other->self_mask);
    compare_place(key, camera, *other);
  }

  void compare_vignetting(const std::string& key, const Vignetting& wanted, const Vignetting& got) {
    const auto list = [](const std::vector<double>& numbers) {
      return numbers.empty() ? std::string() : fmt::format("[{}]", fmt::join(numbers, ", "));
    };
    const auto centre = [&](const Vignetting& v) {
      return v.centre_px ? list({v.centre_px->x(), v.centre_px->y()}) : std::string();
    };
    compare(key + ".vignetting", "the fall-off of light", list(wanted.coefficients), list(got.coefficients));
    compare(key + ".vignetting_centre_px", "its centre", centre(wanted), centre(got));
  }

  void compare_place(const std::string& key, const Camera& camera, const Camera& other) {
    const std::string& first = wanted_.cameras.front().name;
    const Camera* other_first = partner_of(first);
    if (camera.name == first || !other_first) return;
    const Pose was = wanted_.body_from_camera(first).inverse() * wanted_.body_from_camera(camera.name);
    const Pose is = got_.body_from_camera(other_first->name).inverse() * got_.body_from_camera(other.name);
    if (same(was, is)) return;
    add(key + ".place",
        fmt::format("seen from {}: {}, now {}", first, describe_relative_pose(was), describe_relative_pose(is)));
  }

  void compare_model(const std::string& key, const CameraModel& wanted, const CameraModel& got) {
    CameraModel was = plainest(wanted);
    const CameraModel is = plainest(got);
    // A skew that is gone is no other kind of camera.
    if (skew_px(was) != 0 && skew_px(is) == 0) {
      add(key + ".skew_px", fmt::format("[{}], now none", skew_px(was)));
      was = plainest(without_skew(was));
    }
    if (name_of(was) != name_of(is)) {
      return add(key + ".model", fmt::format("the camera model: {}, now {}", name_of(was), name_of(is)));
    }
    const auto kinds = parameter_kinds(was);
    const ModelParameters a = parameters(was), b = parameters(is);
    for (std::size_t i = 0; i < kinds.size(); ++i) {
      if (agree(kinds[i], a[i], b[i], a.front())) continue;
      add(fmt::format("{}.{}", key, kinds[i].key),
          fmt::format("[{}], now [{}]", fmt::join(a[i], ", "), fmt::join(b[i], ", ")));
    }
  }

  // Lists end with zeros that need not be there. Pixels round with the focal length, whatever they count.
  static bool agree(const ModelParameterKind& kind, std::vector<double> a, std::vector<double> b,
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
    if (i >= got_.pairs.size()) return add(key, "the pair is gone");
    const StereoPair& other = got_.pairs[i];
    compare(key + ".name", "the pair's name", pair.name, other.name);
    const Camera *left = partner_of(pair.left), *right = partner_of(pair.right);
    if (left && left->name != other.left) add(key + ".left", "another camera is the left eye");
    if (right && right->name != other.right) add(key + ".right", "another camera is the right eye");
    compare(key + ".nearest_m", "the nearest depth", pair.nearest_m, other.nearest_m);
    compare(key + ".for_odometry", "for odometry", pair.for_odometry, other.for_odometry);
  }

  // What nobody wanted: files that lay there already.
  void find_surplus() {
    for (const PanTiltUnit& unit : got_.pan_tilt_units) {
      const bool wanted = std::any_of(wanted_.pan_tilt_units.begin(), wanted_.pan_tilt_units.end(),
                                      [&](const PanTiltUnit& other) { return other.name == unit.name; });
      if (!wanted) add("pan_tilt_units." + unit.name, "a pan-tilt unit that was not there before");
    }
    for (const Camera& camera : got_.cameras) {
      const bool wanted =
          std::any_of(partner_.begin(), partner_.end(), [&](const auto& entry) { return entry.second == camera.name; });
      if (!wanted) add("cameras." + camera.name, "a camera that was not there before");
    }
    for (std::size_t i = wanted_.pairs.size(); i < got_.pairs.size(); ++i) {
      add("pairs." + got_.pairs[i].name, "a pair that was not there before");
    }
  }

  const Rig& wanted_;
  const Rig& got_;
  std::map<std::string, std::string> partner_;
  std::vector<RigDifference> differences_;
};

}  // namespace

std::vector<RigDifference> describe_differences(const Rig& wanted, const Rig& got) {
  return Comparison(wanted, got).run();
}

}  // namespace spartan
