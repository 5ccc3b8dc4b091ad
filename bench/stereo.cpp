// Compares stereo matching with OpenCV on real pairs with ground truth: accuracy, density, time. `make bench-stereo`.
//
//   stereo [--repeat N] [--set key=value]... [--images DIR]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "spartan/core/threads.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/numerics/simd_target.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "stereo_pairs.h"

namespace {

using spartan::Image;
using spartan::ImageView;
namespace fs = std::filesystem;

using spartan::must;
using spartan::Pair;

// OpenCV does not match columns whose search range leaves the image, so the images get a border on the left.
Image<float> opencv_disparity(const Pair& pair, int mode) {
  const int n = pair.disparities;
  cv::Mat left, right, fixed;
  cv::copyMakeBorder(spartan::as_mat(pair.left), left, 0, 0, n, 0, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(spartan::as_mat(pair.right), right, 0, 0, n, 0, cv::BORDER_REPLICATE);
  auto matcher = cv::StereoSGBM::create(0, n, 5, 8 * 25, 32 * 25, 1, 63, 10, 100, 2, mode);
  matcher->compute(left, right, fixed);
  Image<float> disparity(pair.left.size());
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const short value = fixed.at<short>(y, x + n);
      disparity(x, y) = value < 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(value) / 16.0F;
    }
  }
  return disparity;
}

struct Scores {
  double bad_05 = 0, bad_1 = 0, bad_2 = 0, matched_bad_1 = 0, matched_bad_2 = 0, density = 0, nonocc_bad_1 = 0, rms = 0,
         ms = 0;
};

Scores score(const Pair& pair, ImageView<const float> disparity, double ms) {
  const auto metrics = must(spartan::compare_disparities(disparity, pair.truth, pair.mask));
  const auto& all = metrics.all;
  return {all.bad_0_5.value_or(0),
          all.bad_1.value_or(0),
          all.bad_2.value_or(0),
          all.matched_bad_1.value_or(0),
          all.matched_bad_2.value_or(0),
          all.density_percent.value_or(0),
          metrics.nonocc ? metrics.nonocc->bad_1.value_or(0) : 0,
          all.rms_in_1px.value_or(0),
          ms};
}

// The median of several runs, in milliseconds.
double time_of(int repeat, const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < repeat; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::nth_element(times.begin(), times.begin() + repeat / 2, times.end());
  return times[static_cast<std::size_t>(repeat / 2)];
}

void print_line(const std::string& pair, const std::string& method, const Scores& s) {
  fmt::print("{:<16} {:<14} {:7.2f} {:7.2f} {:7.2f} {:8.2f} {:8.2f} {:8.2f} {:9.2f} {:7.3f} {:8.1f}\n", pair, method,
             s.bad_05, s.bad_1, s.bad_2, s.matched_bad_1, s.matched_bad_2, s.density, s.nonocc_bad_1, s.rms, s.ms);
}

// Green: below 1 px, orange: over 1 px, red: over 2 px, blue: no match, black: no ground truth.
cv::Vec3b error_colour(float disparity, float truth) {
  if (!std::isfinite(truth)) return {0, 0, 0};
  if (!std::isfinite(disparity)) return {120, 60, 0};
  const float error = std::abs(disparity - truth);
  if (error > 2) return {0, 0, 255};
  return error > 1 ? cv::Vec3b(0, 160, 255) : cv::Vec3b(60, 120, 60);
}

void write_images(const std::string& folder, const Pair& pair, ImageView<const float> disparity) {
  cv::Mat image(pair.left.height() * 2, pair.left.width() * 2, CV_8UC3, cv::Scalar(0, 0, 0));
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const auto level = [&](float d) {
        return std::isfinite(d) ? cv::saturate_cast<std::uint8_t>(d * 255.0F / static_cast<float>(pair.disparities))
                                : std::uint8_t{0};
      };
      const float d = disparity(x, y), t = pair.truth(x, y);
      const std::uint8_t gray = pair.left(x, y), estimated = level(d), true_level = level(t);
      image.at<cv::Vec3b>(y, x) = {gray, gray, gray};
      image.at<cv::Vec3b>(y, x + disparity.width()) = {true_level, true_level, true_level};
      image.at<cv::Vec3b>(y + disparity.height(), x) = {estimated, estimated, estimated};
      const cv::Vec3b colour = error_colour(d, t);
      image.at<cv::Vec3b>(y + disparity.height(), x + disparity.width()) = colour;
    }
  }
  cv::imwrite(folder + "/" + pair.name + ".png", image);
}

struct Arguments {
  int repeat = 3;
  bool rivals = true;
  std::string images;
  spartan::DisparityOptions options;
};

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--no-rivals") arguments.rivals = false;
    if (i + 1 >= argc) continue;
    if (word == "--repeat") arguments.repeat = std::max(1, std::atoi(argv[++i]));
    if (word == "--images") arguments.images = argv[++i];
    if (word == "--set") arguments.options = must(spartan::set_option(arguments.options, argv[++i]));
  }
  return arguments;
}

