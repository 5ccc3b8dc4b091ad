#include "spartan/system/internal/octomap_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace spartan::internal {
namespace {

constexpr std::size_t kMostVoxels = 50'000'000;          // 400 MB
constexpr int kDepth = 16, kOrigin = 1 << (kDepth - 1);  // levels of the tree, and the key of coordinate 0

// The path from the root to a voxel: three bits a level, x in the lowest, the root's children in the highest.
using VoxelPath = std::uint64_t;

VoxelPath path_of(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  VoxelPath path = 0;
  for (int level = kDepth - 1; level >= 0; --level) {
    const auto bit = [level](std::uint32_t key) { return VoxelPath{key >> static_cast<unsigned>(level) & 1U}; };
    path = path << 3U | bit(z) << 2U | bit(y) << 1U | bit(x);
  }
  return path;
}

// From the lowest to the highest elevation in a known cell and, where lower, the surface of its four neighbours.
Range column_of(const MapView& view, int c, int r) {
  Range column{view.elevation_min_m(c, r), view.elevation_max_m(c, r)};
  for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
    const int x = c + dx, y = r + dy;
    if (x < 0 || y < 0 || x >= view.window.width || y >= view.window.height || !(view.count(x, y) > 0)) continue;
    column.low = std::min(column.low, static_cast<double>(view.elevation_m(x, y)));
  }
  return column;
}

// Keys of the voxels of one cell: those of its place, and from the lowest to the highest one.
struct VoxelColumn {
  std::uint32_t x = 0, y = 0, low = 0, high = 0;
};

// Nothing for a cell that is beyond the keys of OctoMap.
std::optional<VoxelColumn> voxels_of(const MapView& view, int c, int r) {
  const Range column = column_of(view, c, r);
  const double x = view.window.west + c, y = view.window.north - 1 - r;
  const double low = std::floor(column.low / view.cell_m), high = std::floor(column.high / view.cell_m);
  if (std::max({std::abs(x), std::abs(y), std::abs(low), std::abs(high)}) >= kOrigin - 1) return std::nullopt;
  const auto key = [](double cell) { return static_cast<std::uint32_t>(static_cast<int>(cell) + kOrigin); };
  return VoxelColumn{key(x), key(y), key(low), key(high)};
}

Result<std::vector<VoxelPath>> occupied_voxels(const MapView& view) {
  const char* const remedy = "export a part of the map: `spartan map export --window`";
  std::vector<VoxelPath> voxels;
  for (int r = 0; r < view.window.height; ++r) {
    for (int c = 0; c < view.window.width; ++c) {
      if (!(view.count(c, r) > 0)) continue;
      const auto column = voxels_of(view, c, r);
      if (!column) {
        return failure(
            ErrorCode::usage,
            fmt::format("an OctoMap of {} m cells ends {:.0f} m from the origin", view.cell_m, kOrigin * view.cell_m),
            "", remedy);
      }
      if (voxels.size() + (column->high - column->low) > kMostVoxels)
        return failure(ErrorCode::usage, fmt::format("the map has more than {} voxels", kMostVoxels), "", remedy);
      for (std::uint32_t z = column->low; z <= column->high; ++z) voxels.push_back(path_of(column->x, column->y, z));
    }
  }
  std::sort(voxels.begin(), voxels.end());
  return voxels;
}

// Writes inner nodes in depth-first order, two bits a child: 00 unknown, 01 free, 10 occupied leaf, 11 inner node.
class OcTreeWriter {
 public:
  // `voxels`: sorted, all below one node of the given level.
  void write_node(std::span<const VoxelPath> voxels, int level) {
    std::array<std::span<const VoxelPath>, 8> children;
    for (std::size_t from = 0; from < voxels.size();) {
      const VoxelPath child = digit(voxels[from], level);
      std::size_t to = from + 1;
      while (to < voxels.size() && digit(voxels[to], level) == child) ++to;
      children[child] = voxels.subspan(from, to - from);
      from = to;
    }
    std::uint16_t states = 0;
    for (std::size_t i = 0; i < children.size(); ++i) {
      if (children[i].empty()) continue;
      ++nodes_;
      states |= static_cast<std::uint16_t>((is_leaf(children[i], level + 1) ? 2U : 3U) << 2 * i);
    }
    data_ += static_cast<char>(states & 0xffU);
    data_ += static_cast<char>(states >> 8U);
    for (const auto& child : children) {
      if (!child.empty() && !is_leaf(child, level + 1)) write_node(child, level + 1);
    }
  }

  std::size_t nodes() const { return nodes_; }
  const std::string& data() const { return data_; }

 private:
  static VoxelPath digit(VoxelPath path, int level) {
    return path >> 3U * static_cast<unsigned>(kDepth - 1 - level) & 7U;
  }
  // A voxel, or a node all of whose voxels are occupied.
  static bool is_leaf(std::span<const VoxelPath> voxels, int level) {
    return voxels.size() == VoxelPath{1} << 3U * static_cast<unsigned>(kDepth - level);
  }

  std::size_t nodes_ = 1;  // the root
  std::string data_;
};

}  // namespace

Result<std::string> octomap_file(const MapView& view) {
  const auto voxels = occupied_voxels(view);
  if (!voxels) return failure(voxels);
  OcTreeWriter writer;
  if (!voxels->empty()) writer.write_node(*voxels, 0);
  return fmt::format("# Octomap OcTree binary file\nid OcTree\nsize {}\nres {}\ndata\n",
                     voxels->empty() ? 0 : writer.nodes(), view.cell_m) +
         writer.data();
}

}  // namespace spartan::internal
