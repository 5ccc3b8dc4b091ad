#include "spartan/imaging/internal/remap.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "spartan/numerics/simd_target.h"

namespace spartan::internal {
namespace {

using remap::Cell;
using remap::kBlock;
using remap::kCell;
using remap::kOne;
using remap::SourcePixel;

constexpr int kRemapRowsPerPart = 16;  // rows per task; does not affect results
constexpr int kPrefetchRows = 4;       // rows between prefetch and use of the source pixels; empirical

template <class Pixel>
auto kernel_of(const remap::Kernels& kernels) {
  if constexpr (std::is_same_v<Pixel, std::uint8_t>) return kernels.gray8;
  if constexpr (std::is_same_v<Pixel, std::uint16_t>) return kernels.gray16;
  if constexpr (std::is_same_v<Pixel, Rgb8>) return kernels.colour8;
  if constexpr (std::is_same_v<Pixel, Rgb16>) return kernels.colour16;
}

}  // namespace

RemapTable::RemapTable(const CameraModel& camera, ImageSize source_size, const RectifiedStereo& view,
                       const Eigen::Matrix3d& camera_from_rectified, ImageView<const std::uint8_t> self_mask,
                       const ThreadPool& workers, double depth_m, SimdTarget simd)
    : source_size_(source_size),
      kernels_(remap::kernels_for(simd_target_index(simd))),
      cells_((view.size.width + kCell - 1) / kCell, view.size.height),
      scattered_(static_cast<std::size_t>(view.size.height)),
      mask_(view.size) {
  constexpr int kLargest = std::numeric_limits<std::int16_t>::max();
  if (source_size.width < 2 || source_size.height < 2 || std::max(source_size.width, source_size.height) > kLargest) {
    throw std::invalid_argument("RemapTable: the source must be between 2 × 2 and 32767 × 32767 pixels");
  }
  if (!self_mask.empty() && self_mask.size() != source_size) {
    throw std::invalid_argument("RemapTable: the self-mask has another size than the source");
  }
  // Positions outside the sensor by no more than the rounding error are moved to its border; otherwise rounding errors
  // would mask border rows and columns.
  const Eigen::Vector2d last(source_size.width - 1, source_size.height - 1);
  const auto on_sensor = [&](const Eigen::Vector2d& pixel) -> std::optional<Eigen::Vector2d> {
    constexpr double kRounding = 0.5 / kOne;
    const Eigen::Vector2d nearest = pixel.cwiseMax(0).cwiseMin(last);
    if (!((pixel - nearest).array().abs() <= kRounding).all()) return std::nullopt;
    return nearest;
  };
  const auto masked = [&](SourcePixel p) {
    const int below = std::min(p.y + 1, source_size.height - 1);
    return !self_mask.empty() && (self_mask(p.x, p.y) == 0 || self_mask(p.x + 1, p.y) == 0 ||
                                  self_mask(p.x, below) == 0 || self_mask(p.x + 1, below) == 0);
  };
  std::atomic<bool> all_valid = true;
  workers.parallel_for(0, view.size.height, kRemapRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int left = 0; left < view.size.width; left += kCell) {
        CellEntries entries{};
        for (int i = 0, x = left; i < kCell && x < view.size.width; ++i, ++x) {
          const Eigen::Vector3d direction((x - view.centre_px.x()) / view.focal_px,
                                          (y - view.centre_px.y()) / view.focal_px, 1);
          const auto pixel = project(camera, camera_from_rectified * (depth_m * direction));
          Entry& entry = entries[static_cast<std::size_t>(i)];
          const auto inside = pixel ? on_sensor(*pixel) : std::nullopt;
          if (inside) entry = to_entry(*inside);
          entry.valid = entry.valid && !masked(entry.pixel);
          mask_(x, y) = entry.valid ? 255 : 0;
          if (!entry.valid) all_valid = false;
        }
        for (int i = 0; i < kCell; i += kBlock) {
          store_block(left + i, y, std::span(entries).subspan(static_cast<std::size_t>(i), kBlock));
        }
      }
    }
  });
  all_valid_ = all_valid;
}

RemapTable::Entry RemapTable::to_entry(const Eigen::Vector2d& pixel) const {
  const int fixed_x = static_cast<int>(std::lround(pixel.x() * kOne));
  const int fixed_y = static_cast<int>(std::lround(pixel.y() * kOne));
  // The last column is expressed as the one before it with fraction 1, so that the right neighbour always exists.
  const int x = std::min(fixed_x / kOne, source_size_.width - 2), y = fixed_y / kOne;
  return {{static_cast<std::int16_t>(x), static_cast<std::int16_t>(y)},
          static_cast<std::uint8_t>(fixed_x - x * kOne),
          static_cast<std::uint8_t>(fixed_y - y * kOne),
          true};
}

