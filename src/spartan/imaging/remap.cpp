#include "spartan/imaging/remap.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "spartan/core/simd_target.h"

namespace spartan {
namespace {

using remap::Cell;
using remap::kBlock;
using remap::kCell;
using remap::kOne;
using remap::Place;

constexpr int kRowsPerPart = 16;
constexpr int kRowsAhead = 4;  // the memory has their time to bring the source

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
                       const Workers& workers, double depth_m, const std::string& simd)
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
  // A place beside the border by no more than places are rounded lies on it: else rounding errors would mask borders.
  const Eigen::Vector2d last(source_size.width - 1, source_size.height - 1);
  const auto on_sensor = [&](const Eigen::Vector2d& place) -> std::optional<Eigen::Vector2d> {
    constexpr double kBeside = 0.5 / kOne;
    const Eigen::Vector2d nearest = place.cwiseMax(0).cwiseMin(last);
    if (!((place - nearest).array().abs() <= kBeside).all()) return std::nullopt;
    return nearest;
  };
  const auto masked = [&](Place p) {
    const int below = std::min(p.y + 1, source_size.height - 1);
    return !self_mask.empty() && (self_mask(p.x, p.y) == 0 || self_mask(p.x + 1, p.y) == 0 ||
                                  self_mask(p.x, below) == 0 || self_mask(p.x + 1, below) == 0);
  };
  std::atomic<bool> all_valid = true;
  workers.for_each_part(0, view.size.height, kRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int left = 0; left < view.size.width; left += kCell) {
        CellEntries entries{};
        for (int i = 0, x = left; i < kCell && x < view.size.width; ++i, ++x) {
          const Eigen::Vector3d direction((x - view.centre_px.x()) / view.focal_px,
                                          (y - view.centre_px.y()) / view.focal_px, 1);
          const auto place = project(camera, camera_from_rectified * (depth_m * direction));
          Entry& entry = entries[static_cast<std::size_t>(i)];
          const auto seen = place ? on_sensor(*place) : std::nullopt;
          if (seen) entry = entry_of(*seen);
          entry.seen = entry.seen && !masked(entry.place);
          mask_(x, y) = entry.seen ? 255 : 0;
          if (!entry.seen) all_valid = false;
        }
        for (int i = 0; i < kCell; i += kBlock) {
          store_block(left + i, y, std::span(entries).subspan(static_cast<std::size_t>(i), kBlock));
        }
      }
    }
  });
  all_valid_ = all_valid;
}

RemapTable::Entry RemapTable::entry_of(const Eigen::Vector2d& place) const {
  const int fixed_x = static_cast<int>(std::lround(place.x() * kOne));
  const int fixed_y = static_cast<int>(std::lround(place.y() * kOne));
  // The last column is the whole way from the one before: the neighbour then always exists.
  const int x = std::min(fixed_x / kOne, source_size_.width - 2), y = fixed_y / kOne;
  return {{static_cast<std::int16_t>(x), static_cast<std::int16_t>(y)},
          static_cast<std::uint8_t>(fixed_x - x * kOne),
          static_cast<std::uint8_t>(fixed_y - y * kOne),
          true};
}

