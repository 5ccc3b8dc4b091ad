// Compares rectification with cv::remap (bilinear, CV_16SC2 maps) on one thread in the same run: time, and accuracy
// against bilinear interpolation in double precision at the exact coordinates. `make bench-rectification`.
//
//   rectification [--repeat N]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/imaging/internal/remap.h"
#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"
#include "timing.h"

namespace {

using spartan::Image;
using spartan::ImageSize;

using spartan::median;
using spartan::milliseconds;

// An image with detail down to a pixel, smooth enough for interpolation.
template <class Pixel, int kChannels>
Image<Pixel> make_image(ImageSize size, double full_scale) {
  spartan::Random random(7);
  using Sample = std::conditional_t<sizeof(Pixel) / kChannels == 1, std::uint8_t, std::uint16_t>;
  Image<Pixel> result(size);
  for (int y = 0; y < size.height; ++y) {
    auto* const samples = reinterpret_cast<Sample*>(result.row(y));
    for (int i = 0; i < size.width * kChannels; ++i) {
      const double wave = 0.5 + 0.2 * std::sin(0.7 * i + 0.2 * y) + 0.2 * std::cos(0.31 * y - 0.05 * i);
      samples[i] = static_cast<Sample>(std::clamp(wave + random.uniform(-0.1, 0.1), 0.0, 1.0) * full_scale);
    }
  }
  return result;
}

struct Scene {
  ImageSize size;
  spartan::CameraModel camera;
  spartan::RectifiedStereo view;
  Eigen::Matrix3d rotation;
};

// A lens with the barrel distortion of a wide-angle rover camera, rotated by two degrees about each axis.
Scene scene_of(int width, int height) {
  const double focal = 0.8 * width, cx = (width - 1) / 2.0, cy = (height - 1) / 2.0;
  return {{width, height},
          spartan::RadialTangentialModel({focal, focal * 1.001, cx + 4.3, cy - 3.1}, {-0.28, 0.08, 4e-4, -2e-4}),
          {{width, height}, focal * 0.97, {cx, cy}, 0.1},
          spartan::exp_so3({0.035, -0.035, 0.035}).toRotationMatrix()};
}

struct Maps {
  cv::Mat exact_x, exact_y;  // CV_64F; (-9, -9) without a projection
  cv::Mat fixed, parts;      // in OpenCV's fixed-point format
};

Maps maps_of(const Scene& scene) {
  Maps maps;
  maps.exact_x.create(scene.view.size.height, scene.view.size.width, CV_64F);
  maps.exact_y.create(scene.view.size.height, scene.view.size.width, CV_64F);
  for (int y = 0; y < scene.view.size.height; ++y) {
    for (int x = 0; x < scene.view.size.width; ++x) {
      const Eigen::Vector3d direction((x - scene.view.centre_px.x()) / scene.view.focal_px,
                                      (y - scene.view.centre_px.y()) / scene.view.focal_px, 1);
      const Eigen::Vector2d pixel =
          spartan::project(scene.camera, scene.rotation * direction).value_or(Eigen::Vector2d(-9, -9));
      maps.exact_x.at<double>(y, x) = pixel.x();
      maps.exact_y.at<double>(y, x) = pixel.y();
    }
  }
  cv::Mat x, y;
  maps.exact_x.convertTo(x, CV_32F);
  maps.exact_y.convertTo(y, CV_32F);
  cv::convertMaps(x, y, maps.fixed, maps.parts, CV_16SC2);
  return maps;
}

struct Accuracy {
  double squares = 0, largest = 0, count = 0;
  double rms() const { return std::sqrt(squares / count); }
};

// Over the pixels inside the mask of the table, in gray levels.
template <class Sample>
Accuracy accuracy(const Scene& scene, const Maps& maps, const spartan::internal::RemapTable& table,
                  const cv::Mat& source, const cv::Mat& result) {
  Accuracy sum;
  const int channels = source.channels();
  for (int y = 0; y < result.rows; ++y) {
    for (int x = 0; x < result.cols; ++x) {
      if (!table.mask().empty() && table.mask()(x, y) == 0) continue;
      const double px = maps.exact_x.at<double>(y, x), py = maps.exact_y.at<double>(y, x);
      const int ix = std::min(static_cast<int>(px), scene.size.width - 2);
      const int iy = std::min(static_cast<int>(py), scene.size.height - 2);
      const double fx = px - ix, fy = py - iy;
      for (int c = 0; c < channels; ++c) {
        const auto s = [&](int dx, int dy) {
          return static_cast<double>(source.ptr<Sample>(iy + dy)[(ix + dx) * channels + c]);
        };
        const double level = (1 - fy) * ((1 - fx) * s(0, 0) + fx * s(1, 0)) + fy * ((1 - fx) * s(0, 1) + fx * s(1, 1));
        const double error = static_cast<double>(result.ptr<Sample>(y)[x * channels + c]) - level;
        sum.squares += error * error;
        sum.largest = std::max(sum.largest, std::abs(error));
        ++sum.count;
      }
    }
  }
  return sum;
}

template <class Pixel, int kChannels>
void compare(const Scene& scene, const char* kind, spartan::SimdTarget simd, int repeat) {
  using Sample = std::conditional_t<sizeof(Pixel) / kChannels == 1, std::uint8_t, std::uint16_t>;
  const spartan::ThreadPool one(1);
  const Maps maps = maps_of(scene);
  const spartan::internal::RemapTable table(scene.camera, scene.size, scene.view, scene.rotation, {}, one, 1, simd);
  auto source = make_image<Pixel, kChannels>(scene.size, sizeof(Sample) == 1 ? 255 : 65535);
  Image<Pixel> spartan_result(scene.view.size), opencv_result(scene.view.size);
  const cv::Mat from = spartan::as_mat(source);
  cv::Mat into = spartan::as_mat(opencv_result);

  std::vector<double> spartan_times, opencv_times, ratios;
  for (int i = 0; i < repeat; ++i) {
    spartan_times.push_back(milliseconds([&] { table.apply(source.view(), spartan_result.view(), one); }));
    opencv_times.push_back(
        milliseconds([&] { cv::remap(from, into, maps.fixed, maps.parts, cv::INTER_LINEAR, cv::BORDER_CONSTANT); }));
    ratios.push_back(opencv_times.back() / spartan_times.back());
  }
  const Accuracy a = accuracy<Sample>(scene, maps, table, from, spartan::as_mat(spartan_result));
  const Accuracy b = accuracy<Sample>(scene, maps, table, from, into);
  const double pixels = static_cast<double>(scene.size.width) * scene.size.height;
  fmt::print("{:>4} x {:<4} {:<8} {:<5} {:8.3f} {:10.3f} {:7.1f} {:8.2f} {:7.2f} {:9.3f} {:9.3f} {:9.3f} {:9.3f}\n",
             scene.size.width, scene.size.height, kind, name_of(simd), median(spartan_times), median(opencv_times),
             median(ratios), median(spartan_times) * 1e6 / pixels, static_cast<double>(table.bytes()) / pixels, a.rms(),
             b.rms(), a.largest, b.largest);
}

// Memory bandwidth limit: memcpy of as many bytes as the rectification reads and writes (table, source, result).
void print_memory_limit(const Scene& scene, const char* kind, std::size_t pixel_bytes, int repeat) {
  const spartan::internal::RemapTable table(scene.camera, scene.size, scene.view, scene.rotation, {},
                                            spartan::ThreadPool(1));
  const auto pixels = static_cast<std::size_t>(scene.size.width) * static_cast<std::size_t>(scene.size.height);
  const std::size_t bytes = table.bytes() + 2 * pixel_bytes * pixels;
  std::vector<std::uint8_t> from(bytes / 2, 1), to(bytes / 2);
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(repeat));
  for (int i = 0; i < repeat; ++i) {
    times.push_back(milliseconds([&] { std::memcpy(to.data(), from.data(), to.size()); }));
    from[static_cast<std::size_t>(i) % from.size()] = to[to.size() / 2];
  }
  fmt::print("{:>4} x {:<4} {:<8} {:.2f} bytes moved per pixel; memcpy of the same amount takes {:.3f} ms\n",
             scene.size.width, scene.size.height, kind, static_cast<double>(bytes) / static_cast<double>(pixels),
             median(times));
}

}  // namespace

