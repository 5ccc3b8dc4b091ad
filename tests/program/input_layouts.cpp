#include "input_layouts.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core/persistence.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <utility>
#include <vector>

#include "program.h"

namespace spartan::testing {

namespace fs = std::filesystem;

std::string six_digits(int i) {
  return fmt::format("{:06}.png", i);
}

void write_text(const std::string& path, const std::string& text) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream(path) << text;
}

std::string times_text(const Frames& frames) {
  std::string text;
  for (int i = 0; i < frames.count(); ++i)
    text += fmt::format("{}.{:09}\n", frames.ns(i) / 1'000'000'000, frames.ns(i) % 1'000'000'000);
  return text;
}

void write_video(const Frames& frames, const std::string& path, const std::vector<int>& cameras) {
  cv::VideoWriter video;
  for (int i = 0; i < frames.count(); ++i) {
    std::vector<cv::Mat> parts;
    parts.reserve(cameras.size());
    for (const int camera : cameras) parts.push_back(cv::imread(frames.image(camera, i), cv::IMREAD_COLOR));
    cv::Mat whole;
    cv::hconcat(parts, whole);
    if (i == 0) video.open(path, cv::VideoWriter::fourcc('F', 'F', 'V', '1'), frames.fps(), whole.size());
    ASSERT_TRUE(video.isOpened()) << path;
    video.write(whole);
  }
}

namespace {

// A calibration of the frames in another format.
void convert(const Frames& frames, const std::string& to, const std::string& format) {
  fs::create_directories(fs::path(to).parent_path());
  const auto converted = run_program({"rig", "convert", frames.calibration(), to, "--to", format});
  ASSERT_EQ(converted.exit_code, 0) << converted.err;
}

std::string stamp_name(const Frames& frames, int i) {
  return std::to_string(frames.ns(i)) + ".png";
}

void write_euroc_tables(const Frames& frames, const std::string& mav) {
  std::string table = "#timestamp [ns],filename\n";
  for (int i = 0; i < frames.count(); ++i) table += fmt::format("{0},{0}.png\n", frames.ns(i));
  for (const char* camera : {"cam0", "cam1"}) write_text(mav + "/" + camera + "/data.csv", table);
  frames.write_both(mav + "/cam0/data", mav + "/cam1/data", [&](int i) { return stamp_name(frames, i); });
}

std::string frames_table(const Frames& frames) {
  std::string table = "left_stamp_ns,left,right\n";
  for (int i = 0; i < frames.count(); ++i)
    table += fmt::format("{0},left/{1:06}.png,right/{1:06}.png\n", frames.ns(i), i);
  return table;
}

std::vector<Layout> image_folders() {
  return {
      {"LeftRightWithTimes",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/left", to + "/right", six_digits);
         fs::copy_file(f.calibration(), to + "/calib.txt");
         write_text(to + "/times.txt", times_text(f));
         return {};
       },
       "left and right found; times in seconds from times.txt"},
      {"NanosecondsInNamesAndCamchain",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/left", to + "/right", [&](int i) { return stamp_name(f, i); });
         convert(f, to + "/camchain.yaml", "kalibr");
         return {};
       },
       "time stamps in nanoseconds from the file names"},
      {"MicrosecondsInNames",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/cam0", to + "/cam1", [&](int i) { return fmt::format("f_{}.png", f.ns(i) / 1000); });
         return {"--rig", f.calibration()};
       },
       "time stamps in microseconds from the file names", false},
      {"MillisecondsInNames",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/cam0/data", to + "/cam1/data",
                      [&](int i) { return fmt::format("{}.png", f.ns(i) / 1'000'000); });
         return {"--rig", f.calibration()};
       },
       "time stamps in milliseconds from the file names", false},
      {"DecimalSecondsInNames",
       [](const Frames& f, const std::string& to) -> Arguments {
         const auto name = [&](int i) {
           return fmt::format("{}.{:09}.png", f.ns(i) / 1'000'000'000, f.ns(i) % 1'000'000'000);
         };
         f.write_both(to + "/image_left", to + "/image_right", name);
         return {"--rig", f.calibration()};
       },
       "time stamps in seconds from the file names"},
      {"PatternsInOneFolder",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write(0, to, [](int i) { return fmt::format("l{:03}.png", i); });
         f.write(1, to, [](int i) { return fmt::format("r{:03}.png", i); });
         return {"--rig",   f.calibration(), "--left", "l*.png",
                 "--right", "r*.png",        "--fps",  fmt::format("{}", f.fps())};
       },
       "left and right images given", false},
      {"TimesWithNames",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/left", to + "/right", six_digits);
         std::string times = "timestamp,file\n";
         for (int i = 0; i < f.count(); ++i) times += fmt::format("{},{:06}.png\n", f.ns(i), i);
         write_text(to + "/frames_of_logger.csv", times);
         return {"--rig", f.calibration(), "--times", to + "/frames_of_logger.csv"};
       },
       "times in nanoseconds from frames_of_logger.csv"},
  };
}

