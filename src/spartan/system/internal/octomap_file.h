// Maps as octrees of occupied voxels, in the file format of OctoMap.
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/slam/global_map.h"

namespace spartan::internal {

/// A binary OcTree (.bt, OctoMap 1.x) with voxels of the size of a cell. Occupied are the voxels of each known cell
/// from its lowest elevation, or the lower surface of a neighbour (so that slopes have no holes), to its highest one;
/// the others are unknown. Code `usage` for maps beyond the 65 536 voxels a side of OctoMap's key.
Result<std::string> octomap_file(const MapView& view);

}  // namespace spartan::internal