int main(int argc, char** argv) try {
  int repeat = 201;
  for (int i = 1; i + 1 < argc; ++i) {
    if (std::strcmp(argv[i], "--repeat") == 0) repeat = std::max(1, std::atoi(argv[i + 1]));
  }
  cv::setNumThreads(1);
  fmt::print("{:<11} {:<8} {:<5} {:>8} {:>10} {:>7} {:>8} {:>7} {:>9} {:>9} {:>9} {:>9}\n", "size", "pixels", "simd",
             "Spartan", "OpenCV ms", "ratio", "ns/px", "B/px", "rms", "cv rms", "largest", "cv larg.");
  const Scene small = scene_of(640, 480), large = scene_of(1120, 1120);
  for (const Scene& scene : {small, large}) {
    for (const spartan::SimdTarget simd : spartan::available_simd_targets()) {
      compare<std::uint8_t, 1>(scene, "gray 8", simd, repeat);
      compare<std::uint16_t, 1>(scene, "gray 16", simd, repeat);
      compare<spartan::Rgb8, 3>(scene, "RGB 8", simd, repeat);
      compare<spartan::Rgb16, 3>(scene, "RGB 16", simd, repeat);
    }
    print_memory_limit(scene, "gray 8", sizeof(std::uint8_t), repeat);
    print_memory_limit(scene, "gray 16", sizeof(std::uint16_t), repeat);
    print_memory_limit(scene, "RGB 8", sizeof(spartan::Rgb8), repeat);
    print_memory_limit(scene, "RGB 16", sizeof(spartan::Rgb16), repeat);
  }
  return 0;
} catch (const std::exception& e) {
  std::fputs(e.what(), stderr);
  return 1;
}
