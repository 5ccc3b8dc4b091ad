// Times of stereo matching beside OpenCV's, in one run.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "stereo_pairs.h"
#include "stereo_rivals.h"
#include "timing.h"

namespace spartan {

struct SpeedPair {
  Image<std::uint8_t> left, right;
};

/// The first frame of the wide pair of a simulated recording, rectified. Empty images where there is none.
inline SpeedPair rendered_pair(const std::string& recording) {
  SpeedPair pair;
  if (!std::filesystem::exists(recording)) return pair;
  const auto source = must(open_recording(recording));
  auto imager = must(Imager::create(source->info().rig, ImagingOptions(), ThreadPool(2)));
  const auto frame = must(source->frame_at("wide", source->listed_stamps("wide").front()));
  const auto view = must(imager.process(frame));
  pair.left = Image<std::uint8_t>::copy_of(view.left);
  pair.right = Image<std::uint8_t>::copy_of(view.right);
  return pair;
}

inline SpeedPair resized(const SpeedPair& pair, ImageSize size) {
  SpeedPair small{Image<std::uint8_t>(size), Image<std::uint8_t>(size)};
  for (const auto& [from, to] : {std::pair{&pair.left, &small.left}, std::pair{&pair.right, &small.right}}) {
    cv::Mat target(size.height, size.width, CV_8U, to->data(), static_cast<std::size_t>(to->stride()));
    cv::resize(as_mat(*from), target, target.size(), 0, 0, cv::INTER_AREA);
  }
  return small;
}

/// Prints the time of the first call with a new matcher and the median of further calls.
inline double time_spartan(const SpeedPair& pair, int disparities, int threads, int repeat,
                           const DisparityOptions& options) {
  auto computer = must(DisparityComputer::create(options, ThreadPool(threads)));
  DisparityImage image;
  const auto work = [&] { image = must(computer.compute(pair.left, pair.right, {0, disparities - 1})); };
  const double first = milliseconds(work), further = median_milliseconds(repeat, work);
  fmt::print("{:<26} {:8.1f} {:8.1f}   coarse {:.1f}, match {:.1f}, filter {:.1f}, refine {:.1f}; {:.0f} MB\n",
             fmt::format("Spartan, {} thread{}", threads, threads > 1 ? "s" : ""), first, further, image.times.coarse,
             image.times.match, image.times.filter, image.times.refine, 1e-6 * static_cast<double>(image.buffer_bytes));
  return first;
}

inline void compare_speed(const SpeedPair& pair, int disparities, int repeat, const DisparityOptions& options) {
  fmt::print("\n{}x{} px, {} disparities\n{:<26} {:>8} {:>8}\n", pair.left.width(), pair.left.height(), disparities, "",
             "first ms", "further");
  for (const int threads : {1, 2}) time_spartan(pair, disparities, threads, repeat, options);
  const std::vector<OpenCvMatcher> rivals{
      {"SGBM", cv::StereoSGBM::MODE_SGBM}, {"3WAY", cv::StereoSGBM::MODE_SGBM_3WAY}, {"HH", cv::StereoSGBM::MODE_HH}};
  for (const OpenCvMatcher& rival : rivals) {
    for (const bool padded : {true, false}) {
      const auto work = [&] { opencv_disparity(pair.left, pair.right, disparities, rival, padded); };
      const double first = milliseconds(work), further = median_milliseconds(std::max(1, repeat / 3), work);
      fmt::print("{:<26} {:8.1f} {:8.1f}\n", rival.name + (padded ? ", padded" : ", as called"), first, further);
    }
  }
}

}  // namespace spartan
