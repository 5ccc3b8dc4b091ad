// Compares the texture of simulated soil with real ground: local contrast and power spectrum. `make bench-soil`.
//
//   soil [--images DIR] [--sheet FILE] [--plot FILE.svg] [SCENARIO.yaml...]
//
// Without scenarios: all of config/scenarios. --images: writes the rendered images. --sheet: writes a contact sheet of
// all scenarios beside the pair of Curiosity. --plot: writes the spectra.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/sim/internal/camera/frame_preview.h"
#include "spectrum_plot.h"

namespace spartan {

namespace {

namespace fs = std::filesystem;

constexpr int kWindow = 9;

// Median of standard deviation over mean in the 9 × 9 windows that lie wholly in the mask.
double local_contrast(ImageView<const float> image, ImageView<const std::uint8_t> mask) {
  std::vector<double> contrasts;
  for (int y0 = 0; y0 + kWindow <= image.height(); y0 += kWindow) {
    for (int x0 = 0; x0 + kWindow <= image.width(); x0 += kWindow) {
      double sum = 0, squares = 0;
      bool whole = true;
      for (int y = y0; y < y0 + kWindow; ++y) {
        for (int x = x0; x < x0 + kWindow; ++x) {
          whole = whole && (mask.empty() || mask(x, y) != 0);
          sum += image(x, y);
          squares += static_cast<double>(image(x, y)) * image(x, y);
        }
      }
      constexpr double kCount = kWindow * kWindow;
      const double mean = sum / kCount;
      if (whole && mean > 0) contrasts.push_back(std::sqrt(std::max(0.0, squares / kCount - mean * mean)) / mean);
    }
  }
  if (contrasts.empty()) return std::nan("");
  const auto middle = contrasts.begin() + static_cast<std::ptrdiff_t>(contrasts.size() / 2);
  std::nth_element(contrasts.begin(), middle, contrasts.end());
  return *middle;
}

// Mean power in rings of width 0.03 around each frequency, normalized by the first; Hann window, plane fit removed.
Spectrum spectrum(ImageView<const float> patch) {
  const int n = std::min(patch.width(), patch.height());
  cv::Mat m(n, n, CV_64F), design(n * n, 3, CV_64F), values(n * n, 1, CV_64F), plane;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      design.at<double>(y * n + x, 0) = 1;
      design.at<double>(y * n + x, 1) = x;
      design.at<double>(y * n + x, 2) = y;
      values.at<double>(y * n + x) = patch(x, y);
    }
  }
  cv::solve(design, values, plane, cv::DECOMP_QR);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const auto hann = [n](int i) { return 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (i + 0.5) / n); };
      const double trend = plane.at<double>(0) + plane.at<double>(1) * x + plane.at<double>(2) * y;
      m.at<double>(y, x) = (patch(x, y) - trend) * hann(x) * hann(y);
    }
  }
  cv::Mat f;
  cv::dft(m, f, cv::DFT_COMPLEX_OUTPUT);
  Spectrum power{};
  std::array<int, kFrequencies.size()> count{};
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const double fx = (x <= n / 2 ? x : x - n) / static_cast<double>(n),
                   fy = (y <= n / 2 ? y : y - n) / static_cast<double>(n);
      const double radius = std::hypot(fx, fy);
      const auto c = f.at<cv::Vec2d>(y, x);
      for (std::size_t k = 0; k < kFrequencies.size(); ++k) {
        if (std::abs(radius - kFrequencies[k]) > 0.015) continue;
        power[k] += c[0] * c[0] + c[1] * c[1];
        ++count[k];
      }
    }
  }
  for (std::size_t k = 0; k < power.size(); ++k) power[k] /= count[k];
  for (std::size_t k = power.size(); k-- > 0;) power[k] /= power[0];
  return power;
}

Image<float> to_float(const FrameImage& image) {
  Image<float> out(image.width(), image.height());
  const bool wide = image.format().bits > 8;
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      out(x, y) = wide ? static_cast<float>(image.as<std::uint16_t>()(x, y))
                       : static_cast<float>(image.as<std::uint8_t>()(x, y));
    }
  }
  return out;
}

void print(const Spectrum& power) {
  for (const double p : power) fmt::print(" {:8.4f}", p);
  fmt::print("\n");
}

struct Square {
  int x = 0, y = 0, side = 0;
};

// The largest square of soil alone (64 pixels or more), the lowest in the image; side 0 if there is none.
Square find_soil(ImageView<const std::uint8_t> soil) {
  for (const int side : {128, 112, 96, 80, 64}) {
    for (int y = soil.height() - side - 8; y >= 0; y -= 8) {
      for (int x = 8; x + side < soil.width() - 8; x += 8) {
        int other = 0;
        for (int v = y; v < y + side && other == 0; v += 1) {
          for (int u = x; u < x + side; ++u) other += soil(u, v) == 0 ? 1 : 0;
        }
        if (other == 0) return {x, y, side};
      }
    }
  }
  return {};
}

