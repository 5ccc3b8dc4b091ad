// 3D reconstruction of one stop: all its views are fused into one range image, and that becomes a local map.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/disparity_merger.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/reconstruction/v_disparity.h"

namespace spartan {

/// Options of the steps from the disparity images of a stop to its local map.
struct MappingOptions {
  double disparity_sigma_px = 0.3;  ///< standard deviation of a disparity, pixels
  int max_outlier_percent = 20;     ///< largest outlier probability of a disparity that is mapped, percent
  VDisparityOptions v_disparity;
  MergingOptions merging;
  MapOptions map;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("disparity_sigma_px", disparity_sigma_px,
            "Standard deviation of a disparity in pixels, from which the variance of ranges and elevations follows; "
            "raising it merges surfaces that are farther apart and tolerates more noise in the ground plane.",
            between(0.01, 5));
    v.field("max_outlier_percent", max_outlier_percent,
            "Largest probability of an error above one pixel with which a disparity is mapped, in percent; lower than "
            "reconstruction.max_outlier_percent, because a wrong disparity becomes an obstacle.",
            between(0, 100));
    v.group("v_disparity", v_disparity);
    v.group("merging", merging);
    v.group("map", map);
  }
};

/// Copies the quantities that are stated once to the steps that use them: the standard deviation of a disparity to the
/// ground plane and to the merging, and four fifths of the obstacle height of the map to v-disparity, whose obstacles
/// must not miss any of the map's. Values of the steps that differ from their defaults (set in code or under a former
/// key) are retained. StopMapper calls it.
MappingOptions with_shared_values(MappingOptions options);

/// One view of a stop: a stereo frame with its disparities and its ground profile.
struct StopView {
  std::string pair;
  Stamp stamp;
  ViewGeometry geometry;
  Image<float> disparity;  ///< Pixels; NaN where unknown.
  Image<float> sigma;      ///< Standard deviation of the disparities, pixels.
  Image<std::uint8_t> left;
  std::optional<VDisparity> ground;  ///< Empty where no ground was found; the classes of its pixels are then unknown.
};

/// Wall-clock milliseconds since construction; for reports only.
struct StopMapperTimes {
  double disparity = 0, v_disparity = 0, merging = 0, map = 0;
};

/// Computes disparities and v-disparity of each view as it is added, and merges the views when the stop is complete.
/// Local maps are generated from the merged range image at the pose that the caller gives (MapGenerator is cheap).
class StopMapper {
 public:
  /// Code `configuration` where an option is out of bounds.
  static Result<StopMapper> create(const DisparityOptions& disparity, const MappingOptions& options,
                                   ThreadPool workers);

  /// Whether add() of that view would succeed, without computing. Codes as DisparityComputer::check().
  static Status check(const RectifiedPair& frame, double nearest_m);

  /// Adds a view of the current stop. `nearest_m`: nearest depth of the search range, as StereoPair says. `up_in_body`:
  /// direction away from the expected ground plane, body frame. Codes as check().
  Status add(const RectifiedPair& frame, double nearest_m,
             const Eigen::Vector3d& up_in_body = Eigen::Vector3d::UnitZ());

  std::span<const StopView> views() const { return views_; }

  /// Merges the views into a panoramic camera. Its centre is the mean of the midpoints between the left and the right
  /// camera over all views of the pair with the longest baseline; its axis is the body's z axis. At least one view is
  /// required.
  MergedRange merge();

  LocalMap map(std::span<const SurfacePoint> points, const Pose& map_from_body);

  /// Discards the views, for the next stop.
  void leave() { views_.clear(); }

  const StopMapperTimes& times() const { return times_; }

 private:
  StopMapper(DisparityComputer computer, MapGenerator generator, const MappingOptions& options,
             const ThreadPool& workers);

  MappingOptions options_;
  ThreadPool workers_;
  DisparityComputer computer_;
  MapGenerator generator_;
  std::vector<StopView> views_;
  StopMapperTimes times_;
};

}  // namespace spartan
