#include <algorithm>
#include <set>

#include "spartan/calibration/pair_check.h"

namespace spartan {
namespace {

// Larger than rounding, smaller than any calibration accuracy.
constexpr double kSamePosition_m = 1e-9, kSameRotation_rad = 1e-9;

template <class Named>
Named& named(std::vector<Named>& all, const std::string& name) {
  return *std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
}

bool is_same_pose(const Pose& a, const Pose& b) {
  const Pose a_from_b = a.inverse() * b;
  return a_from_b.translation().norm() < kSamePosition_m && rotation_angle(a_from_b) < kSameRotation_rad;
}

// Whether two cameras are equal in everything but their pose.
bool is_same_camera(Camera a, const Camera& b) {
  a.mount_from_camera = b.mount_from_camera;
  return a == b;
}

// The two cameras of a pair in the merged rig, and in the rig as corrected for this pair.
class PairCameras {
 public:
  PairCameras(Rig& merged, const Rig& corrected, const StereoPair& pair)
      : left_(named(merged.cameras, pair.left)),
        right_(named(merged.cameras, pair.right)),
        corrected_left_(*corrected.find_camera(pair.left)),
        corrected_right_(*corrected.find_camera(pair.right)),
        left_from_right_(corrected_left_.mount_from_camera.inverse() * corrected_right_.mount_from_camera) {}

  // Applies the correction without changing a camera that is fixed. False where it cannot be applied.
  bool apply(bool left_fixed, bool right_fixed) {
    if ((left_fixed && !is_same_camera(left_, corrected_left_)) ||
        (right_fixed && !is_same_camera(right_, corrected_right_)))
      return false;
    // Where no fixed camera has moved, the corrected poses are copied bit for bit.
    const bool unmoved = (!left_fixed || left_ == corrected_left_) && (!right_fixed || right_ == corrected_right_);
    const Pose left_pose = left_.mount_from_camera, right_pose = right_.mount_from_camera;
    if (!left_fixed) left_ = corrected_left_;
    if (!right_fixed) right_ = corrected_right_;
    if (unmoved) return true;
    if (!left_fixed) left_.mount_from_camera = right_pose * left_from_right_.inverse();
    if (!right_fixed) right_.mount_from_camera = left_pose * left_from_right_;
    return is_same_pose(left_.mount_from_camera.inverse() * right_.mount_from_camera, left_from_right_);
  }

 private:
  Camera &left_, &right_;
  const Camera &corrected_left_, &corrected_right_;
  Pose left_from_right_;
};

}  // namespace

MergedRig merge_corrections(const Rig& given, const std::vector<CorrectedPair>& pairs) {
  MergedRig result{given, {}};
  std::set<std::string> fixed;
  for (const CorrectedPair& corrected : pairs) {
    StereoPair& pair = named(result.rig.pairs, corrected.pair);
    pair = *corrected.rig.find_pair(corrected.pair);  // its cameras may have been swapped
    const bool applied =
        PairCameras(result.rig, corrected.rig, pair).apply(fixed.contains(pair.left), fixed.contains(pair.right));
    if (!applied) result.discarded.push_back(corrected.pair);
    fixed.insert({pair.left, pair.right});
  }
  return result;
}

}  // namespace spartan