std::vector<Layout> data_sets() {
  return {
      {"KittiColour",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/image_2", to + "/image_3", six_digits, [](const cv::Mat& gray) {
           cv::Mat colour;
           cv::merge(std::vector<cv::Mat>{gray, gray, gray}, colour);
           return colour;
         });
         std::ifstream own(f.calibration());
         std::string text((std::istreambuf_iterator<char>(own)), {});
         for (const auto& [from, key] : {std::pair{"P0:", "P2:"}, {"P1:", "P3:"}})
           text.replace(text.find(from), 3, key);
         write_text(to + "/calib.txt", text);
         write_text(to + "/times.txt", times_text(f));
         return {};
       },
       "calib.txt and image_2 found"},
      {"KittiJpeg",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/image_0", to + "/image_1", [](int i) { return fmt::format("{:06}.jpg", i); });
         fs::copy_file(f.calibration(), to + "/calib.txt");
         return {};
       },
       "frames are assumed to be 0.1 s apart", false},
  };
}

std::vector<Layout> deep_images() {
  return {
      {"SixteenBits",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(
             to + "/left", to + "/right", [&](int i) { return stamp_name(f, i); },
             [](const cv::Mat& gray) {
               cv::Mat deep;
               gray.convertTo(deep, CV_16U, 257);
               return deep;
             });
         return {"--rig", f.calibration()};
       },
       "16 significant bits"},
      {"TwelveBits",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(
             to + "/left", to + "/right", [&](int i) { return stamp_name(f, i); },
             [](const cv::Mat& gray) {
               cv::Mat deep;
               gray.convertTo(deep, CV_16U, 4095.0 / 255);
               return deep;
             });
         return {"--rig", f.calibration()};
       },
       "12 significant bits in the low bits", false},
      {"TwelveHighBits",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(
             to + "/left", to + "/right", [&](int i) { return stamp_name(f, i); },
             [](const cv::Mat& gray) {
               cv::Mat deep;
               gray.convertTo(deep, CV_16U, 4095.0 / 255);
               return cv::Mat(deep * 16);
             });
         return {"--rig", f.calibration()};
       },
       "12 significant bits in the high bits", false},
      {"StatedBits",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(
             to + "/left", to + "/right", [&](int i) { return stamp_name(f, i); },
             [](const cv::Mat& gray) {
               cv::Mat deep;
               gray.convertTo(deep, CV_16U, 16);
               return deep;
             });
         return {"--rig", f.calibration(), "--bits", "12"};
       },
       "12 significant bits", false},
      {"Euroc",
       [](const Frames& f, const std::string& to) -> Arguments {
         write_euroc_tables(f, to + "/mav0");
         convert(f, to + "/mav0", "euroc");
         return {};
       },
       "mav0/cam0/data.csv found"},
      {"TumVi",
       [](const Frames& f, const std::string& to) -> Arguments {
         write_euroc_tables(f, to + "/mav0");
         convert(f, to + "/dso/camchain.yaml", "kalibr");
         return {};
       },
       "camchain.yaml"},
  };
}

std::vector<Layout> short_tables_and_calibrations() {
  return {
      {"ShortFramesTable",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/left", to + "/right", six_digits);
         write_text(to + "/frames.csv", frames_table(f));
         convert(f, to + "/rig.yaml", "rig.yaml");
         return {};
       },
       "frames.csv found"},
      {"CamchainNamedRig",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/left", to + "/right", six_digits);
         write_text(to + "/frames.csv", frames_table(f));
         convert(f, to + "/rig.yaml", "kalibr");
         return {};
       },
       "frames.csv found"},
      {"MiddleburyCalibration",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/left", to + "/right", [&](int i) { return stamp_name(f, i); });
         convert(f, to + "/calib.txt", "middlebury");
         return {};
       },
       "left and right found"},
      {"TwoOpenCvFiles",
       [](const Frames& f, const std::string& to) -> Arguments {
         f.write_both(to + "/left", to + "/right", [&](int i) { return stamp_name(f, i); });
         cv::FileStorage one;
         convert(f, to + "/both.yml", "opencv");
         one.open(to + "/both.yml", cv::FileStorage::READ);
         cv::FileStorage intrinsics(to + "/intrinsics.yml", cv::FileStorage::WRITE),
             extrinsics(to + "/extrinsics.yml", cv::FileStorage::WRITE);
         for (const char* key : {"M1", "D1", "M2", "D2"}) intrinsics << key << one[key].mat();
         for (const char* key : {"R", "T"}) extrinsics << key << one[key].mat();
         one.release();
         fs::remove(to + "/both.yml");
         return {};
       },
       "intrinsics.yml"},
  };
}

std::vector<Layout> videos() {
  return {
      {"SideBySideVideo",
       [](const Frames& f, const std::string& to) -> Arguments {
         fs::create_directories(to);
         write_video(f, to + "/drive.avi", {0, 1});
         return {"--rig", f.calibration()};
       },
       "a video, images side by side", false, "/drive.avi"},
      {"TwoVideos",
       [](const Frames& f, const std::string& to) -> Arguments {
         fs::create_directories(to);
         write_video(f, to + "/l.avi", {0});
         write_video(f, to + "/r.avi", {1});
         return {"--rig", f.calibration(), "--left", "l.avi", "--right", "r.avi"};
       },
       "left and right videos given", false},
  };
}

}  // namespace

const std::vector<Layout>& layouts() {
  static const std::vector<Layout> list = [] {
    std::vector<Layout> all;
    for (const auto& part : {image_folders(), data_sets(), deep_images(), short_tables_and_calibrations(), videos()})
      all.insert(all.end(), part.begin(), part.end());
    return all;
  }();
  return list;
}

}  // namespace spartan::testing
