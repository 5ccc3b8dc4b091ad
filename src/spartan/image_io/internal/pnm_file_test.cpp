#include "spartan/image_io/internal/pnm_file.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "spartan/image_io/image_io.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

std::string opencv_pnm(const cv::Mat& mat, const char* extension, bool binary) {
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(extension, mat, bytes, {cv::IMWRITE_PXM_BINARY, binary ? 1 : 0}));
  return {bytes.begin(), bytes.end()};
}

cv::Mat noise(int type) {
  cv::Mat mat(13, 21, type);
  cv::randu(mat, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
  return mat;
}

template <class Pixel>
void expect_round_trip(int type, const char* extension, bool binary) {
  const cv::Mat written = noise(type);
  const auto image = decode_image(opencv_pnm(written, extension, binary), "a");
  ASSERT_TRUE(image) << image.error().message();
  cv::Mat expected = written;
  if (written.channels() == 3) cv::cvtColor(written, expected, cv::COLOR_BGR2RGB);
  EXPECT_EQ(cv::norm(as_mat(image->as<Pixel>()), expected, cv::NORM_INF), 0) << extension << binary << type;
}

TEST(PnmFile, DecodesWhatOpenCvWrites) {
  for (const bool binary : {true, false}) {
    expect_round_trip<std::uint8_t>(CV_8UC1, ".pgm", binary);
    expect_round_trip<std::uint16_t>(CV_16UC1, ".pgm", binary);
    expect_round_trip<Rgb8>(CV_8UC3, ".ppm", binary);
    expect_round_trip<Rgb16>(CV_16UC3, ".ppm", binary);
  }
}

TEST(PnmFile, BecomesGrayAsOpenCvDoesIt) {
  const testing::TemporaryFolder folder;
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3}) {
    const std::string file = opencv_pnm(noise(type), CV_MAT_CN(type) == 3 ? ".ppm" : ".pgm", true);
    const cv::Mat expected = cv::imdecode(std::vector<char>(file.begin(), file.end()), cv::IMREAD_GRAYSCALE);
    const auto gray = read_gray8(folder.write("a.pnm", file));
    ASSERT_TRUE(gray);
    EXPECT_EQ(cv::norm(as_mat(*gray), expected, cv::NORM_INF), 0) << type;
  }
}

TEST(PnmFile, TextMayHaveComments) {
  const auto image = decode_image("P2 # camera 3\n3 2 # size\n255\n1 2 3\n# the second row\n4 5 255", "a");
  ASSERT_TRUE(image) << image.error().message();
  const auto pixels = image->as<std::uint8_t>();
  EXPECT_EQ(pixels(0, 1), 4);
  EXPECT_EQ(pixels(2, 1), 255);
}

TEST(PnmFile, DamagedTextIsRejected) {
  for (const char* text : {"P2 3 2 255\n1 2 3 4 5      ", "P2 3 2 255\n1 2 x 4 5 6 7 8", "P2 3 2 255\n1 2 300 4 5 6",
                           "P2 3 2 255\n1 2 -3 4 5 6"}) {
    EXPECT_FALSE(decode_image(text, "a")) << text;
  }
}

}  // namespace
}  // namespace spartan::internal
