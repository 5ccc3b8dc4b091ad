// Side and cell size of local maps, and the lengths that scale with them, from what the cameras of a rig see.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"
#include "spartan/system/run_options.h"

namespace spartan::internal {

/// A stereo pair over level ground.
struct PairOverGround {
  RectifiedStereo geometry;
  Eigen::Vector3d up_in_left = -Eigen::Vector3d::UnitY();  ///< rectified left optical frame
  std::optional<double> height_m;                          ///< of the left camera above the ground; none: unknown
};

struct MapScale {
  double side_m = 8, cell_m = 0.05;
  std::optional<double> camera_height_m;
  bool height_by_images = false;  ///< the rig does not state it
  /// Normal of the ground in the images of the odometry pair; none where the rig has a body on the ground, where no
  /// ground was found, or where it is more than 60° from the up axis of the image.
  std::optional<Eigen::Vector3d> up_in_body = {};
};

/// For the pair that sees farthest. Half of the side is where the range of a point, at 0.3 px of disparity error, has a
/// relative standard deviation of 2.2 %, but not beyond the ground that the top row sees. A cell is a 160th of the side
/// and at most an eighth of the camera's height. Both are rounded to 1, 1.2, 1.5, 2, 2.4, 3, 4, 5, 6, 8 times a power
/// of ten: a mast of 1 m with the wide pair of the paper has 8 m and 5 cm, the camera of a car (KITTI) 60 m and 20 cm.
MapScale map_scale(std::span<const PairOverGround> pairs);

/// map_scale() of a stream: heights are those of the rig where it has a body on the ground, else that of the ground
/// plane in the disparity images of the first frames. `rig`: that of the stream, its rows may be aligned. Codes are
/// those of reading frames.
Result<MapScale> map_scale_of(SampleStream& source, const Rig& rig, const RunOptions& options,
                              const ThreadPool& workers, const std::string& mask_folder);

/// Options whose keys were not given and that have their defaults take the scale: side, cell, heights of obstacles and
/// cavities (two cells), and all lengths of mapping and map matching, which were chosen for cells of 5 cm.
RunOptions with_map_scale(RunOptions options, const MapScale& scale, const GivenKeys& given);

/// "side 60 m, cells of 0.2 m, obstacles from 0.4 m (camera 1.68 m above the ground, by the images)"
std::string to_text(const MapScale& scale, const RunOptions& used);

}  // namespace spartan::internal
