#include "spartan/image_io/internal/png_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "spartan/image_io/image_io.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;

// Noise on a gradient.
cv::Mat test_mat(int type, int width = 61, int height = 43) {
  cv::Mat noise(height, width, type);
  cv::RNG(static_cast<std::uint64_t>(width + type))
      .fill(noise, cv::RNG::UNIFORM, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
  cv::Mat smooth;
  cv::GaussianBlur(noise, smooth, {5, 5}, 2);
  return smooth;
}

std::string opencv_png(const cv::Mat& mat) {
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(".png", mat, bytes));
  return {bytes.begin(), bytes.end()};
}

cv::Mat opencv_decoded(const std::string& file, int flags) {
  cv::Mat mat = cv::imdecode(std::vector<char>(file.begin(), file.end()), flags);
  if (mat.channels() == 3) cv::cvtColor(mat, mat, cv::COLOR_BGR2RGB);
  return mat;
}

template <class Pixel>
std::string our_png(const cv::Mat& mat) {
  const auto view = as_view<Pixel>(mat);
  constexpr bool kRgb = std::is_same_v<Pixel, Rgb8> || std::is_same_v<Pixel, Rgb16>;
  return internal::encode_png({view.data(), view.size(), static_cast<std::size_t>(view.stride()) * sizeof(Pixel),
                               static_cast<int>(8 * sizeof(Pixel)) / (kRgb ? 3 : 1), kRgb});
}

cv::Mat swapped(const cv::Mat& rgb) {
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

double largest_difference(const FrameImage& image, const cv::Mat& expected) {
  const auto of = [&]<class Pixel>(Pixel) { return cv::norm(as_mat(image.as<Pixel>()), expected, cv::NORM_INF); };
  const bool rgb = image.format().layout == PixelLayout::rgb;
  if (image.format().bits == 16) return rgb ? of(Rgb16{}) : of(std::uint16_t{});
  return rgb ? of(Rgb8{}) : of(std::uint8_t{});
}

// A file with the colour type and the bits that libpng is told; the rows hold `samples` as they are.
std::string png_with(int colour_type, int bits, bool interlaced, int width, int height) {
  std::string file;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &file,
      [](png_structp p, png_bytep bytes, std::size_t size) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<const char*>(bytes), size);
      },
      nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits, colour_type,
               interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  std::vector<png_color> palette(std::size_t{1} << static_cast<unsigned>(std::min(bits, 8)));
  for (std::size_t i = 0; i < palette.size(); ++i)
    palette[i] = {static_cast<png_byte>(37 * i), static_cast<png_byte>(255 - 11 * i), static_cast<png_byte>(90 + i)};
  if (colour_type == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  png_write_info(png, info);
  const std::size_t row_bytes = png_get_rowbytes(png, info);
  std::vector<png_byte> data(row_bytes * static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<png_byte>(i * 29 + i / row_bytes * 7);
  std::vector<png_bytep> rows(static_cast<std::size_t>(height));
  for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = data.data() + y * row_bytes;
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return file;
}

TEST(PngFile, HasTheBytesThatOpenCvWrites) {
  for (const int width : {1, 7, 61, 640}) {
    const cv::Mat gray = test_mat(CV_8UC1, width), deep = test_mat(CV_16UC1, width);
    const cv::Mat rgb = test_mat(CV_8UC3, width), deep_rgb = test_mat(CV_16UC3, width);
    EXPECT_EQ(our_png<std::uint8_t>(gray), opencv_png(gray));
    EXPECT_EQ(our_png<std::uint16_t>(deep), opencv_png(deep));
    EXPECT_EQ(our_png<Rgb8>(rgb), opencv_png(swapped(rgb)));
    EXPECT_EQ(our_png<Rgb16>(deep_rgb), opencv_png(swapped(deep_rgb)));
  }
}

TEST(PngFile, EncodesAPartOfAnImage) {
  const cv::Mat whole = test_mat(CV_8UC1), part = whole(cv::Rect(5, 3, 20, 11));
  EXPECT_EQ(our_png<std::uint8_t>(part), opencv_png(part));
}

TEST(PngFile, DecodesAsOpenCv) {
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3}) {
    const std::string file = opencv_png(test_mat(type));
    const FrameImage stored = decode_png(file, PngColour::as_stored).value(),
                     gray = decode_png(file, PngColour::gray).value();
    EXPECT_EQ(largest_difference(stored, opencv_decoded(file, cv::IMREAD_ANYDEPTH | cv::IMREAD_ANYCOLOR)), 0) << type;
    EXPECT_EQ(gray.format(), (PixelFormat{PixelLayout::gray, 8}));
    EXPECT_EQ(largest_difference(gray, opencv_decoded(file, cv::IMREAD_GRAYSCALE)), 0) << type;
  }
}

struct Kind {
  int colour_type, bits;
};

TEST(PngFile, DecodesEveryKindOfFileAsOpenCv) {
  const std::vector<Kind> kinds{
      {PNG_COLOR_TYPE_GRAY, 1},        {PNG_COLOR_TYPE_GRAY, 2},      {PNG_COLOR_TYPE_GRAY, 4},
      {PNG_COLOR_TYPE_GRAY, 8},        {PNG_COLOR_TYPE_GRAY, 16},     {PNG_COLOR_TYPE_RGB, 8},
      {PNG_COLOR_TYPE_RGB, 16},        {PNG_COLOR_TYPE_PALETTE, 1},   {PNG_COLOR_TYPE_PALETTE, 4},
      {PNG_COLOR_TYPE_PALETTE, 8},     {PNG_COLOR_TYPE_RGBA, 8},      {PNG_COLOR_TYPE_RGBA, 16},
      {PNG_COLOR_TYPE_GRAY_ALPHA, 16}, {PNG_COLOR_TYPE_GRAY_ALPHA, 8}};
  for (const auto& [colour_type, bits] : kinds) {
    for (const bool interlaced : {false, true}) {
      SCOPED_TRACE(::testing::Message() << "colour type " << colour_type << ", " << bits << " bits, " << interlaced);
      const std::string file = png_with(colour_type, bits, interlaced, 21, 13);
      const auto image = decode_image(file, "a.png");
      ASSERT_TRUE(image) << image.error().message();
      // OpenCV makes three equal channels of gray with alpha.
      const bool gray = (colour_type & PNG_COLOR_MASK_COLOR) == 0;
      EXPECT_EQ(image->format().layout, gray ? PixelLayout::gray : PixelLayout::rgb);
      const int flags = cv::IMREAD_ANYDEPTH | (gray ? cv::IMREAD_GRAYSCALE : cv::IMREAD_ANYCOLOR);
      EXPECT_EQ(largest_difference(*image, opencv_decoded(file, flags)), 0);
      const auto luma = decode_png(file, PngColour::gray);
      ASSERT_TRUE(luma);
      EXPECT_EQ(largest_difference(*luma, opencv_decoded(file, cv::IMREAD_GRAYSCALE)), 0);
    }
  }
}

TEST(PngFile, SaysWhatIsDamaged) {
  std::string file = opencv_png(test_mat(CV_8UC1));
  const std::size_t data = file.find("IDAT");
  ASSERT_NE(data, std::string::npos);
  file[data + 40] = static_cast<char>(file[data + 40] ^ 0x10);
  const auto image = decode_image(file, "a.png");
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::input);
  EXPECT_THAT(image.error().message(), HasSubstr("a.png: PNG file is damaged: "));
}

}  // namespace
}  // namespace spartan::internal
