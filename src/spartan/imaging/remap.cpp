#include "spartan/imaging/remap.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace spartan {
namespace {

constexpr int kRowsPerPart = 16;
constexpr int kOne = 1 << RemapTable::kFractionBits;

}  // namespace

RemapTable::RemapTable(const CameraModel& camera, ImageSize source_size, const RectifiedStereo& view,
                       const Eigen::Matrix3d& camera_from_rectified, ImageView<const std::uint8_t> self_mask,
                       const Workers& workers)
    : source_size_(source_size), entries_(view.size), mask_(view.size) {
  constexpr int kLargest = std::numeric_limits<std::int16_t>::max();
  if (source_size.width < 2 || source_size.height < 2 || std::max(source_size.width, source_size.height) > kLargest) {
    throw std::invalid_argument("RemapTable: the source must be between 2 × 2 and 32767 × 32767 pixels");
  }
  if (!self_mask.empty() && self_mask.size() != source_size) {
    throw std::invalid_argument("RemapTable: the self-mask has another size than the source");
  }
  const auto seen = [&](const Eigen::Vector2d& place) {
    return place.x() >= 0 && place.y() >= 0 && place.x() <= source_size.width - 1 &&
           place.y() <= source_size.height - 1;
  };
  const auto masked = [&](const Entry& e) {
    return !self_mask.empty() && (self_mask(e.x, e.y) == 0 || self_mask(e.x + 1, e.y) == 0 ||
                                  self_mask(e.x, e.y + 1) == 0 || self_mask(e.x + 1, e.y + 1) == 0);
  };
  std::atomic<bool> all_valid = true;
  workers.for_each_part(0, view.size.height, kRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < view.size.width; ++x) {
        const Eigen::Vector3d direction((x - view.centre_px.x()) / view.focal_px,
                                        (y - view.centre_px.y()) / view.focal_px, 1);
        const auto place = project(camera, camera_from_rectified * direction);
        if (place && seen(*place)) {
          entries_(x, y) = entry_of(*place);
          mask_(x, y) = masked(entries_(x, y)) ? 0 : 255;
        }
        if (mask_(x, y) == 0) all_valid = false;
      }
    }
  });
  all_valid_ = all_valid;
}

RemapTable::Entry RemapTable::entry_of(const Eigen::Vector2d& place) const {
  const int fixed_x = static_cast<int>(std::lround(place.x() * kOne));
  const int fixed_y = static_cast<int>(std::lround(place.y() * kOne));
  // The last column is the whole way from the one before: the four neighbours then always exist.
  const int x = std::min(fixed_x / kOne, source_size_.width - 2), y = std::min(fixed_y / kOne, source_size_.height - 2);
  return {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), static_cast<std::uint8_t>(fixed_x - x * kOne),
          static_cast<std::uint8_t>(fixed_y - y * kOne)};
}

Eigen::Vector2d RemapTable::source_of(int x, int y) const {
  const Entry& e = entries_(x, y);
  return {e.x + e.part_x / static_cast<double>(kOne), e.y + e.part_y / static_cast<double>(kOne)};
}

void RemapTable::apply(ImageView<const std::uint8_t> source, ImageView<std::uint8_t> result,
                       const Workers& workers) const {
  if (source.size() != source_size_ || result.size() != size()) {
    throw std::invalid_argument("RemapTable: the images have other sizes than the table");
  }
  constexpr int kShift = 2 * kFractionBits, kHalf = 1 << (kShift - 1);
  const std::ptrdiff_t stride = source.stride();
  workers.for_each_part(0, result.height(), kRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const Entry* entries = entries_.row(y);
      const std::uint8_t* mask = mask_.row(y);
      std::uint8_t* out = result.row(y);
      for (int x = 0; x < result.width(); ++x) {
        const Entry e = entries[x];
        const std::uint8_t* p = source.data() + e.y * stride + e.x;
        const int above = (kOne - e.part_x) * p[0] + e.part_x * p[1];
        const int below = (kOne - e.part_x) * p[stride] + e.part_x * p[stride + 1];
        const int level = ((kOne - e.part_y) * above + e.part_y * below + kHalf) >> kShift;
        out[x] = static_cast<std::uint8_t>(level & mask[x]);
      }
    }
  });
}

}  // namespace spartan
