#include <cmath>

#include "spartan/slam/tile_store.h"

namespace spartan {
namespace {

// Version 1 has no common variance.
constexpr std::uint32_t kSubmapVersion = 2, kWithoutCommonVariance = 1;

void put(ArchiveWriter& out, const CellSurface& s) {
  for (const float value :
       {s.elevation_m, s.variance_m2, s.common_variance_m2, s.lowest_m, s.highest_m, s.count, s.occupancy_logodds})
    out.put(value);
  out.put(s.stop);
  out.put(s.shape);
  out.put(s.votes);
}

CellSurface get_surface(ArchiveReader& in, std::uint32_t version) {
  CellSurface s;
  s.elevation_m = in.get<float>();
  s.variance_m2 = in.get<float>();
  if (version != kWithoutCommonVariance) s.common_variance_m2 = in.get<float>();
  for (float* value : {&s.lowest_m, &s.highest_m, &s.count, &s.occupancy_logodds}) *value = in.get<float>();
  s.stop = in.get<std::int32_t>();
  s.shape = in.get<std::int16_t>();
  s.votes = in.get<std::uint16_t>();
  // Version 0.1.0 stored NaN for cells without a ground surface: their class is unknown.
  if (std::isnan(s.occupancy_logodds)) {
    s.occupancy_logodds = 0;
    s.shape = 0;
    s.votes = 0;
  }
  return s;
}

// Ids are bounded as in TileStore.
bool is_sensible(const CellSurface& s) {
  return std::isfinite(s.elevation_m) && std::isfinite(s.variance_m2) && s.common_variance_m2 >= 0 &&
         s.common_variance_m2 <= s.variance_m2 && std::isfinite(s.lowest_m) && std::isfinite(s.highest_m) &&
         std::isfinite(s.count) && std::isfinite(s.occupancy_logodds) && s.stop >= -1 && s.stop <= 1'000'000'000;
}

}  // namespace

std::optional<LatticeOffset> Submap::lattice_offset(double cell_m) const {
  const Eigen::Vector3d& t = world_from_submap.translation();
  if (world_from_submap.rotation().vec().cwiseAbs().maxCoeff() > 1e-12) return std::nullopt;
  const double x = std::round(t.x() / cell_m), y = std::round(t.y() / cell_m);
  if (std::abs(x * cell_m - t.x()) > 1e-6 || std::abs(y * cell_m - t.y()) > 1e-6) return std::nullopt;
  return LatticeOffset{static_cast<int>(x), static_cast<int>(y)};
}

Bytes to_bytes(const Tile& tile) {
  ArchiveWriter out;
  out.put(kSubmapVersion);
  std::uint32_t seen = 0;
  for (const MapCell& cell : tile.cells) seen += cell.surface.observed() ? 1 : 0;
  out.put(seen);
  for (std::size_t i = 0; i < tile.cells.size(); ++i) {
    const MapCell& cell = tile.cells[i];
    if (!cell.surface.observed()) continue;
    out.put(static_cast<std::uint16_t>(i));
    out.put(cell.alternative.observed());
    put(out, cell.surface);
    if (cell.alternative.observed()) put(out, cell.alternative);
  }
  return out.take();
}

Result<Tile> tile_from_bytes(const Bytes& bytes, const std::string& what) {
  ArchiveReader in(bytes);
  const std::uint32_t version = ArchiveReader(bytes).get<std::uint32_t>();
  if (Status s = in.expect_version(version == kWithoutCommonVariance ? version : kSubmapVersion, what); !s)
    return failure(s);
  Tile tile;
  const auto seen = in.get<std::uint32_t>();
  if (seen > tile.cells.size())
    return failure(ErrorCode::store_damaged, "is damaged", what, "run again into a new folder to rebuild the map");
  for (std::uint32_t i = 0; i < seen; ++i) {
    const auto index = in.get<std::uint16_t>();
    if (index >= tile.cells.size())
      return failure(ErrorCode::store_damaged, "is damaged", what, "run again into a new folder to rebuild the map");
    const bool has_rival = in.get<bool>();
    tile.cells[index].surface = get_surface(in, version);
    if (has_rival) tile.cells[index].alternative = get_surface(in, version);
    if (!is_sensible(tile.cells[index].surface) || !is_sensible(tile.cells[index].alternative))
      return failure(ErrorCode::store_damaged, "is damaged", what, "run again into a new folder to rebuild the map");
  }
  if (Status status = in.finish(what); !status) return failure(status);
  return tile;
}

}  // namespace spartan
