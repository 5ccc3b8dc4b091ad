// The layouts of recordings in which tests write the same frames.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

namespace spartan::testing {

/// Further arguments of a command.
using Arguments = std::vector<std::string>;

/// Frames of a recording in KITTI's layout with calib.txt and times.txt, to be written in other layouts.
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
      const std::filesystem::path from = image(camera, i), to = folder + "/" + name(i);
      std::filesystem::create_directories(to.parent_path());
      if (!change && to.extension() == ".png") {
        std::filesystem::copy_file(from, to);
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
  static constexpr std::int64_t kFirst_ns = 1'700'000'000'000'000'000;
  std::string recording_;
  int count_;
  std::vector<std::int64_t> times_ns_;
};

struct Layout {
  std::string name;
  // Writes the frames into a folder; returns further arguments of `run`.
  std::function<Arguments(const Frames&, const std::string&)> write;
  std::string said;        // part of what `run` reports
  bool exact = true;       // the same pixels and stamps; else lossy images, other gray levels, or rounded stamps
  std::string input = "";  // of `run`, in the folder
};

inline void PrintTo(const Layout& layout, std::ostream* out) {
  *out << layout.name;
}

/// "000012.png"
std::string six_digits(int i);
/// Makes the folder of the file.
void write_text(const std::string& path, const std::string& text);
/// times.txt: a row per frame, seconds.
std::string times_text(const Frames& frames);
/// A lossless video of the images of one camera, or of two side by side.
void write_video(const Frames& frames, const std::string& path, const std::vector<int>& cameras);

/// All layouts that `spartan run` reads.
const std::vector<Layout>& layouts();

}  // namespace spartan::testing
