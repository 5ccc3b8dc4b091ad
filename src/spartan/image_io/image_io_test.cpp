#include "spartan/image_io/image_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "spartan/image_io/internal/image_file_check.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/numerics/random.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {

using namespace internal;

namespace {

using testing::content_of;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

// A gradient with noise, so that every JPEG scan contains data.
Image<std::uint8_t> test_image(int width, int height) {
  Random random(static_cast<std::uint64_t>(width));
  Image<std::uint8_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image(x, y) = static_cast<std::uint8_t>(3 * x + 2 * y + static_cast<int>(random.below(40)));
  }
  return image;
}

std::string encode(const std::string& extension, const cv::Mat& mat, const std::vector<int>& flags = {}) {
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(extension, mat, bytes, flags));
  return {bytes.begin(), bytes.end()};
}

template <class Pixel>
void expect_same(ImageView<const Pixel> a, ImageView<const Pixel> b) {
  ASSERT_EQ(a.size(), b.size());
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) ASSERT_EQ(a(x, y), b(x, y)) << x << ", " << y;
  }
}

TEST(ImageIo, PngRoundTrips) {
  const TemporaryFolder folder;
  for (const int width : {1, 5, 64, 65}) {
    const Image<std::uint8_t> gray = test_image(width, 7);
    Image<std::uint16_t> deep(width, 7);
    Image<Rgb8> colour(width, 7);
    for (int y = 0; y < 7; ++y) {
      for (int x = 0; x < width; ++x) {
        deep(x, y) = static_cast<std::uint16_t>(gray(x, y) * 256 + x);
        colour(x, y) = {gray(x, y), static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(200 - y)};
      }
    }
    ASSERT_TRUE(write_png(folder.file("gray.png"), gray));
    ASSERT_TRUE(write_png(folder.file("deep.png"), deep));
    ASSERT_TRUE(write_png(folder.file("colour.png"), colour));
    const auto gray_back = read_image(folder.file("gray.png"));
    ASSERT_TRUE(gray_back);
    EXPECT_EQ(gray_back->format(), (PixelFormat{PixelLayout::gray, 8}));
    expect_same<std::uint8_t>(gray_back->as<std::uint8_t>(), gray);
    expect_same<std::uint8_t>(*read_gray8(folder.file("gray.png")), gray);
    const auto deep_back = read_image(folder.file("deep.png"));
    ASSERT_TRUE(deep_back);
    EXPECT_EQ(deep_back->format().bits, 16);
    expect_same<std::uint16_t>(deep_back->as<std::uint16_t>(), deep);
    expect_same<std::uint8_t>(*read_gray8(folder.file("deep.png")), gray);
    const auto colour_back = read_image(folder.file("colour.png"));
    ASSERT_TRUE(colour_back);
    EXPECT_EQ(colour_back->format().layout, PixelLayout::rgb);
    expect_same<Rgb8>(colour_back->as<Rgb8>(), colour);
  }
}

TEST(ImageIo, ColourBecomesGrayByLuma) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_png(folder.file("c.png"), Image<Rgb8>(3, 3, Rgb8{200, 100, 50})));
  const auto gray = read_gray8(folder.file("c.png"));
  ASSERT_TRUE(gray);
  EXPECT_NEAR((*gray)(1, 1), 0.299 * 200 + 0.587 * 100 + 0.114 * 50, 1.0);
}

TEST(ImageIo, FailedWritesReturnAnError) {
  const Status status = write_png("/proc/none/a.png", Image<std::uint8_t>(2, 2));
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::output);
  EXPECT_FALSE(write_pfm("/proc/none/a.pfm", Image<float>(2, 2)));
}