void RemapTable::store_block(int x, int y, std::span<const Entry> entries) {
  int left = source_size_.width, right = -1, first = source_size_.height, last = -1;
  for (const Entry& e : entries) {
    if (!e.seen) continue;
    left = std::min<int>(left, e.place.x);
    right = std::max<int>(right, e.place.x);
    first = std::min<int>(first, e.place.y);
    last = std::max<int>(last, e.place.y);
  }
  const bool any = right >= 0;
  // Every load stays inside its row.
  const int corner_x = any ? std::clamp(left, 0, std::max(0, source_size_.width - remap::kLoad)) : 0;
  const int corner_y = any ? first : 0;
  const bool scattered =
      source_size_.width < remap::kLoad || right - corner_x > remap::kLoad - 2 || last - corner_y > remap::kLargestStep;
  Cell& cell = cells_(x / kCell, y);
  const int block = x % kCell / kBlock;
  cell.corners[block] = {static_cast<std::int16_t>(corner_x), static_cast<std::int16_t>(corner_y)};
  cell.kinds[block] = scattered ? remap::kScattered : static_cast<std::uint8_t>(std::max(0, last - corner_y - 1));
  Scattered far{x, {}};
  for (int i = 0; i < kBlock; ++i) {
    const Entry& e = entries[static_cast<std::size_t>(i)];
    const int at = x % kCell + i;
    const int code = scattered ? 0 : 16 * (e.place.y - corner_y) + e.place.x - corner_x;
    cell.codes[at] = e.seen ? static_cast<std::uint8_t>(code) : remap::kUnseen;
    cell.part_x[at] = e.part_x;
    cell.part_y[at] = e.part_y;
    far.places[static_cast<std::size_t>(i)] = e.place;
  }
  if (scattered) scattered_[static_cast<std::size_t>(y)].push_back(far);
}

Eigen::Vector2d RemapTable::source_of(int x, int y) const {
  const Cell& cell = cells_(x / kCell, y);
  const int at = x % kCell, block = at / kBlock;
  Place place = remap::place_of(cell, at);
  if (cell.kinds[block] == remap::kScattered) {
    const auto& far = scattered_[static_cast<std::size_t>(y)];
    place = std::find_if(far.begin(), far.end(), [&](const Scattered& s) {
              return s.x == x / kBlock * kBlock;
            })->places[static_cast<std::size_t>(x % kBlock)];
  }
  return {place.x + cell.part_x[at] / static_cast<double>(kOne), place.y + cell.part_y[at] / static_cast<double>(kOne)};
}

std::size_t RemapTable::bytes() const {
  std::size_t count = static_cast<std::size_t>(cells_.stride() * cells_.height()) * sizeof(Cell);
  for (const auto& of_row : scattered_) count += of_row.size() * sizeof(Scattered);
  return count;
}

template <class Pixel>
void RemapTable::apply_any(ImageView<const Pixel> source, ImageView<Pixel> result, const Workers& workers) const {
  if (source.size() != source_size_ || result.size() != size()) {
    throw std::invalid_argument("RemapTable: the images have other sizes than the table");
  }
  workers.for_each_part(0, result.height(), kRowsPerPart, [&](int begin, int end) {
    const remap::Source<Pixel> from{source.data(), source.stride(), source.width(), source.height()};
    for (int y = begin; y < end; ++y) {
      Pixel* const out = result.row(y);
      const Cell* const ahead = cells_.row(std::min(y + kRowsAhead, result.height() - 1));
      kernel_of<Pixel>(kernels_)(cells_.row(y), ahead, size().width, from, out);
      for (const Scattered& far : scattered_[static_cast<std::size_t>(y)]) {
        for (int i = 0; i < kBlock && far.x + i < size().width; ++i) {
          const Cell& cell = cells_(far.x / kCell, y);
          const int at = far.x % kCell + i;
          if (cell.codes[at] == remap::kUnseen) continue;
          out[far.x + i] =
              remap::sample(from, far.places[static_cast<std::size_t>(i)], cell.part_x[at], cell.part_y[at]);
        }
      }
    }
  });
}

void RemapTable::apply(ImageView<const std::uint8_t> source, ImageView<std::uint8_t> result,
                       const Workers& workers) const {
  apply_any(source, result, workers);
}
void RemapTable::apply(ImageView<const std::uint16_t> source, ImageView<std::uint16_t> result,
                       const Workers& workers) const {
  apply_any(source, result, workers);
}
void RemapTable::apply(ImageView<const Rgb8> source, ImageView<Rgb8> result, const Workers& workers) const {
  apply_any(source, result, workers);
}
void RemapTable::apply(ImageView<const Rgb16> source, ImageView<Rgb16> result, const Workers& workers) const {
  apply_any(source, result, workers);
}

}  // namespace spartan
