// The same frames in every layout that is read give the same trajectory.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <opencv2/core/persistence.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

#include "program.h"
#include "run_results.h"
#include "spartan/core/trajectory.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::run_program;

constexpr std::int64_t kFirst_ns = 1'700'000'000'000'000'000;

// Frames of a recording in KITTI's layout with calib.txt and times.txt, to be written in other layouts.
class Frames {
 public:
  Frames(std::string recording, int count) : recording_(std::move(recording)), count_(count) {
    std::ifstream times(recording_ + "/times.txt");
    for (double t = 0; times >> t;) times_ns_.push_back(kFirst_ns + std::llround(1e9 * t));
  }
  int count() const { return count_; }
  std::int64_t ns(int i) const { return times_ns_[static_cast<std::size_t>(i)]; }
  double fps() const { return std::round(1e9 / static_cast<double>(ns(1) - ns(0))); }
  std::string image(int camera, int i) const { return fmt::format("{}/image_{}/{:06}.png", recording_, camera, i); }
  std::string calibration() const { return recording_ + "/calib.txt"; }

  // Copies the images of one camera. `name`: of frame i, with a folder. `change`: of each image.
  void write(int camera, const std::string& folder, const std::function<std::string(int)>& name,
             const std::function<cv::Mat(cv::Mat)>& change = {}) const {
    for (int i = 0; i < count_; ++i) {
      const fs::path from = image(camera, i), to = folder + "/" + name(i);
      fs::create_directories(to.parent_path());
      if (!change && to.extension() == ".png") {
        fs::copy_file(from, to);
      } else {
        const cv::Mat image = cv::imread(from.string(), cv::IMREAD_UNCHANGED);
        ASSERT_TRUE(cv::imwrite(to.string(), change ? change(image) : image, {cv::IMWRITE_JPEG_QUALITY, 100}));
      }
    }
  }
  void write_both(const std::string& left, const std::string& right, const std::function<std::string(int)>& name,
                  const std::function<cv::Mat(cv::Mat)>& change = {}) const {
    write(0, left, name, change);
    write(1, right, name, change);
  }

 private:
  std::string recording_;
  int count_;
  std::vector<std::int64_t> times_ns_;
};

std::string six_digits(int i) {
  return fmt::format("{:06}.png", i);
}

void write_text(const std::string& path, const std::string& text) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream(path) << text;
}

struct Layout {
  std::string name;
  // Writes the frames into a folder; returns further arguments of `run`.
  std::function<std::vector<std::string>(const Frames&, const std::string&)> write;
  std::string said;        // part of what `run` reports
  bool exact = true;       // the same pixels and stamps; else lossy images, other gray levels, or rounded stamps
  std::string input = "";  // of `run`, in the folder
};

void PrintTo(const Layout& layout, std::ostream* out) {
  *out << layout.name;
}

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

std::string times_text(const Frames& frames) {
  std::string text;
  for (int i = 0; i < frames.count(); ++i)
    text += fmt::format("{}.{:09}\n", frames.ns(i) / 1'000'000'000, frames.ns(i) % 1'000'000'000);
  return text;
}

// A lossless video of the images of one camera, or of two side by side.
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

using Arguments = std::vector<std::string>;

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

const std::vector<Layout>& layouts() {
  static const std::vector<Layout> list = [] {
    std::vector<Layout> all;
    for (const auto& part : {image_folders(), data_sets(), deep_images(), short_tables_and_calibrations(), videos()})
      all.insert(all.end(), part.begin(), part.end());
    return all;
  }();
  return list;
}

Trajectory poses_of(const std::string& run) {
  auto loaded = load_trajectory(run + "/trajectory_odometry.tum");
  EXPECT_TRUE(loaded) << loaded.error().message();
  return loaded ? loaded->poses : Trajectory();
}

ProgramResult run_odometry(const std::string& input, const std::string& output, const Arguments& more) {
  Arguments words{"run", input, "-o", output, "--odometry-only"};
  words.insert(words.end(), more.begin(), more.end());
  ProgramResult result = run_program(words);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result;
}

// The trajectory of the frames in their own layout.
Trajectory own_trajectory(const Frames& frames, const std::string& folder) {
  const std::string own = folder + "/own";
  frames.write_both(own + "/image_0", own + "/image_1", six_digits);
  fs::copy_file(frames.calibration(), own + "/calib.txt");
  write_text(own + "/times.txt", times_text(frames));
  run_odometry(own, folder + "/run_own", {});
  return poses_of(folder + "/run_own");
}