TEST(ImageIo, PfmRoundTripsWithUnknownValues) {
  const TemporaryFolder folder;
  Image<float> image(7, 3);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 7; ++x) image(x, y) = 0.1F * static_cast<float>(x) - 3.0F * static_cast<float>(y);
  }
  image(2, 1) = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(write_pfm(folder.file("a.pfm"), image));
  const std::string bytes = content_of(folder.file("a.pfm"));
  EXPECT_EQ(bytes.substr(0, 12), "Pf\n7 3\n-1.0\n");
  float first = 0;
  std::memcpy(&first, bytes.data() + 12, sizeof first);
  EXPECT_EQ(first, -6.0F) << "the bottom row comes first";
  const auto back = read_pfm(folder.file("a.pfm"));
  ASSERT_TRUE(back);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 7; ++x) {
      if (x == 2 && y == 1) {
        EXPECT_TRUE(std::isnan((*back)(x, y)));
      } else {
        EXPECT_EQ((*back)(x, y), image(x, y));
      }
    }
  }
}

TEST(ImageIo, ReadsBigEndianPfm) {
  const auto image = parse_pfm(std::string("Pf\n1 2\n1.0\n\x3F\x80\x00\x00\x7F\x80\x00\x00", 19), "a.pfm");
  ASSERT_TRUE(image) << image.error().message();
  EXPECT_EQ((*image)(0, 1), 1.0F);
  EXPECT_TRUE(std::isnan((*image)(0, 0))) << "inf means unknown";
}

TEST(ImageIo, RejectsTruncatedAndInvalidPfm) {
  const std::string whole = "Pf\n2 2\n-1.0\n" + std::string(16, '\0');
  ASSERT_TRUE(parse_pfm(whole, "a"));
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(parse_pfm(whole.substr(0, size), "a")) << size;
  for (const char* header : {"PF\n2 2\n-1.0\n", "Pf\n0 2\n-1.0\n", "Pf\n-2 2\n-1.0\n", "Pf\n2 2\n0\n", "Pf\n2 2\nnan\n",
                             "Pf\n99999 99999\n-1\n", "Pf\n99999999999999999999 2\n-1\n", "P5\n2 2\n255\n"}) {
    const auto image = parse_pfm(header + std::string(16, '\0'), "a.pfm");
    ASSERT_FALSE(image) << header;
    EXPECT_EQ(image.error().where, "a.pfm");
  }
}

// Files of every kind: each must be rejected if truncated anywhere, and accepted with trailing bytes.
struct Sample {
  const char* name;
  std::string bytes;
};
void PrintTo(const Sample& sample, std::ostream* out) {
  *out << sample.name;
}

std::vector<Sample> samples() {
  const Image<std::uint8_t> gray = test_image(61, 43);
  Image<Rgb8> colour(61, 43);
  for (int y = 0; y < 43; ++y) {
    for (int x = 0; x < 61; ++x) colour(x, y) = {gray(x, y), static_cast<std::uint8_t>(4 * x), 90};
  }
  const cv::Mat g = as_mat(gray), c = as_mat(colour);
  return {{"png", encode(".png", g)},
          {"jpeg", encode(".jpg", g)},
          {"jpeg_colour", encode(".jpg", c)},
          {"jpeg_progressive", encode(".jpg", c, {cv::IMWRITE_JPEG_PROGRESSIVE, 1})},
          {"jpeg_progressive_gray", encode(".jpg", g, {cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_QUALITY, 70})},
          {"jpeg_restarts", encode(".jpg", c, {cv::IMWRITE_JPEG_RST_INTERVAL, 1})},
          {"jpeg_optimized", encode(".jpg", c, {cv::IMWRITE_JPEG_OPTIMIZE, 1})},
          {"pgm", encode(".pgm", g)},
          {"ppm", encode(".ppm", c)}};
}

