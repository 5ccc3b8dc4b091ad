// The terrain along the way as files: disparity, its picture, a coloured point cloud in the world.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// Writes <folder>/<stamp_ns>.pfm (disparity, px), .png (the same in colours) and .ply (points, metres, world frame).
/// Code `output`.
Result<TerrainRecord> write_terrain(const TerrainView& view, const TerrainOptions& options, const std::string& folder);

/// All clouds of a run in one PLY file. Codes: `input` (none there, or damaged), `output`.
Status merge_terrain_clouds(const std::string& folder, const std::vector<TerrainRecord>& terrain,
                            const std::string& path);

}  // namespace spartan
