// Compares debayering with OpenCV on mosaics sampled from real colour images: PSNR against the full-colour image, and
// time on one thread. `make bench-debayer`.
//
//   debayer [--repeat N]
#include "spartan/imaging/internal/debayer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/numerics/simd_target.h"
#include "timing.h"

namespace {

using spartan::DebayerMethod;
using spartan::Image;
using spartan::PixelLayout;
using spartan::Rgb8;
using spartan::SimdTarget;
using spartan::internal::Debayerer;
namespace fs = std::filesystem;

constexpr int kBorder = 8;  // pixels ignored at every side, for all methods

using spartan::median;
using spartan::milliseconds;

struct Pattern {
  PixelLayout layout;
  const char* block;
  int bilinear, vng, edge_aware;  // OpenCV's codes
};
const Pattern kPatterns[] = {
    {PixelLayout::bayer_rggb, "rggb", cv::COLOR_BayerBG2RGB, cv::COLOR_BayerBG2RGB_VNG, cv::COLOR_BayerBG2RGB_EA},
    {PixelLayout::bayer_grbg, "grbg", cv::COLOR_BayerGB2RGB, cv::COLOR_BayerGB2RGB_VNG, cv::COLOR_BayerGB2RGB_EA},
    {PixelLayout::bayer_gbrg, "gbrg", cv::COLOR_BayerGR2RGB, cv::COLOR_BayerGR2RGB_VNG, cv::COLOR_BayerGR2RGB_EA},
    {PixelLayout::bayer_bggr, "bggr", cv::COLOR_BayerRG2RGB, cv::COLOR_BayerRG2RGB_VNG, cv::COLOR_BayerRG2RGB_EA}};

// Over all three 8-bit channels.
double psnr(const cv::Mat& truth, const cv::Mat& result, int row_offset = 0) {
  double squares = 0, count = 0;
  for (int y = kBorder; y < truth.rows - kBorder; ++y) {
    const std::uint8_t* const t = truth.ptr(y);
    const std::uint8_t* const f = result.ptr(y + row_offset);
    for (int i = 3 * kBorder; i < 3 * (truth.cols - kBorder); ++i) {
      squares += (t[i] - f[i]) * (t[i] - f[i]);
      ++count;
    }
  }
  return 10 * std::log10(255.0 * 255.0 * count / squares);
}

cv::Mat mosaic_of(const cv::Mat& colours, const Pattern& pattern) {
  cv::Mat mosaic(colours.size(), CV_8U);
  for (int y = 0; y < mosaic.rows; ++y) {
    for (int x = 0; x < mosaic.cols; ++x) {
      const char sample = pattern.block[2 * (y & 1) + (x & 1)];
      mosaic.at<std::uint8_t>(y, x) = colours.at<cv::Vec3b>(y, x)[sample == 'r' ? 0 : sample == 'g' ? 1 : 2];
    }
  }
  return mosaic;
}

struct Method {
  std::string name;
  std::function<void(const cv::Mat& mosaic, const Pattern&, cv::Mat& result)> run;
  int row_offset = 0;  // row of the result that belongs to row 0 of the image
};

Method spartan_method(const std::string& name, DebayerMethod method, SimdTarget simd = SimdTarget::automatic) {
  auto debayerer = std::make_shared<Debayerer>(method, simd);
  return {name, [debayerer](const cv::Mat& mosaic, const Pattern& pattern, cv::Mat& result) {
            result.create(mosaic.size(), CV_8UC3);
            debayerer->apply(spartan::as_view<std::uint8_t>(mosaic), {pattern.layout, 8},
                             spartan::as_view<Rgb8>(result), spartan::ThreadPool(1));
          }};
}

Method opencv(const std::string& name, int Pattern::*code, int row_offset = 0) {
  return {name,
          [code](const cv::Mat& mosaic, const Pattern& pattern, cv::Mat& result) {
            cv::cvtColor(mosaic, result, pattern.*code);
          },
          row_offset};
}

std::vector<Method> methods() {
  return {spartan_method("Spartan bilinear", DebayerMethod::bilinear),
          spartan_method("Spartan edge-aware", DebayerMethod::edge_aware),
          opencv("OpenCV bilinear", &Pattern::bilinear), opencv("OpenCV VNG", &Pattern::vng),
          // OpenCV 4.6 writes row y + 2 of the result into row y; compensated here, to measure the method itself.
          opencv("VNG shifted", &Pattern::vng, -2), opencv("OpenCV EA", &Pattern::edge_aware)};
}

std::vector<fs::path> find_images(const fs::path& data) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(data / "middlebury")) {
    for (const char* view : {"view1.png", "view5.png"}) {
      if (fs::exists(entry.path() / view)) found.push_back(entry.path() / view);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

void compare(const std::vector<fs::path>& files, int repeat) {
  const auto all = methods();
  std::vector<double> mean(all.size());
  std::vector<std::map<std::string, double>> by_pattern(all.size());
  std::vector<std::vector<double>> times(all.size());
  fmt::print("PSNR, dB; means of the four Bayer patterns\n{:<22}", "image");
  for (const Method& m : all) fmt::print(" {:>15}", m.name);
  fmt::print("\n");
  for (const fs::path& file : files) {
    cv::Mat colours;
    cv::cvtColor(cv::imread(file.string()), colours, cv::COLOR_BGR2RGB);
    std::vector<double> of_image(all.size());
    for (const Pattern& pattern : kPatterns) {
      const cv::Mat mosaic = mosaic_of(colours, pattern);
      for (std::size_t i = 0; i < all.size(); ++i) {
        cv::Mat result;
        std::vector<double> runs;
        runs.reserve(static_cast<std::size_t>(repeat));
        for (int r = 0; r < repeat; ++r) runs.push_back(milliseconds([&] { all[i].run(mosaic, pattern, result); }));
        times[i].push_back(median(runs));
        const double value = psnr(colours, result, all[i].row_offset);
        of_image[i] += value / std::size(kPatterns);
        by_pattern[i][pattern.block] += value / static_cast<double>(files.size());
        mean[i] += value / static_cast<double>(files.size() * std::size(kPatterns));
      }
    }
    fmt::print("{:<22}", file.parent_path().filename().string() + "/" + file.stem().string());
    for (const double value : of_image) fmt::print(" {:15.2f}", value);
    fmt::print("\n");
  }
  for (const Pattern& pattern : kPatterns) {
    fmt::print("{:<22}", fmt::format("mean, {}", pattern.block));
    for (auto& values : by_pattern) fmt::print(" {:15.2f}", values[pattern.block]);
    fmt::print("\n");
  }
  fmt::print("{:<22}", "mean");
  for (const double value : mean) fmt::print(" {:15.2f}", value);
  fmt::print("\n{:<22}", "median time, ms");
  for (const auto& t : times) fmt::print(" {:15.3f}", median(t));
  fmt::print("\n");
}

// One large mosaic on every instruction set: RGB and luma output, 8 and 16 bits.
void time_targets(int repeat) {
  constexpr int kSide = 1120;
  Image<std::uint8_t> mosaic8(kSide, kSide);
  Image<std::uint16_t> mosaic16(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      mosaic8(x, y) = static_cast<std::uint8_t>((x * 7 + y * 3 + x * y / 64) & 255);
      mosaic16(x, y) = static_cast<std::uint16_t>(mosaic8(x, y) * 16);
    }
  }
  Image<Rgb8> rgb8(kSide, kSide);
  Image<std::uint8_t> luma8(kSide, kSide);
  Image<spartan::Rgb16> rgb16(kSide, kSide);
  Image<std::uint16_t> luma16(kSide, kSide);
  fmt::print("\n{} x {}, ms: {:>12} {:>8} {:>8} {:>8}\n", kSide, kSide, "RGB 8", "luma 8", "RGB 16", "luma 16");
  const spartan::ThreadPool one(1);
  const auto time = [&](const Debayerer& d, const auto& mosaic, auto& result) {
    const int bits = 8 * static_cast<int>(sizeof(mosaic(0, 0)));
    std::vector<double> runs;
    runs.reserve(static_cast<std::size_t>(repeat));
    for (int r = 0; r < repeat; ++r) {
      runs.push_back(milliseconds([&] {
        d.apply(mosaic.view(), {PixelLayout::bayer_grbg, bits}, result.view(), one);
      }));
    }
    return median(runs);
  };
  for (const auto& [name, method] :
       {std::pair{"bilinear", DebayerMethod::bilinear}, {"edge_aware", DebayerMethod::edge_aware}}) {
    for (const SimdTarget simd : spartan::available_simd_targets()) {
      const Debayerer d(method, simd);
      fmt::print("{:<11} {:<5} {:11.3f} {:8.3f} {:8.3f} {:8.3f}\n", name, name_of(simd),
                 time(d, std::as_const(mosaic8), rgb8), time(d, std::as_const(mosaic8), luma8),
                 time(d, std::as_const(mosaic16), rgb16), time(d, std::as_const(mosaic16), luma16));
    }
  }
  for (const auto& [name, code] :
       {std::pair{"OpenCV", &Pattern::bilinear}, {"OpenCV VNG", &Pattern::vng}, {"OpenCV EA", &Pattern::edge_aware}}) {
    std::vector<double> runs;
    runs.reserve(static_cast<std::size_t>(repeat));
    cv::Mat result;
    for (int r = 0; r < repeat; ++r) {
      runs.push_back(milliseconds([&] { cv::cvtColor(spartan::as_mat(mosaic8), result, kPatterns[1].*code); }));
    }
    fmt::print("{:<17} {:11.3f}\n", name, median(runs));
  }
}

}  // namespace

int main(int argc, char** argv) try {
  int repeat = 9;
  for (int i = 1; i + 1 < argc; ++i) {
    if (std::strcmp(argv[i], "--repeat") == 0) repeat = std::max(1, std::atoi(argv[i + 1]));
  }
  cv::setNumThreads(1);
  const char* const data = std::getenv("SPARTAN_DATA");
  const fs::path folder = data != nullptr ? data : "../shared/data";
  if (fs::exists(folder / "middlebury")) {
    compare(find_images(folder), repeat);
  } else {
    fmt::print("no colour images: set SPARTAN_DATA to the data folder\n");
  }
  time_targets(repeat);
  return 0;
} catch (const std::exception& e) {
  std::fputs(e.what(), stderr);
  return 1;
}
