#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "spartan/image_io/image_io.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using std::string_view_literals::operator""sv;

std::string encoded(const std::string& extension, int width, int height, const std::vector<int>& flags = {}) {
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(extension, cv::Mat(height, width, CV_8UC1, cv::Scalar(90)), bytes, flags));
  return {bytes.begin(), bytes.end()};
}

TEST(ImageHeader, FindsTheSizeWithoutDecoding) {
  for (const char* extension : {".png", ".jpg", ".pgm"}) {
    const std::string file = encoded(extension, 61, 43);
    EXPECT_EQ(parse_image_size(file), (ImageSize{61, 43})) << extension;
  }
  EXPECT_EQ(parse_image_size(encoded(".jpg", 640, 480, {cv::IMWRITE_JPEG_PROGRESSIVE, 1})), (ImageSize{640, 480}));
  EXPECT_EQ(parse_image_size(encoded(".png", 61, 43).substr(0, 24)), (ImageSize{61, 43}));
  EXPECT_EQ(parse_image_size("P5 # a remark 99 99\n# more\n 7\n3 255\n"), (ImageSize{7, 3}));
}

TEST(ImageHeader, IgnoresEmbeddedThumbnails) {
  const std::string thumbnail = encoded(".jpg", 16, 8), pixels = encoded(".jpg", 61, 43);
  const std::size_t length = thumbnail.size() + 2;
  const std::string block =
      std::string("\xFF\xE1") + static_cast<char>(length / 256) + static_cast<char>(length % 256) + thumbnail;
  EXPECT_EQ(parse_image_size(pixels.substr(0, 2) + block + pixels.substr(2)), (ImageSize{61, 43}));
}

TEST(ImageHeader, ReturnsNothingWithoutAValidHeader) {
  EXPECT_FALSE(parse_image_size(""));
  EXPECT_FALSE(parse_image_size("some text"));
  EXPECT_FALSE(parse_image_size("P5\n-3 5\n255\n"));
  EXPECT_FALSE(parse_image_size("P5\n99999 5\n255\n"));
  EXPECT_FALSE(parse_image_size("P5 # never ends"));
  EXPECT_FALSE(parse_image_size("\x89PNG\r\n\x1a\n"sv));
  EXPECT_FALSE(parse_image_size("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7F\0\0\0\0\0\0\x01"sv));
  EXPECT_FALSE(parse_image_size("\xFF\xD8\xFF\xE0\0\0\xFF\xE0\0\0"sv)) << "segments without length";
  for (const char* extension : {".png", ".jpg", ".pgm"}) {
    const std::string file = encoded(extension, 61, 43);
    for (std::size_t size = 0; size < std::min<std::size_t>(file.size(), 400); ++size) {
      const auto cut = parse_image_size(std::string_view(file).substr(0, size));
      if (cut && extension != std::string(".pgm")) {
        EXPECT_EQ(*cut, (ImageSize{61, 43})) << extension << " " << size;
      }
    }
  }
}

TEST(ImageHeader, ReadsAFile) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(read_image_size(folder.write("a.png", encoded(".png", 61, 43))), (ImageSize{61, 43}));
  EXPECT_FALSE(read_image_size(folder.path() + "/none.png"));
  EXPECT_FALSE(read_image_size(folder.path()));
}

}  // namespace
}  // namespace spartan
