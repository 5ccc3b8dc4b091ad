// 3D reconstruction of one rover position: all its views become one merged view, and that a map.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/rectified_pair.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/disparity_merger.h"
#include "spartan/reconstruction/disparity_options.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/reconstruction/v_disparity.h"

namespace spartan {

/// How the disparities of a position become a map.
struct MappingOptions {
  VDisparityOptions v_disparity;
  MergingOptions merging;
  MapOptions map;

  template <class Visitor>
  void describe(Visitor& v) {
    v.group("v_disparity", v_disparity);
    v.group("merging", merging);
    v.group("map", map);
  }
};

/// One shot of a position with what was found in it.
struct PositionView {
  std::string pair;
  Stamp stamp;
  ViewGeometry geometry;
  Image<float> disparity;  ///< px, NaN unknown
  Image<std::uint8_t> left;
  std::optional<VDisparity> ground;  ///< none where no ground was found: its pixels count as unknown
};

/// Wall-clock milliseconds since the mapper was made, for reports only.
struct MappingTimes {
  double disparity = 0, v_disparity = 0, merging = 0, map = 0;
};

/// Disparity computation → v-disparity for each view as it comes, disparity merging when the position is complete.
/// Maps are generated from the merged view at whatever pose the caller believes in (MapGenerator is cheap).
class PositionMapper {
 public:
  PositionMapper(const DisparityOptions& disparity, const MappingOptions& options, Workers workers);

  /// Whether add() of that view would succeed, without computing. Codes as DisparityComputer::check().
  static Status check(const RectifiedPair& shot, double nearest_m);

  /// A view of the current position. `nearest_m` as StereoPair says. `up_in_body`: where the ground is looked for.
  /// Codes as check().
  Status add(const RectifiedPair& shot, double nearest_m, const Eigen::Vector3d& up_in_body = Eigen::Vector3d::UnitZ());

  std::span<const PositionView> views() const { return views_; }

  /// The views in one: a panoramic camera at the mean middle of the pair with the longest baseline, its axis of turn
  /// upright in the body. At least one view must be there.
  MergedRange merge();

  LocalMap map(std::span<const SurfacePoint> points, const Pose& map_from_body);

  /// Forgets the views: the rover goes on.
  void leave() { views_.clear(); }

  const MappingTimes& times() const { return times_; }

 private:
  MappingOptions options_;
  Workers workers_;
  DisparityComputer computer_;
  MapGenerator generator_;
  std::vector<PositionView> views_;
  MappingTimes times_;
};

}  // namespace spartan