void RemapTable::store_block(int x, int y, std::span<const Entry> entries) {
  int left = source_size_.width, right = -1, first = source_size_.height, last = -1;
  for (const Entry& e : entries) {
    if (!e.valid) continue;
    left = std::min<int>(left, e.pixel.x);
    right = std::max<int>(right, e.pixel.x);
    first = std::min<int>(first, e.pixel.y);
    last = std::max<int>(last, e.pixel.y);
  }
  const bool any = right >= 0;
  // Loads of 16 bytes must stay inside the row.
  const int corner_x = any ? std::clamp(left, 0, std::max(0, source_size_.width - remap::kLoad)) : 0;
  const int corner_y = any ? first : 0;
  const bool scattered = source_size_.width < remap::kLoad || right - corner_x > remap::kLoad - 2 ||
                         last - corner_y > remap::kMaxRowOffset;
  Cell& cell = cells_(x / kCell, y);
  const int block = x % kCell / kBlock;
  cell.corners[block] = {static_cast<std::int16_t>(corner_x), static_cast<std::int16_t>(corner_y)};
  cell.kinds[block] = scattered ? remap::kScattered : static_cast<std::uint8_t>(std::max(0, last - corner_y - 1));
  Scattered block_entry{x, {}};
  for (int i = 0; i < kBlock; ++i) {
    const Entry& e = entries[static_cast<std::size_t>(i)];
    const int at = x % kCell + i;
    const int code = scattered ? 0 : 16 * (e.pixel.y - corner_y) + e.pixel.x - corner_x;
    cell.codes[at] = e.valid ? static_cast<std::uint8_t>(code) : remap::kInvalid;
    cell.fraction_x[at] = e.fraction_x;
    cell.fraction_y[at] = e.fraction_y;
    block_entry.pixels[static_cast<std::size_t>(i)] = e.pixel;
  }
  if (scattered) scattered_[static_cast<std::size_t>(y)].push_back(block_entry);
}

Eigen::Vector2d RemapTable::source_of(int x, int y) const {
  const Cell& cell = cells_(x / kCell, y);
  const int at = x % kCell, block = at / kBlock;
  SourcePixel pixel = remap::source_pixel(cell, at);
  if (cell.kinds[block] == remap::kScattered) {
    const auto& row_entries = scattered_[static_cast<std::size_t>(y)];
    pixel = std::find_if(row_entries.begin(), row_entries.end(), [&](const Scattered& s) {
              return s.x == x / kBlock * kBlock;
            })->pixels[static_cast<std::size_t>(x % kBlock)];
  }
  return {pixel.x + cell.fraction_x[at] / static_cast<double>(kOne),
          pixel.y + cell.fraction_y[at] / static_cast<double>(kOne)};
}

std::size_t RemapTable::bytes() const {
  std::size_t count = static_cast<std::size_t>(cells_.stride() * cells_.height()) * sizeof(Cell);
  for (const auto& of_row : scattered_) count += of_row.size() * sizeof(Scattered);
  return count;
}

template <class Pixel>
void RemapTable::apply_any(ImageView<const Pixel> source, ImageView<Pixel> result, const ThreadPool& workers) const {
  if (source.size() != source_size_ || result.size() != size()) {
    throw std::invalid_argument("RemapTable: the images have other sizes than the table");
  }
  workers.parallel_for(0, result.height(), kRemapRowsPerPart, [&](int begin, int end) {
    const remap::Source<Pixel> from{source.data(), source.stride(), source.width(), source.height()};
    for (int y = begin; y < end; ++y) {
      Pixel* const out = result.row(y);
      const Cell* const prefetched = cells_.row(std::min(y + kPrefetchRows, result.height() - 1));
      kernel_of<Pixel>(kernels_)(cells_.row(y), prefetched, size().width, from, out);
      for (const Scattered& block_entry : scattered_[static_cast<std::size_t>(y)]) {
        for (int i = 0; i < kBlock && block_entry.x + i < size().width; ++i) {
          const Cell& cell = cells_(block_entry.x / kCell, y);
          const int at = block_entry.x % kCell + i;
          if (cell.codes[at] == remap::kInvalid) continue;
          out[block_entry.x + i] = remap::sample(from, block_entry.pixels[static_cast<std::size_t>(i)],
                                                 cell.fraction_x[at], cell.fraction_y[at]);
        }
      }
    }
  });
}

void RemapTable::apply(ImageView<const std::uint8_t> source, ImageView<std::uint8_t> result,
                       const ThreadPool& workers) const {
  apply_any(source, result, workers);
}
void RemapTable::apply(ImageView<const std::uint16_t> source, ImageView<std::uint16_t> result,
                       const ThreadPool& workers) const {
  apply_any(source, result, workers);
}
void RemapTable::apply(ImageView<const Rgb8> source, ImageView<Rgb8> result, const ThreadPool& workers) const {
  apply_any(source, result, workers);
}
void RemapTable::apply(ImageView<const Rgb16> source, ImageView<Rgb16> result, const ThreadPool& workers) const {
  apply_any(source, result, workers);
}

}  // namespace spartan::internal