class Means {
 public:
  void add(const std::string& method, const Scores& s) {
    if (!sums_.contains(method)) order_.push_back(method);
    Scores& t = sums_[method];
    t.bad_05 += s.bad_05;
    t.bad_1 += s.bad_1;
    t.bad_2 += s.bad_2;
    t.matched_bad_1 += s.matched_bad_1;
    t.matched_bad_2 += s.matched_bad_2;
    t.density += s.density;
    t.nonocc_bad_1 += s.nonocc_bad_1;
    t.rms += s.rms;
    t.ms += s.ms;
  }
  void print(double count) const {
    for (const std::string& method : order_) {
      Scores s = sums_.at(method);
      for (double* value : {&s.bad_05, &s.bad_1, &s.bad_2, &s.matched_bad_1, &s.matched_bad_2, &s.density,
                            &s.nonocc_bad_1, &s.rms, &s.ms}) {
        *value /= count;
      }
      print_line("mean", method, s);
    }
  }

 private:
  std::vector<std::string> order_;
  std::map<std::string, Scores> sums_;
};

Scores run_spartan(const Pair& pair, const spartan::DisparityOptions& options, int threads, int repeat,
                   const std::string& images) {
  spartan::DisparityComputer computer =
      spartan::DisparityComputer::create(options, spartan::ThreadPool(threads)).value();
  spartan::DisparityImage image;
  const double ms = time_of(repeat + 1, [&] {
    image = must(computer.compute(pair.left, pair.right, {0, pair.disparities - 1}));
  });
  if (!images.empty()) write_images(images, pair, image.disparity);
  return score(pair, image.disparity, ms);
}

void compare_all(const std::vector<Pair>& pairs, const Arguments& arguments) {
  fmt::print("{:<16} {:<14} {:>7} {:>7} {:>7} {:>8} {:>8} {:>8} {:>9} {:>7} {:>8}\n", "pair", "method", "bad-0.5",
             "bad-1", "bad-2", "m.bad-1", "m.bad-2", "density", "no.bad-1", "rms<1", "ms");
  Means means;
  for (const Pair& pair : pairs) {
    const auto note = [&](const std::string& method, const Scores& s) {
      print_line(pair.name, method, s);
      means.add(method, s);
    };
    note("Spartan 1 thr.", run_spartan(pair, arguments.options, 1, arguments.repeat, arguments.images));
    note("Spartan 2 thr.", run_spartan(pair, arguments.options, 2, arguments.repeat, ""));
    if (!arguments.rivals) continue;
    for (const auto& [name, mode] :
         {std::pair{"SGBM", cv::StereoSGBM::MODE_SGBM}, std::pair{"SGBM HH", cv::StereoSGBM::MODE_HH}}) {
      Image<float> disparity;
      cv::setNumThreads(1);
      const int m = mode;
      const double ms = time_of(arguments.repeat, [&] { disparity = opencv_disparity(pair, m); });
      note(name, score(pair, disparity, ms));
    }
  }
  means.print(static_cast<double>(pairs.size()));
}

// Times on every instruction set, on the largest pair.
void time_targets(const std::vector<Pair>& pairs, const Arguments& arguments) {
  const auto largest = std::max_element(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.left.width() * a.left.height() * a.disparities < b.left.width() * b.left.height() * b.disparities;
  });
  fmt::print("\n{}: {}x{}, {} disparities\n", largest->name, largest->left.width(), largest->left.height(),
             largest->disparities);
  for (const spartan::SimdTarget simd : spartan::available_simd_targets()) {
    for (const int threads : {1, 2}) {
      spartan::DisparityOptions options = arguments.options;
      options.simd = simd;
      spartan::DisparityComputer computer =
          spartan::DisparityComputer::create(options, spartan::ThreadPool(threads)).value();
      spartan::DisparityImage image;
      const double ms = time_of(arguments.repeat + 2, [&] {
        image = must(computer.compute(largest->left, largest->right, {0, largest->disparities - 1}));
      });
      const auto& t = image.times;
      fmt::print("{:<5} {} threads {:7.1f} ms (coarse {:.1f}, match {:.1f}, filter {:.1f}, refine {:.1f}), {:.0f} MB\n",
                 name_of(simd), threads, ms, t.coarse, t.match, t.filter, t.refine,
                 static_cast<double>(image.buffer_bytes) / 1e6);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = parse(argc, argv);
  const char* const data = std::getenv("SPARTAN_DATA");
  const fs::path folder = data != nullptr ? data : "../shared/data";
  if (!fs::exists(folder / "middlebury")) {
    fmt::print("no stereo pairs: set SPARTAN_DATA to the data folder\n");
    return 0;
  }
  const std::vector<Pair> pairs = spartan::load_stereo_pairs(folder);
  compare_all(pairs, arguments);
  time_targets(pairs, arguments);
  return 0;
}
