#include "spartan/image_io/internal/png_file.h"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <vector>

namespace spartan::internal {
namespace {

// What the callbacks of libpng share. libpng leaves its functions by longjmp(), which must not pass over destructors:
// no callback that fails owns anything, and run() is given steps without local objects.
struct PngState {
  std::string_view unread;  // of the file that is decoded
  std::string written;      // of the file that is encoded
  bool out_of_memory = false;
  std::array<char, 128> message{};
};

PngState& state_of(png_structp png) {
  return *static_cast<PngState*>(png_get_error_ptr(png));
}

[[noreturn]] void fail(png_structp png, png_const_charp message) {
  std::snprintf(state_of(png).message.data(), state_of(png).message.size(), "%s", message);
  png_longjmp(png, 1);
}

void ignore(png_structp, png_const_charp) {}  // warnings are of chunks that are not needed

png_voidp allocate(png_structp png, png_alloc_size_t size) {
  void* const memory = std::malloc(size);
  if (memory == nullptr) static_cast<PngState*>(png_get_mem_ptr(png))->out_of_memory = true;
  return memory;
}
void release(png_structp, png_voidp memory) {
  std::free(memory);
}

void read_bytes(png_structp png, png_bytep out, std::size_t size) {
  std::string_view& unread = state_of(png).unread;
  if (unread.size() < size) png_error(png, "the file ends early");
  std::copy_n(unread.begin(), size, out);
  unread.remove_prefix(size);
}

void write_bytes(png_structp png, png_bytep bytes, std::size_t size) {
  try {
    state_of(png).written.append(reinterpret_cast<const char*>(bytes), size);
  } catch (const std::bad_alloc&) {
    state_of(png).out_of_memory = true;
  }
  if (state_of(png).out_of_memory) png_error(png, "out of memory");
}
void flush(png_structp) {}

// False if one of the steps fails; the reason is in the state. Throws std::bad_alloc if it is memory.
template <class Steps>
bool run(png_structp png, const Steps& steps) {
  // NOLINTNEXTLINE(cert-err52-cpp, modernize-avoid-setjmp-longjmp): the error handling of libpng
  if (setjmp(png_jmpbuf(png)) == 0) {
    steps();
    return true;
  }
  if (state_of(png).out_of_memory) throw std::bad_alloc();
  return false;
}

class PngReader {
 public:
  explicit PngReader(std::string_view content) {
    state_.unread = content;
    png_ = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, &state_, fail, ignore, &state_, allocate, release);
    info_ = png_ == nullptr ? nullptr : png_create_info_struct(png_);
    if (info_ == nullptr) {
      png_destroy_read_struct(&png_, nullptr, nullptr);
      throw std::bad_alloc();
    }
    png_set_read_fn(png_, &state_,
                    [](png_structp png, png_bytep out, std::size_t size) { read_bytes(png, out, size); });
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  PngReader(PngReader&&) = delete;
  PngReader& operator=(PngReader&&) = delete;

  Result<FrameImage> decode(PngColour colour) {
    const bool header = run(png_, [&] {
      png_read_info(png_, info_);
      transform(colour);
      png_read_update_info(png_, info_);
    });
    if (!header) return damaged();
    const bool rgb = (png_get_color_type(png_, info_) & PNG_COLOR_MASK_COLOR) != 0;
    if (png_get_bit_depth(png_, info_) == 16) return rgb ? rows_of<Rgb16>() : rows_of<std::uint16_t>();
    return rgb ? rows_of<Rgb8>() : rows_of<std::uint8_t>();
  }

 private:
  // Of gray, RGB or a palette, with or without alpha, to what decode_png() promises.
  void transform(PngColour colour) {
    const int stored = png_get_color_type(png_, info_), bits = png_get_bit_depth(png_, info_);
    if (bits == 16 && colour == PngColour::gray) {
      png_set_strip_16(png_);
    } else if (std::endian::native == std::endian::little) {
      png_set_swap(png_);
    }
    png_set_strip_alpha(png_);
    if (stored == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if ((stored & PNG_COLOR_MASK_COLOR) == 0 && bits < 8) png_set_expand_gray_1_2_4_to_8(png_);
    if (colour == PngColour::gray) png_set_rgb_to_gray(png_, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
    png_set_interlace_handling(png_);
  }

  template <class Pixel>
  Result<FrameImage> rows_of() {
    Image<Pixel> image(static_cast<int>(png_get_image_width(png_, info_)),
                       static_cast<int>(png_get_image_height(png_, info_)));
    if (png_get_rowbytes(png_, info_) != static_cast<std::size_t>(image.width()) * sizeof(Pixel))
      throw std::logic_error("decode_png: libpng gives rows of another size");
    std::vector<png_bytep> rows(static_cast<std::size_t>(image.height()));
    for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = reinterpret_cast<png_bytep>(image.row(static_cast<int>(y)));
    const bool complete = run(png_, [&] {
      png_read_image(png_, rows.data());
      png_read_end(png_, nullptr);
    });
    if (!complete) return damaged();
    constexpr bool kRgb = std::is_same_v<Pixel, Rgb8> || std::is_same_v<Pixel, Rgb16>;
    constexpr int kSampleBits = static_cast<int>(8 * sizeof(Pixel) / (kRgb ? 3 : 1));
    return FrameImage::own(std::move(image),
                           {kRgb ? PixelLayout::rgb : PixelLayout::gray, kSampleBits, BitAlignment::low});
  }

  tl::unexpected<Error> damaged() const {
    return failure(ErrorCode::input, std::string("PNG file is damaged: ") + state_.message.data());
  }

  PngState state_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace

Result<FrameImage> decode_png(std::string_view content, PngColour colour) {
  return PngReader(content).decode(colour);
}

std::string encode_png(const PngPixels& pixels) {
  PngState state;
  png_structp png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &state, fail, ignore, &state, allocate, release);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  struct Destroy {
    png_structp& png;
    png_infop& info;
    ~Destroy() { png_destroy_write_struct(&png, &info); }
  } const destroy{png, info};
  if (info == nullptr) throw std::bad_alloc();
  const auto* const first = static_cast<png_const_bytep>(pixels.data);
  const bool done = run(png, [&] {
    png_set_write_fn(png, &state, write_bytes, flush);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(png, Z_BEST_SPEED);
    png_set_compression_strategy(png, Z_RLE);
    png_set_IHDR(png, info, static_cast<png_uint_32>(pixels.size.width), static_cast<png_uint_32>(pixels.size.height),
                 pixels.bits, pixels.rgb ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    if (std::endian::native == std::endian::little) png_set_swap(png);
    for (int y = 0; y < pixels.size.height; ++y) {
      png_write_row(png, first + static_cast<std::size_t>(y) * pixels.row_bytes);
    }
    png_write_end(png, info);
  });
  if (!done) throw std::logic_error(std::string("encode_png: ") + state.message.data());
  return std::move(state.written);
}

}  // namespace spartan::internal
