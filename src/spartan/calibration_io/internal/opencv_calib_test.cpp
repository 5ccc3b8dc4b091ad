// OpenCV files written by cv::FileStorage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/core/persistence.hpp>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/testing/first_pair.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan::internal {
namespace {

using testing::error_message;
using ::testing::HasSubstr;
using testing::replaced;
using testing::right_in_left;
using testing::TemporaryFolder;

cv::Mat row(const std::vector<double>& numbers, int rows = 1) {
  return cv::Mat(numbers, true).reshape(1, rows);
}

std::string opencv_file(const std::function<void(cv::FileStorage&)>& fill) {
  cv::FileStorage file("memory.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "image_width" << 640 << "image_height" << 480;
  fill(file);
  return file.releaseAndGetString();
}

TEST(OpencvFiles, FisheyeFilesMustBeMarked) {
  const TemporaryFolder folder;
  const auto text = [&](const std::function<void(cv::FileStorage&)>& mark) {
    return opencv_file([&](cv::FileStorage& file) {
      mark(file);
      for (const char* number : {"1", "2"}) {
        file << std::string("K") + number << row({300, 0, 320, 0, 301, 240, 0, 0, 1}, 3);
        file << std::string("D") + number << row({0.1, 0.02, 0.003, 0.0004}, 4);
      }
      file << "R" << row({1, 0, 0, 0, 1, 0, 0, 0, 1}, 3) << "T" << row({-0.1, 0, 0}, 3);
    });
  };
  const auto model = [&](const std::string& content) {
    return std::string(name_of(read_rig(folder.write("stereo.yml", content)).value().cameras[0].model));
  };
  EXPECT_EQ(model(text([](cv::FileStorage&) {})), "radial_tangential");
  EXPECT_EQ(model(text([](cv::FileStorage& f) { f << "fisheye_model" << 0; })), "radial_tangential");
  EXPECT_EQ(model(text([](cv::FileStorage& f) { f << "fisheye_model" << 1; })), "equidistant");
  EXPECT_EQ(model(text([](cv::FileStorage& f) {
              f << "camera_model"
                << "fisheye";
            })),
            "equidistant");
  EXPECT_EQ(model(text([](cv::FileStorage& f) {
              f << "distortion_model"
                << "equidistant";
            })),
            "equidistant");
}

TEST(OpencvFiles, ExtrinsicsMayComeFromTheRectification) {
  const TemporaryFolder folder;
  const double c = std::cos(0.1), s = std::sin(0.1);
  const auto fill = [&](cv::FileStorage& file, bool with_cameras) {
    for (const char* number : {"1", "2"}) {
      if (!with_cameras) continue;
      file << std::string("M") + number << row({300, 0, 320, 0, 301, 240, 0, 0, 1}, 3);
      file << std::string("D") + number << row({0, 0, 0, 0, 0});
    }
    file << "R1" << row({c, 0, s, 0, 1, 0, -s, 0, c}, 3) << "R2" << row({1, 0, 0, 0, 1, 0, 0, 0, 1}, 3);
    file << "P1" << row({290, 0, 310, 0, 0, 290, 230, 0, 0, 0, 1, 0}, 3);
    file << "P2" << row({290, 0, 310, -29, 0, 290, 230, 0, 0, 0, 1, 0}, 3);
  };
  const auto raw = read_rig(folder.write("a.yml", opencv_file([&](auto& file) { fill(file, true); })));
  ASSERT_TRUE(raw) << raw.error().message();
  // R2 X_r = R1 X_l − (0.1, 0, 0).
  const Pose right_from_left = raw->right_from_left(raw->pairs[0]);
  EXPECT_LE((right_from_left.translation() - Eigen::Vector3d(-0.1, 0, 0)).norm(), 1e-15);
  EXPECT_LE((right_from_left * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(s - 0.1, 0, c)).norm(), 1e-15);
  const auto rectified = read_rig(folder.write("b.yml", opencv_file([&](auto& file) { fill(file, false); })));
  ASSERT_TRUE(rectified) << rectified.error().message();
  EXPECT_EQ(rectified->cameras[0].model, CameraModel(PinholeModel{290, 290, 310, 230}));
  EXPECT_LE((right_in_left(*rectified) - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-15);
  EXPECT_LE(rotation_angle(rectified->right_from_left(rectified->pairs[0])), 1e-15);
}

// An invalid size is an error, not a missing size.
TEST(OpencvFiles, AnInvalidSizeIsReported) {
  const TemporaryFolder folder;
  const std::string text = opencv_file([&](cv::FileStorage& file) {
    for (const char* number : {"1", "2"}) {
      file << std::string("M") + number << row({300, 0, 320, 0, 301, 240, 0, 0, 1}, 3);
      file << std::string("D") + number << row({0.1, 0, 0, 0, 0});
    }
    file << "R" << row({1, 0, 0, 0, 1, 0, 0, 0, 1}, 3) << "T" << row({-0.1, 0, 0}, 3);
  });
  const auto message_for = [&](const std::string& what, const std::string& with) {
    return error_message(read_calibration(folder.write("s.yml", replaced(text, what, with)), {111, 222}));
  };
  for (const char* bad : {"abc", "1e300", "0", "-640", "640.5", "[640, 480]"}) {
    EXPECT_THAT(message_for("image_width: 640", std::string("image_width: ") + bad),
                HasSubstr("s.yml:3: image_width: must be a whole number above zero"))
        << bad;
  }
  EXPECT_THAT(message_for("image_height: 480\n", ""), HasSubstr("s.yml:3: image_width: is given without image_height"));
  const std::string both = "image_width: 640\nimage_height: 480\n";
  EXPECT_THAT(message_for(both, "image_size: [640, x]\n"),
              HasSubstr("s.yml:3: image_size: must be two whole numbers above"));
  EXPECT_EQ(message_for(both, "image_size: [640, 480]\n"), "nothing");
  EXPECT_EQ(message_for(both, ""), "nothing") << "the given size is used";
}

TEST(OpencvFiles, RowsAndColumnsMustBePositive) {
  const TemporaryFolder folder;
  const std::string text = opencv_file([&](cv::FileStorage& file) {
    file << "P1" << row({290, 0, 310, 0, 0, 290, 230, 0, 0, 0, 1, 0}, 3);
    file << "P2" << row({290, 0, 310, -29, 0, 290, 230, 0, 0, 0, 1, 0}, 3);
  });
  const std::string odd = replaced(replaced(text, "rows: 3", "rows: -3"), "cols: 4", "cols: -4");
  EXPECT_THAT(error_message(read_calibration(folder.write("s.yml", odd))), HasSubstr("s.yml:5: P1: is not a matrix"));
  EXPECT_EQ(error_message(read_calibration(folder.write("s.yml", text))), "nothing");
}

TEST(OpencvFiles, TheRectificationIsIgnored) {
  const TemporaryFolder folder;
  const auto ignored = [&](bool with_cameras) {
    const std::string text = opencv_file([&](cv::FileStorage& file) {
      const cv::Mat p = row({290, 0, 310, 0, 0, 290, 230, 0, 0, 0, 1, 0}, 3);
      cv::Mat right = p.clone();
      right.at<double>(0, 3) = -29;
      file << "R1" << row({0, 0, 0}) << "R2" << row({0, 0, 0}) << "P1" << p << "P2" << right;
      if (!with_cameras) return;
      for (const char* number : {"1", "2"}) {
        file << std::string("M") + number << row({300, 0, 320, 0, 301, 240, 0, 0, 1}, 3);
        file << std::string("D") + number << row({0.1, 0, 0, 0, 0});
      }
    });
    std::string keys;
    const LoadedRig read = read_calibration(folder.write("s.yml", text)).value();
    for (const RigDifference& each : read.ignored) keys += each.key;
    return keys;
  };
  EXPECT_EQ(ignored(true), "R1R2P1P2");
  EXPECT_EQ(ignored(false), "R1R2");
}

TEST(OpencvFiles, ThinPrismsMustBeZero) {
  const TemporaryFolder folder;
  const auto read = [&](double prism) {
    return read_calibration(
        folder.write("s.yml", opencv_file([&](cv::FileStorage& file) {
                       for (const char* number : {"1", "2"}) {
                         file << std::string("M") + number << row({300, 0, 320, 0, 301, 240, 0, 0, 1}, 3);
                         file << std::string("D") + number << row({0.1, 0, 0, 0, 0, 0.2, 0, 0, prism, 0, 0, 0});
                       }
                       file << "R" << row({0, 0.1, 0}, 3) << "T" << row({-0.1, 0, 0}, 3);
                     })));
  };
  ASSERT_TRUE(read(0)) << read(0).error().message();
  EXPECT_NEAR(rotation_angle(read(0)->rig.right_from_left(read(0)->rig.pairs[0])), 0.1, 1e-15) << "R as a vector";
  EXPECT_THAT(error_message(read(1e-9)), HasSubstr("D1: thin-prism"));
}

}  // namespace
}  // namespace spartan::internal