class ImageFile : public ::testing::TestWithParam<Sample> {};
INSTANTIATE_TEST_SUITE_P(Kinds, ImageFile, ::testing::ValuesIn(samples()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(ImageFile, IsDecoded) {
  const auto image = decode_image(GetParam().bytes, "a");
  ASSERT_TRUE(image) << image.error().message();
  EXPECT_EQ(image->size(), (ImageSize{61, 43}));
}

TEST_P(ImageFile, IsRejectedIfTruncatedAnywhere) {
  const std::string& whole = GetParam().bytes;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto image = decode_image(whole.substr(0, size), "cut");
    ASSERT_FALSE(image) << size << " of " << whole.size();
    EXPECT_EQ(image.error().code, ErrorCode::input);
    EXPECT_EQ(image.error().where, "cut");
  }
}

TEST_P(ImageFile, MayHaveTrailingBytes) {
  for (const std::string& tail : {std::string(1, '\0'), std::string(3, '\xFF'), std::string("\xFF\xD8 thumbnail")}) {
    const auto image = decode_image(GetParam().bytes + tail, "a");
    ASSERT_TRUE(image) << image.error().message();
  }
}

// An EXIF thumbnail is itself a JPEG inside a segment: its end marker does not end the image.
TEST(JpegFile, ThumbnailInASegmentDoesNotEndTheImage) {
  const Image<std::uint8_t> gray = test_image(61, 43);
  const std::string thumbnail = encode(".jpg", as_mat(gray));
  const std::string whole = encode(".jpg", as_mat(gray));
  const std::size_t length = thumbnail.size() + 2;
  const std::string table = std::string("\xFF\xE1") + static_cast<char>(length / 256) + static_cast<char>(length % 256);
  const std::string with = whole.substr(0, 2) + table + thumbnail + whole.substr(2);
  EXPECT_TRUE(decode_image(with, "a"));
  EXPECT_FALSE(decode_image(with.substr(0, with.size() - 300), "a"));
}

// Reference for the pixels: OpenCV's decoder, which is based on the same library.
TEST(JpegFile, DecodesAsOpenCv) {
  cv::Mat colour(33, 47, CV_8UC3), gray;
  cv::randu(colour, 0, 256);
  cv::GaussianBlur(colour, colour, {5, 5}, 2);
  cv::cvtColor(colour, gray, cv::COLOR_BGR2GRAY);
  const std::string rgb_file = encode(".jpg", colour), gray_file = encode(".jpg", gray);
  const auto decoded = [](const std::string& file, int flags) {
    return cv::imdecode(std::vector<char>(file.begin(), file.end()), flags);
  };
  cv::Mat rgb = decoded(rgb_file, cv::IMREAD_COLOR);
  cv::cvtColor(rgb, rgb, cv::COLOR_BGR2RGB);
  const FrameImage ours = decode_image(rgb_file, "a").value(), ours_gray = decode_image(gray_file, "a").value();
  EXPECT_EQ(ours.format().layout, PixelLayout::rgb);
  EXPECT_EQ(cv::norm(as_mat(ours.as<Rgb8>()), rgb, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(as_mat(ours_gray.as<std::uint8_t>()), decoded(gray_file, cv::IMREAD_GRAYSCALE), cv::NORM_INF), 0);
}

TEST(JpegFile, PaddingBeforeTheEndMarkerIsAllowed) {
  const std::string whole = encode(".jpg", as_mat(test_image(64, 48)));
  std::string padded = whole;
  padded.insert(whole.size() - 2, "\x20\x20\x20", 3);
  const auto image = decode_image(padded, "b.jpg");
  ASSERT_TRUE(image) << image.error().message();
  const auto plain = decode_image(whole, "a.jpg").value();
  EXPECT_EQ(cv::norm(as_mat(image->as<std::uint8_t>()), as_mat(plain.as<std::uint8_t>()), cv::NORM_INF), 0);
}

// All markers are present, but part of the data between them is missing.
TEST(JpegFile, DamagedScanDataAreDetected) {
  const std::string whole = encode(".jpg", as_mat(test_image(64, 48)));
  const std::size_t scan = whole.find("\xFF\xDA");
  ASSERT_NE(scan, std::string::npos);
  std::string cut = whole;
  cut.erase(scan + 60, (whole.size() - scan) / 2);
  const auto refused = decode_image(cut, "b.jpg");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::input);
  EXPECT_THAT(refused.error().message(), HasSubstr("b.jpg: JPEG file is damaged: "));
}

TEST(JpegFile, FillBytesBeforeAMarkerAreAllowed) {
  std::string bytes = encode(".jpg", as_mat(test_image(16, 16)));
  bytes.insert(bytes.size() - 2, "\xFF\xFF");
  bytes.insert(2, "\xFF");
  EXPECT_TRUE(decode_image(bytes, "a"));
}

TEST(ImageIo, RejectsFilesThatAreNotImages) {
  const TemporaryFolder folder;
  const auto error_of = [](const auto& result) {
    EXPECT_FALSE(result);
    return result ? std::string() : result.error().message();
  };
  EXPECT_THAT(error_of(read_image(folder.write("empty.png", ""))), HasSubstr("empty.png: file is empty"));
  EXPECT_THAT(error_of(read_gray8(folder.write("empty.png", ""))), HasSubstr("empty.png: file is empty"));
  EXPECT_THAT(error_of(read_image(folder.path() + "/none.png")), HasSubstr("none.png"));
  EXPECT_THAT(error_of(read_image(folder.path())), HasSubstr("folder"));
  EXPECT_THAT(error_of(read_image(folder.write("a.png", "some text"))), HasSubstr("not a PNG"));
  EXPECT_FALSE(decode_image("P5\n0 0\n255\n", "a"));
  EXPECT_FALSE(decode_image("P5\n30000 30000\n255\n", "a"));
  EXPECT_FALSE(decode_image("\xFF\xD8\xFF\xD9", "a"));
  Random random(1);
  for (int n = 0; n < 200; ++n) {
    std::string noise(1 + random.below(400), '\0');
    for (char& c : noise) c = static_cast<char>(random.below(256));
    EXPECT_FALSE(decode_image(noise, "noise"));
    EXPECT_FALSE(decode_image("\x89PNG\r\n\x1a\n" + noise, "noise"));
    EXPECT_FALSE(decode_image("\xFF\xD8" + noise, "noise"));
  }
}

TEST(ImageIo, DamageInsideAPngIsDetected) {
  const std::string whole = encode(".png", as_mat(test_image(61, 43)));
  for (std::size_t at = 60; at + 20 < whole.size(); at += 97) {  // inside the pixel data
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    EXPECT_FALSE(decode_image(damaged, "a")) << at;
  }
}

TEST(ImageIo, ImplausibleSizesAreRejected) {
  std::string png = encode(".png", as_mat(test_image(8, 8)));
  png[16] = '\x7F';  // first byte of the width
  EXPECT_THAT(decode_image(png, "a").error().what, HasSubstr("implausible image size"));
  std::string jpeg = encode(".jpg", as_mat(test_image(8, 8)));
  const std::size_t frame = jpeg.find("\xFF\xC0");
  ASSERT_NE(frame, std::string::npos);
  jpeg[frame + 5] = jpeg[frame + 7] = '\x7F';
  EXPECT_THAT(decode_image(jpeg, "a").error().what, HasSubstr("implausible image size"));
}

// Images from many sources: cameras of rovers and cars, NASA's archive, OpenCV's examples.
TEST(ImageFileReal, IntactFilesAreAccepted) {
  const char* const set = std::getenv("SPARTAN_DATA");
  const char* const source = std::getenv("SPARTAN_SOURCE_DIR");
  const std::string data = set ? set : source ? std::string(source) + "/../shared/data" : "";
  if (!std::filesystem::is_directory(data)) GTEST_SKIP() << "no real data (SPARTAN_DATA)";
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".png" && extension != ".jpg" && extension != ".jpeg") continue;
    EXPECT_EQ(image_file_error(content_of(entry.path().string())), "") << entry.path();
    ++count;
  }
  EXPECT_GT(count, 0);
}

}  // namespace
}  // namespace spartan
