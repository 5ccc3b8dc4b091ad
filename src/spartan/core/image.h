// Images that own their pixels, non-owning views, and the georeference of raster maps.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace spartan {

/// Three interleaved channels, in memory order.
template <class T>
struct Rgb {
  T r{}, g{}, b{};
  friend bool operator==(const Rgb&, const Rgb&) = default;
};
using Rgb8 = Rgb<std::uint8_t>;
using Rgb16 = Rgb<std::uint16_t>;

/// Width and height in pixels.
struct ImageSize {
  int width = 0;
  int height = 0;
  bool empty() const { return width <= 0 || height <= 0; }
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

/// A non-owning view of a rectangle of pixels. Integer coordinates are pixel centres (docs/conventions.md).
/// `stride` is the distance between rows in pixels of type T.
template <class T>
class ImageView {
 public:
  ImageView() = default;
  ImageView(T* data, int width, int height, std::ptrdiff_t stride)
      : data_(data), width_(width), height_(height), stride_(stride) {}
  /// Conversion to a view of constant pixels.
  template <class Other>
    requires(std::is_const_v<T> && std::is_same_v<Other, std::remove_const_t<T>>)
  ImageView(const ImageView<Other>& other)
      : data_(other.data()), width_(other.width()), height_(other.height()), stride_(other.stride()) {}

  T* data() const { return data_; }
  int width() const { return width_; }
  int height() const { return height_; }
  ImageSize size() const { return {width_, height_}; }
  std::ptrdiff_t stride() const { return stride_; }
  bool empty() const { return width_ <= 0 || height_ <= 0; }

  T* row(int y) const { return data_ + y * stride_; }
  T& operator()(int x, int y) const { return row(y)[x]; }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  /// The sub-image with its top-left pixel at (x, y); throws std::out_of_range if it is not inside the view.
  ImageView crop(int x, int y, int width, int height) const {
    if (x < 0 || y < 0 || width < 0 || height < 0 || width > width_ - x || height > height_ - y) {
      throw std::out_of_range("ImageView::crop: the rectangle is not inside the image");
    }
    return {row(y) + x, width, height, stride_};
  }

 private:
  T* data_ = nullptr;
  int width_ = 0;
  int height_ = 0;
  std::ptrdiff_t stride_ = 0;
};

/// Memory for the pixels of an image, 64-byte aligned, to be released by std::free(). Large images begin at the address
/// of a huge page and ask the system for them, because the first access to each page of 4 KB costs more than the work
/// on its pixels. Throws std::bad_alloc.
void* allocate_pixels(std::size_t bytes);

/// An image that owns its pixels: rows are 64-byte aligned and padded to whole 64-byte blocks.
/// Movable; copied only by clone().
template <class T>
class Image {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  static constexpr std::size_t kAlignment = 64;

  Image() = default;
  /// Pixels are value-initialized (zero). Throws std::invalid_argument on a negative size.
  Image(int width, int height) : Image(width, height, T{}) {}
  explicit Image(ImageSize size) : Image(size.width, size.height) {}
  Image(int width, int height, T value) : width_(width), height_(height) {
    if (width < 0 || height < 0) throw std::invalid_argument("Image: negative size");
    const std::size_t row_bytes =
        (static_cast<std::size_t>(width) * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
    // sizeof(T) may not divide 64 (RGB: 3 bytes): rows are padded to a common multiple of both.
    std::size_t padded = row_bytes;
    while (padded % sizeof(T) != 0) padded += kAlignment;
    stride_ = static_cast<std::ptrdiff_t>(padded / sizeof(T));
    const std::size_t bytes = padded * static_cast<std::size_t>(height);
    if (bytes == 0) return;
    data_.reset(static_cast<T*>(allocate_pixels(bytes)));
    std::fill_n(data_.get(), bytes / sizeof(T), value);
  }
  Image(Image&& other) noexcept { swap(other); }
  Image& operator=(Image&& other) noexcept {
    Image moved(std::move(other));
    swap(moved);
    return *this;
  }

  Image clone() const {
    Image copy(width_, height_);
    for (int y = 0; y < height_; ++y) std::copy_n(row(y), width_, copy.row(y));
    return copy;
  }
  static Image copy_of(ImageView<const T> view) {
    Image copy(view.width(), view.height());
    for (int y = 0; y < view.height(); ++y) std::copy_n(view.row(y), view.width(), copy.row(y));
    return copy;
  }

  int width() const { return width_; }
  int height() const { return height_; }
  ImageSize size() const { return {width_, height_}; }
  std::ptrdiff_t stride() const { return stride_; }
  bool empty() const { return width_ <= 0 || height_ <= 0; }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }
  T* row(int y) { return data_.get() + y * stride_; }
  const T* row(int y) const { return data_.get() + y * stride_; }
  T& operator()(int x, int y) { return row(y)[x]; }
  const T& operator()(int x, int y) const { return row(y)[x]; }

  ImageView<T> view() { return {data(), width_, height_, stride_}; }
  ImageView<const T> view() const { return {data(), width_, height_, stride_}; }
  operator ImageView<T>() { return view(); }
  operator ImageView<const T>() const { return view(); }

  void fill(T value) { std::fill_n(data_.get(), stride_ * height_, value); }

 private:
  struct Free {
    void operator()(T* data) const { std::free(data); }
  };
  void swap(Image& other) noexcept {
    std::swap(width_, other.width_);
    std::swap(height_, other.height_);
    std::swap(stride_, other.stride_);
    std::swap(data_, other.data_);
  }

  int width_ = 0;
  int height_ = 0;
  std::ptrdiff_t stride_ = 0;
  std::unique_ptr<T, Free> data_;
};

/// What a value of a band means.
struct MapCategory {
  std::string name;
  Rgb8 colour;
};

/// One band of a raster map. Row 0 is the northernmost (largest y); NaN means "no data".
struct MapBand {
  std::string name;  ///< ends with the unit: `_m`, `_m2`, `_rad`
  ImageView<const float> values;
  std::vector<MapCategory> categories = {};  ///< of the values 0, 1, 2 …; empty: the values are quantities
};

/// From a lowest to a highest value.
struct Range {
  double low = 0, high = 1;
  double span() const { return high - low; }
};

/// Georeference of a north-up raster in the world plane, metres: x and y of its north-west corner and the side of a
/// cell (GDAL's geotransform without rotation).
struct GeoTransform {
  double west_m = 0, north_m = 0, cell_m = 1;
};

}  // namespace spartan