struct Patch {
  const char* name;
  const char* file;
  int x, y, width, height;
};
constexpr std::array kReal{
    Patch{"sandbox", "rover_sandbox/image_0/000060.png", 190, 165, 96, 96},
    Patch{"sandbox, right", "rover_sandbox/image_0/000060.png", 60, 90, 96, 64},
    Patch{"K10 asphalt", "k10_pair/left4.png", 760, 330, 128, 128},
    Patch{"K10 asphalt, near", "k10_pair/left4.png", 770, 480, 128, 128},
    Patch{"Curiosity ground", "mars/msl_navcam_sol1431/NLB_524534514EDR_F0562034NCAM00280M_.jpeg", 150, 820, 96, 96},
    Patch{"Curiosity slope", "mars/msl_navcam_sol1431/NLB_524534514EDR_F0562034NCAM00280M_.jpeg", 560, 700, 80, 64}};

void measure_real(const std::string& data, SpectrumPlot& plot) {
  for (const Patch& patch : kReal) {
    const auto image = read_gray8(data + "/" + patch.file);
    if (!image) {
      fmt::print("{:28} not found\n", patch.name);
      continue;
    }
    const auto whole = to_float(FrameImage::borrow(image->view(), {}));
    const auto part = whole.view().crop(patch.x, patch.y, patch.width, patch.height);
    fmt::print("{:28} {:8} {:8.3f}  ", patch.name, "", local_contrast(part, {}));
    const Spectrum power = spectrum(part);
    print(power);
    plot.add_real(patch.name, power);
  }
}

constexpr int kTileWidth = 400, kTileHeight = 300, kColumns = 4;

// An image tile of fixed size with its name below, contrast stretched to its 0.5 and 99.5 % quantiles.
cv::Mat tile(ImageView<const std::uint8_t> image, const std::string& name) {
  const cv::Mat whole(image.height(), image.width(), CV_8U, const_cast<std::uint8_t*>(image.data()),
                      static_cast<std::size_t>(image.stride()));
  cv::Mat flat = whole.clone().reshape(1, 1), sorted, small;
  cv::sort(flat, sorted, cv::SORT_EVERY_ROW);
  const double low = sorted.at<std::uint8_t>(sorted.cols / 200),
               high = sorted.at<std::uint8_t>(sorted.cols - 1 - sorted.cols / 200);
  whole.convertTo(small, CV_8U, 235 / std::max(high - low, 1.0), -low * 235 / std::max(high - low, 1.0));
  const double scale =
      std::max(static_cast<double>(kTileWidth) / small.cols, static_cast<double>(kTileHeight) / small.rows);
  cv::resize(small, small, {}, scale, scale, cv::INTER_AREA);
  cv::Mat framed(kTileHeight + 24, kTileWidth, CV_8U, cv::Scalar(255));
  small(cv::Rect((small.cols - kTileWidth) / 2, (small.rows - kTileHeight) / 2, kTileWidth - 4, kTileHeight))
      .copyTo(framed(cv::Rect(0, 0, kTileWidth - 4, kTileHeight)));
  cv::putText(framed, name, {2, kTileHeight + 17}, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar(0), 1, cv::LINE_AA);
  return framed;
}

void write_sheet(const std::string& path, const std::vector<cv::Mat>& tiles) {
  const int rows = (static_cast<int>(tiles.size()) + kColumns - 1) / kColumns;
  cv::Mat sheet(rows * (kTileHeight + 24), kColumns * kTileWidth, CV_8U, cv::Scalar(255));
  for (int i = 0; i < static_cast<int>(tiles.size()); ++i) {
    tiles[static_cast<std::size_t>(i)].copyTo(
        sheet(cv::Rect(i % kColumns * kTileWidth, i / kColumns * (kTileHeight + 24), kTileWidth, kTileHeight + 24)));
  }
  cv::imwrite(path, sheet, {cv::IMWRITE_JPEG_QUALITY, 85});
}

std::optional<sim::SimulationRequest> load(const fs::path& file) {
  const auto text = read_file(file.string());
  if (!text) return std::nullopt;
  const auto scenario = sim::parse_scenario(*text, file.string());
  if (!scenario) {
    fmt::print("{}\n", scenario.error().message());
    return std::nullopt;
  }
  const auto rig = read_rig((fs::path(file).parent_path() / "../rigs" / (scenario->rig + ".yaml")).string());
  if (!rig) return std::nullopt;
  auto drive = sim::plan_drive(*scenario, *rig, *text, file.string());
  if (!drive) {
    fmt::print("{}\n", drive.error().message());
    return std::nullopt;
  }
  return sim::SimulationRequest{*scenario, *rig, std::move(*drive), {}, "", false};
}

