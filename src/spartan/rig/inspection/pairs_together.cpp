#include "spartan/rig/inspection/pairs_together.h"

#include <algorithm>
#include <set>

namespace spartan {
namespace {

// Rounding aside.
constexpr double kSamePlace_m = 1e-9, kSameTurn_rad = 1e-9;

template <class Named>
Named& named(std::vector<Named>& all, const std::string& name) {
  return *std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
}

bool are_alike(const Pose& a, const Pose& b) {
  const Pose between = a.inverse() * b;
  return between.translation().norm() < kSamePlace_m && rotation_angle(between) < kSameTurn_rad;
}

// But for its place.
bool is_same_camera(Camera a, const Camera& b) {
  a.mount_from_camera = b.mount_from_camera;
  return a == b;
}

// Both eyes of a rig under way, with what one pair wants of them.
class Eyes {
 public:
  Eyes(Rig& rig, const Rig& wanted, const StereoPair& pair)
      : left_(named(rig.cameras, pair.left)),
        right_(named(rig.cameras, pair.right)),
        wanted_left_(*wanted.find_camera(pair.left)),
        wanted_right_(*wanted.find_camera(pair.right)),
        left_from_right_(wanted_left_.mount_from_camera.inverse() * wanted_right_.mount_from_camera) {}

  // Whether they are now as is wanted.
  bool take(bool left_stays, bool right_stays) {
    if ((left_stays && !is_same_camera(left_, wanted_left_)) || (right_stays && !is_same_camera(right_, wanted_right_)))
      return false;
    // Bit for bit as long as nothing has moved.
    const bool as_wanted = (!left_stays || left_ == wanted_left_) && (!right_stays || right_ == wanted_right_);
    const Pose left_place = left_.mount_from_camera, right_place = right_.mount_from_camera;
    if (!left_stays) left_ = wanted_left_;
    if (!right_stays) right_ = wanted_right_;
    if (as_wanted) return true;
    if (!left_stays) left_.mount_from_camera = right_place * left_from_right_.inverse();
    if (!right_stays) right_.mount_from_camera = left_place * left_from_right_;
    return are_alike(left_.mount_from_camera.inverse() * right_.mount_from_camera, left_from_right_);
  }

 private:
  Camera &left_, &right_;
  const Camera &wanted_left_, &wanted_right_;
  Pose left_from_right_;
};

}  // namespace

RigOfPairs take_together(const Rig& given, const std::vector<CorrectedPair>& pairs) {
  RigOfPairs result{given, {}};
  std::set<std::string> placed;
  for (const CorrectedPair& corrected : pairs) {
    StereoPair& pair = named(result.rig.pairs, corrected.pair);
    pair = *corrected.rig.find_pair(corrected.pair);  // its eyes may have been exchanged
    const bool taken =
        Eyes(result.rig, corrected.rig, pair).take(placed.contains(pair.left), placed.contains(pair.right));
    if (!taken) result.left_out.push_back(corrected.pair);
    placed.insert({pair.left, pair.right});
  }
  return result;
}

}  // namespace spartan