void expect_same_trajectory(const Layout& layout, const Frames& frames, const Trajectory& a) {
  SCOPED_TRACE(layout.name);
  const testing::TemporaryFolder folder;
  const std::string input = folder.path() + "/in", output = folder.path() + "/run";
  const Arguments more = layout.write(frames, input);
  const ProgramResult result = run_odometry(input + layout.input, output, more);
  EXPECT_THAT(result.err, HasSubstr(layout.said));
  const Trajectory b = poses_of(output);
  ASSERT_EQ(a.size(), static_cast<std::size_t>(frames.count()));
  ASSERT_EQ(b.size(), a.size());
  const bool assumed = layout.said.find("assumed") != std::string::npos;
  double length_m = 0;
  for (std::size_t i = 1; i < a.size(); ++i) {
    length_m += (a[i].pose.translation() - a[i - 1].pose.translation()).norm();
    const double step_s = assumed ? 0.1 : seconds_between(a[i - 1].stamp, a[i].stamp);
    EXPECT_NEAR(seconds_between(b[i - 1].stamp, b[i].stamp), step_s, 0.011);
    if (layout.exact) {
      EXPECT_EQ(a[i].pose.matrix(), b[i].pose.matrix()) << "frame " << i;
    }
  }
  EXPECT_LT((a.back().pose.translation() - b.back().pose.translation()).norm(), 0.02 * length_m);
}

class Inputs : public ::testing::TestWithParam<Layout> {};

TEST_P(Inputs, GiveTheTrajectoryOfTheSmallDrive) {
  const testing::TemporaryFolder folder;
  const Frames frames(testing::small_runs_folder() + "/drive", 6);
  expect_same_trajectory(GetParam(), frames, own_trajectory(frames, folder.path()));
}

INSTANTIATE_TEST_SUITE_P(Layouts, Inputs, ::testing::ValuesIn(layouts()),
                         [](const auto& instance) { return instance.param.name; });

TEST(InputsOfKitti, GiveTheSameTrajectoryInEveryLayout) {
  const std::string kitti = testing::data_folder() + "/kitti_06";
  if (!fs::exists(kitti)) GTEST_SKIP() << "no real recordings; SPARTAN_DATA says where they are";
  const testing::TemporaryFolder folder;
  const Frames frames(kitti, 20);
  const Trajectory own = own_trajectory(frames, folder.path());
  for (const Layout& layout : layouts()) expect_same_trajectory(layout, frames, own);
}

// Also seeks, hashes the images and draws the report.
TEST(VideoInput, ResumesWithTheSameBytes) {
  const testing::TemporaryFolder folder;
  const Frames frames(testing::small_runs_folder() + "/drive", 8);
  write_video(frames, folder.path() + "/drive.avi", {0, 1});
  const auto run = [&](const std::string& output, const Arguments& more) {
    Arguments words{"run",   folder.path() + "/drive.avi", "-o", folder.path() + "/" + output,
                    "--rig", frames.calibration()};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult result = run_program(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
  };
  run("whole", {});
  EXPECT_TRUE(fs::exists(folder.path() + "/whole/report/index.html"));
  run("part", {"--max-frames", "5"});
  run("part", {"--resume"});
  EXPECT_EQ(testing::byte_stable_content(folder.path() + "/whole"),
            testing::byte_stable_content(folder.path() + "/part"));
}

TEST(InputErrors, NameWhatIsThereAndWhatToDo) {
  const testing::TemporaryFolder folder;
  const auto error_of = [&](const std::string& input, Arguments more = {}) {
    Arguments words{"run", folder.path() + "/" + input, "-o", folder.path() + "/run"};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult result = run_program(words);
    EXPECT_NE(result.exit_code, 0);
    return result.err;
  };
  folder.write("drive.bag", "#ROSBAG V2.0\n");
  EXPECT_THAT(error_of("drive.bag"), HasSubstr("ROS 1 bag"));
  fs::create_directories(folder.path() + "/bag2");
  folder.write("bag2/metadata.yaml", "rosbag2_bagfile_information:\n");
  EXPECT_THAT(error_of("bag2"), HasSubstr("bag_to_images.py"));
  for (const char* name : {"one/left/a.png", "one/right/a.png"}) {
    fs::create_directories(fs::path(folder.path() + "/" + name).parent_path());
    cv::imwrite(folder.path() + "/" + name, cv::Mat(12, 16, CV_8U, cv::Scalar(90)));
  }
  EXPECT_THAT(error_of("one"), HasSubstr("--rig"));
  EXPECT_THAT(error_of("one", {"--left", "left"}), HasSubstr("--left and --right belong together"));
  EXPECT_THAT(error_of("one", {"--left", "l*.png", "--right", "right"}),
              HasSubstr("holds no image of the left camera"));
}

}  // namespace
}  // namespace spartan