void measure(const fs::path& file, const std::string& images, std::vector<cv::Mat>& sheet, SpectrumPlot& plot) {
  const auto request = load(file);
  if (!request) return;
  const auto& frames = request->drive.frames();
  for (const std::string pair : {"narrow", "wide"}) {
    const auto frame = std::find_if(frames.begin(), frames.end(), [&](const sim::PlannedFrame& s) {
      return s.pair == pair && (pair == "narrow" || s.pan_rad == 0);
    });
    if (frame == frames.end()) continue;
    const auto preview =
        sim::internal::preview_left(*request, static_cast<std::size_t>(frame - frames.begin()), ThreadPool(2));
    const Image<float> noisy = to_float(preview.recorded);
    const double black = request->scenario.sensor.black_level * ((1 << preview.recorded.format().bits) - 1);
    Image<float> over_black(noisy.width(), noisy.height());
    for (int y = 0; y < noisy.height(); ++y) {
      for (int x = 0; x < noisy.width(); ++x) over_black(x, y) = noisy(x, y) - static_cast<float>(black);
    }
    fmt::print("{:28} {:8.3f} {:8.3f}  ", fmt::format("{}, {}", file.stem().string(), pair),
               local_contrast(preview.noise_free.view(), preview.soil.view()),
               local_contrast(over_black.view(), preview.soil.view()));
    const Square square = find_soil(preview.soil.view());
    if (square.side > 0) {
      const Spectrum power = spectrum(noisy.view().crop(square.x, square.y, square.side, square.side));
      print(power);
      plot.add_simulated(fmt::format("{}, {}", file.stem().string(), pair), power);
    } else {
      fmt::print(" no square without rocks\n");
    }
    fmt::print(
        "{:28} {}x{} at ({}, {}); exposure {:.2f} ms, gain {:.2f}, {:.2f} million rays per second on two cores\n", "",
        square.side, square.side, square.x, square.y, 1e3 * preview.exposure.seconds, preview.exposure.gain,
        static_cast<double>(preview.rays) / preview.seconds / 1e6);
    if (preview.recorded.format().bits == 8)
      sheet.push_back(tile(preview.recorded.as<std::uint8_t>(), fmt::format("{}, {}", file.stem().string(), pair)));
    if (!images.empty()) {
      const std::string name = fmt::format("{}/{}_{}.png", images, file.stem().string(), pair);
      if (preview.recorded.format().bits == 8) (void)write_png(name, preview.recorded.as<std::uint8_t>());
    }
  }
}

void compare(const std::vector<std::string>& words) {
  std::string images, sheet, plot_file;
  std::vector<fs::path> files;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--images" && i + 1 < words.size()) {
      images = words[++i];
    } else if (word == "--sheet" && i + 1 < words.size()) {
      sheet = words[++i];
    } else if (word == "--plot" && i + 1 < words.size()) {
      plot_file = words[++i];
    } else {
      files.emplace_back(word);
    }
  }
  if (files.empty()) {
    for (const auto& entry : fs::directory_iterator("config/scenarios")) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
  }
  if (!images.empty()) fs::create_directories(images);
  const char* const data = std::getenv("SPARTAN_DATA");
  fmt::print("{:28} {:>8} {:>8}   power at", "", "clean", "noisy");
  for (const double f : kFrequencies) fmt::print(" {:7.2f}", f);
  fmt::print(" cycles per pixel\n");
  const std::string real = data != nullptr ? data : "../shared/data";
  SpectrumPlot plot;
  measure_real(real, plot);
  std::vector<cv::Mat> tiles;
  for (const std::string camera : {"NL", "NR"}) {
    const auto image =
        read_gray8(fmt::format("{}/mars/msl_navcam_sol1431/{}B_524534514EDR_F0562034NCAM00280M_.jpeg", real, camera));
    if (image) {
      tiles.push_back(
          tile(image->view().crop(0, 424, 1024, 600), "Curiosity, " + camera + "B sol 1431 (NASA/JPL-Caltech)"));
    }
  }
  for (const fs::path& file : files) measure(file, images, tiles, plot);
  if (!sheet.empty()) write_sheet(sheet, tiles);
  if (!plot_file.empty()) (void)write_file_atomically(plot_file, plot.svg());
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  try {
    spartan::compare({argv + 1, argv + argc});
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "soil: %s\n", e.what());
    return 1;
  }
}
