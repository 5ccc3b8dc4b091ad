// Files of the terrain along the path: disparity image, its rendering, coloured point cloud (docs/reference/files.md).
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/reconstruction/point_cloud.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// Writes <folder>/<stamp_ns>.pfm (disparity, px), .png (colour-coded disparity) and .ply (points, metres, world
/// frame; only those within the maximum range error).
/// Code `output`.
Result<TerrainRecord> write_terrain(const TerrainView& view, const TerrainOptions& options, const std::string& folder);

/// All point clouds of a run. Code `input` (no terrain, or a damaged file).
Result<PointCloud> terrain_cloud(const std::string& folder, const std::vector<TerrainRecord>& terrain);

}  // namespace spartan::internal
