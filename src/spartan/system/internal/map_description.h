// What a GeoTIFF states about the map it holds.
#pragma once

#include "spartan/storage/geotiff.h"
#include "spartan/system/map_files.h"

namespace spartan::internal {

/// Items FIRST_STAMP_NS, LAST_STAMP_NS, STOPS, where there are stops, and X_AXIS (east or start_heading), where known.
MapDescription map_description(const MapContext& about);

}  // namespace spartan::internal
