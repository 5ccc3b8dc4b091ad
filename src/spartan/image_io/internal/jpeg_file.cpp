#include "spartan/image_io/internal/jpeg_file.h"

#include <turbojpeg.h>

#include <memory>
#include <string>
#include <type_traits>

#include "spartan/image_io/image_io.h"
#include "spartan/image_io/internal/image_file_check.h"

namespace spartan {

namespace internal {
namespace {

struct Destroy {
  void operator()(void* decoder) const { tjDestroy(decoder); }
};
using Decoder = std::unique_ptr<void, Destroy>;  // or encoder

// Some cameras pad the image data. If only the end marker (0xd9) follows the padding, all data were read. The decoder
// reports only its first warning.
bool is_harmless(const Decoder& decoder) {
  const std::string_view warning = tjGetErrorStr2(decoder.get());
  return tjGetErrorCode(decoder.get()) == TJERR_WARNING &&
         warning.find("extraneous bytes before marker 0xd9") != std::string_view::npos;
}

template <class Pixel>
Result<FrameImage> decode_as(const Decoder& decoder, std::string_view content, ImageSize size, PixelLayout layout) {
  constexpr int kFormat = std::is_same_v<Pixel, Rgb8> ? TJPF_RGB : TJPF_GRAY;
  Image<Pixel> pixels(size);
  const int bytes_per_row = static_cast<int>(pixels.stride() * static_cast<std::ptrdiff_t>(sizeof(Pixel)));
  const auto* jpeg = reinterpret_cast<const unsigned char*>(content.data());
  const int error = tjDecompress2(decoder.get(), jpeg, content.size(), reinterpret_cast<unsigned char*>(pixels.data()),
                                  size.width, bytes_per_row, size.height, kFormat, 0);
  if (error != 0 && !is_harmless(decoder)) {
    return failure(ErrorCode::input, std::string("JPEG file is damaged: ") + tjGetErrorStr2(decoder.get()));
  }
  return FrameImage::own(std::move(pixels), {layout, 8, BitAlignment::low});
}

}  // namespace

Result<FrameImage> decode_jpeg(std::string_view content, JpegColour colour) {
  const Decoder decoder(tjInitDecompress());
  if (!decoder) return failure(ErrorCode::internal, "cannot create the JPEG decoder");
  ImageSize size;
  int subsampling = 0, stored = 0;
  const auto* jpeg = reinterpret_cast<const unsigned char*>(content.data());
  if (tjDecompressHeader3(decoder.get(), jpeg, content.size(), &size.width, &size.height, &subsampling, &stored) != 0) {
    return failure(ErrorCode::input, std::string("JPEG file is damaged: ") + tjGetErrorStr2(decoder.get()));
  }
  if (size.empty() || size.width > static_cast<int>(kMaxImageSide) || size.height > static_cast<int>(kMaxImageSide)) {
    return failure(ErrorCode::input, "JPEG header with an implausible image size");
  }
  if (colour == JpegColour::gray || stored == TJCS_GRAY) {
    return decode_as<std::uint8_t>(decoder, content, size, PixelLayout::gray);
  }
  return decode_as<Rgb8>(decoder, content, size, PixelLayout::rgb);
}

}  // namespace internal

Result<std::string> encode_jpeg(ImageView<const std::uint8_t> image, int quality) {
  const internal::Decoder encoder(tjInitCompress());
  if (!encoder) return failure(ErrorCode::internal, "cannot create the JPEG encoder");
  unsigned char* bytes = nullptr;
  unsigned long count = 0;
  const int error = tjCompress2(encoder.get(), image.data(), image.width(), static_cast<int>(image.stride()),
                                image.height(), TJPF_GRAY, &bytes, &count, TJSAMP_GRAY, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owner(bytes, &tjFree);
  if (error != 0)
    return failure(ErrorCode::internal, std::string("cannot encode a JPEG: ") + tjGetErrorStr2(encoder.get()));
  return std::string(reinterpret_cast<const char*>(bytes), count);
}

}  // namespace spartan
