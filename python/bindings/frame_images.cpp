#include "bindings/frame_images.h"

#include <memory>
#include <type_traits>
#include <utility>

#include "bindings/pixel_format.h"

namespace spartan::python {
namespace {

// Keeps an array alive. Images are released by any thread, also after the end of the interpreter.
std::shared_ptr<const void> keep(const AnyArray& array) {
  const auto release = [](const AnyArray* kept) {
    if (!nb::is_alive() || Py_IsInitialized() == 0) return;
    const nb::gil_scoped_acquire held;
    delete kept;
  };
  return std::shared_ptr<const AnyArray>(new AnyArray(array), release);
}

template <class Pixel>
FrameImage share(const AnyArray& array, const PixelFormat& format, const char* name) {
  return FrameImage::share<Pixel>(image_view<Pixel>(array, name), format, keep(array));
}

// Channels of 8 or 16 bits.
template <class Pixel, class Channel>
nb::object array_of_pixels(const FrameImage& image) {
  const ImageView<const Pixel> view = image.as<Pixel>();
  constexpr std::size_t channels = std::is_same_v<Pixel, Channel> ? 1 : 3;
  const nb::capsule owner(new FrameImage(image), [](void* p) noexcept { delete static_cast<FrameImage*>(p); });
  const std::array<std::size_t, 3> shape{static_cast<std::size_t>(view.height()),
                                         static_cast<std::size_t>(view.width()), channels};
  const std::array<std::int64_t, 3> strides{view.stride() * static_cast<std::int64_t>(channels),
                                            static_cast<std::int64_t>(channels), 1};
  return nb::cast(
      nb::ndarray<nb::numpy, const Channel>(view.data(), channels == 1 ? 2 : 3, shape.data(), owner, strides.data()));
}

}  // namespace

FrameImage image_of_array(const AnyArray& array, const std::string& layout, std::optional<int> bits,
                          const std::string& alignment, const char* name) {
  const bool wide = array.dtype() == nb::dtype<std::uint16_t>();
  const PixelFormat format = pixel_format(layout, bits.value_or(wide ? 16 : 8), alignment);
  if (format.layout == PixelLayout::rgb)
    return format.bits > 8 ? share<Rgb16>(array, format, name) : share<Rgb8>(array, format, name);
  return format.bits > 8 ? share<std::uint16_t>(array, format, name) : share<std::uint8_t>(array, format, name);
}

nb::object array_of_image(const FrameImage& image) {
  if (image.empty()) return nb::none();
  const bool wide = image.format().bytes_per_sample() == 2;
  if (image.format().layout == PixelLayout::rgb)
    return wide ? array_of_pixels<Rgb16, std::uint16_t>(image) : array_of_pixels<Rgb8, std::uint8_t>(image);
  return wide ? array_of_pixels<std::uint16_t, std::uint16_t>(image)
              : array_of_pixels<std::uint8_t, std::uint8_t>(image);
}

}  // namespace spartan::python
