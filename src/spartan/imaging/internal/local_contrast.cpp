#include "spartan/imaging/internal/local_contrast.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "spartan/imaging/internal/mirrored.h"

namespace spartan::internal {
namespace {

constexpr int kBlendRowsPerPart = 32;  // rows per task; does not affect results
constexpr int kWeightBits = 11;        // fraction bits of the bilinear weights

}  // namespace

LocalContrast::TilePair LocalContrast::tiles_around(int at, int tile) const {
  // In half pixels, relative to the centre of the first tile.
  const int from_middle = 2 * at - tile, step = 2 * tile;
  const int before = from_middle < 0 ? -1 : from_middle / step;
  const int rest = from_middle - before * step;
  return {std::max(before, 0), std::min(before + 1, tiles_ - 1), ((rest << kWeightBits) + tile) / step};
}

LocalContrast::LocalContrast(int tiles, double clip_limit)
    : tiles_(tiles),
      clip_limit_(clip_limit),
      mappings_(static_cast<std::size_t>(std::max(tiles, 0)) * static_cast<std::size_t>(std::max(tiles, 0)) * 256) {
  if (tiles < 1 || !(clip_limit >= 1))
    throw std::invalid_argument("LocalContrast: needs at least one tile and a clip limit of at least 1");
}

void LocalContrast::make_mapping(ImageView<const std::uint8_t> image, ImageSize tile, int tile_x, int tile_y) {
  std::array<int, 256> counts{};
  const int left = tile_x * tile.width, right = left + tile.width, inside = std::min(right, image.width());
  for (int j = 0; j < tile.height; ++j) {
    const std::uint8_t* const row = image.row(mirrored(tile_y * tile.height + j, image.height()));
    for (int x = left; x < inside; ++x) ++counts[row[x]];
    for (int x = std::max(left, inside); x < right; ++x) ++counts[row[mirrored(x, image.width())]];
  }
  const int area = tile.width * tile.height;
  const int limit = std::max(1, static_cast<int>(clip_limit_ * area / 256));
  int excess = 0;
  for (int& count : counts) {
    excess += std::max(0, count - limit);
    count = std::min(count, limit);
  }
  // The remainder of the division by 256 goes to levels at equal distances.
  const int rest = excess % 256;
  for (int& count : counts) count += excess / 256;
  for (int i = 0; i < rest; ++i) ++counts[static_cast<std::size_t>(i * std::max(256 / rest, 1))];
  std::uint8_t* const out = mapping(tile_x, tile_y);
  std::int64_t below = 0;
  for (std::size_t level = 0; level < 256; ++level) {
    below += counts[level];
    // Round half to even, as OpenCV does.
    const std::int64_t whole = 255 * below / area, twice_rest = 2 * (255 * below % area);
    const bool up = twice_rest > area || (twice_rest == area && whole % 2 == 1);
    out[level] = static_cast<std::uint8_t>(whole + (up ? 1 : 0));
  }
}

void LocalContrast::apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result,
                          const ThreadPool& workers) {
  if (image.size() != result.size()) throw std::invalid_argument("LocalContrast: the sizes differ");
  if (image.empty()) return;
  const ImageSize tile{(image.width() + tiles_ - 1) / tiles_, (image.height() + tiles_ - 1) / tiles_};
  columns_.resize(static_cast<std::size_t>(image.width()));
  for (int x = 0; x < image.width(); ++x) columns_[static_cast<std::size_t>(x)] = tiles_around(x, tile.width);
  workers.parallel_for(0, tiles_, 1, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < tiles_; ++x) make_mapping(image, tile, x, y);
    }
  });
  workers.parallel_for(0, image.height(), kBlendRowsPerPart, [&](int begin, int end) {
    constexpr int kOne = 1 << kWeightBits, kHalf = 1 << (2 * kWeightBits - 1);
    for (int y = begin; y < end; ++y) {
      const TilePair rows = tiles_around(y, tile.height);
      const std::uint8_t* const in = image.row(y);
      std::uint8_t* const out = result.row(y);
      const std::uint8_t* const mappings[2] = {mapping(0, rows.first), mapping(0, rows.second)};
      const TilePair* const around = columns_.data();
      for (int x = 0, width = image.width(); x < width; ++x) {
        const TilePair columns = around[x];
        const int above = (kOne - columns.weight) * mappings[0][256 * columns.first + in[x]] +
                          columns.weight * mappings[0][256 * columns.second + in[x]];
        const int below = (kOne - columns.weight) * mappings[1][256 * columns.first + in[x]] +
                          columns.weight * mappings[1][256 * columns.second + in[x]];
        out[x] = static_cast<std::uint8_t>(((kOne - rows.weight) * above + rows.weight * below + kHalf) >>
                                           (2 * kWeightBits));
      }
    }
  });
}

}  // namespace spartan::internal
