#include "spartan/imaging/debayer.h"

#include <stdexcept>

namespace spartan {
namespace {

constexpr int kRowsPerPart = 32;

template <class T>
void store(Rgb<T>& pixel, const Rgb<T>& colour) {
  pixel = colour;
}
template <class T>
void store(T& pixel, const Rgb<T>& colour) {
  pixel = luma(colour);
}

/// Where red stands in the top-left 2×2 block.
struct RedPlace {
  int x, y;
};

RedPlace red_place(PixelLayout layout) {
  switch (layout) {
    case PixelLayout::bayer_rggb:
      return {0, 0};
    case PixelLayout::bayer_grbg:
      return {1, 0};
    case PixelLayout::bayer_gbrg:
      return {0, 1};
    case PixelLayout::bayer_bggr:
      return {1, 1};
    case PixelLayout::gray:
    case PixelLayout::rgb:
      break;
  }
  throw std::invalid_argument("debayer: the layout is no Bayer pattern");
}

template <class T>
T mean(unsigned a, unsigned b) {
  return static_cast<T>((a + b + 1) / 2);
}
template <class T>
T mean(unsigned a, unsigned b, unsigned c, unsigned d) {
  return static_cast<T>((a + b + c + d + 2) / 4);
}

/// One row of the mosaic between its neighbours; `red_row` tells red rows from blue ones.
template <class T>
struct MosaicRow {
  const T *above, *here, *below;
  bool red_row;
  int red_or_blue_x;  ///< 0 or 1: the columns of the sample that is not green

  Rgb<T> colour(int left, int x, int right) const {
    if ((x & 1) == red_or_blue_x) {
      const T own = here[x];
      const T green = mean<T>(above[x], below[x], here[left], here[right]);
      const T other = mean<T>(above[left], above[right], below[left], below[right]);
      return red_row ? Rgb<T>{own, green, other} : Rgb<T>{other, green, own};
    }
    const T beside = mean<T>(here[left], here[right]), upright = mean<T>(above[x], below[x]);
    return red_row ? Rgb<T>{beside, here[x], upright} : Rgb<T>{upright, here[x], beside};
  }
};

template <class T, class Pixel>
void debayer_any(ImageView<const T> mosaic, PixelLayout layout, ImageView<Pixel> result, const Workers& workers) {
  const RedPlace red = red_place(layout);
  if (mosaic.size() != result.size()) throw std::invalid_argument("debayer: the sizes differ");
  const int width = mosaic.width(), height = mosaic.height();
  if (width < 2 || height < 2) throw std::invalid_argument("debayer: a mosaic has at least 2 × 2 samples");
  workers.for_each_part(0, height, kRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const bool red_row = (y & 1) == red.y;
      const MosaicRow<T> row{mosaic.row(y > 0 ? y - 1 : 1), mosaic.row(y), mosaic.row(y + 1 < height ? y + 1 : y - 1),
                             red_row, red_row ? red.x : 1 - red.x};
      Pixel* out = result.row(y);
      store(out[0], row.colour(1, 0, 1));
      for (int x = 1; x + 1 < width; ++x) store(out[x], row.colour(x - 1, x, x + 1));
      store(out[width - 1], row.colour(width - 2, width - 1, width - 2));
    }
  });
}

}  // namespace

void debayer(ImageView<const std::uint8_t> mosaic, PixelLayout layout, ImageView<Rgb8> result, const Workers& workers) {
  debayer_any(mosaic, layout, result, workers);
}
void debayer(ImageView<const std::uint16_t> mosaic, PixelLayout layout, ImageView<Rgb16> result,
             const Workers& workers) {
  debayer_any(mosaic, layout, result, workers);
}
void debayer(ImageView<const std::uint8_t> mosaic, PixelLayout layout, ImageView<std::uint8_t> result,
             const Workers& workers) {
  debayer_any(mosaic, layout, result, workers);
}
void debayer(ImageView<const std::uint16_t> mosaic, PixelLayout layout, ImageView<std::uint16_t> result,
             const Workers& workers) {
  debayer_any(mosaic, layout, result, workers);
}

}  // namespace spartan
