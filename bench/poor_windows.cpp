// How often a window does not resemble its partner in the other image: real pairs beside simulated ones.
//
//   poor_windows [--from FOLDER] [--pairs N] [--pair NAME] [SCENARIO...]
//
// The normalized cross-correlation of windows of 9 × 9 pixels, each pixel at its true disparity, where both cameras see
// it: what noise, gloss and low contrast leave, without the slant of surfaces. Real pairs: of $SPARTAN_DATA; SCENARIO:
// recordings of scripts/recordings, N frames of one pair (default: 6 of the wide one). `make bench-poor_windows
// ARGS="..."`.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/imaging/imager.h"
#include "standard_recordings.h"
#include "stereo_pairs.h"

namespace spartan {
namespace {

constexpr int kHalf = 4;
constexpr double kPoor = 0.7;

struct Count {
  double windows = 0, poor = 0;
  std::vector<float> correlations;
};

// What a window of one image and its partner have in common.
struct Window {
  ImageView<const std::uint8_t> left, right;
  ImageView<const float> truth;
  ImageView<const std::uint8_t> mask;

  // Correlation over the pixels that both cameras see, each at its own true disparity; NaN where these are fewer than
  // half.
  double correlation(int x, int y) const {
    double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    for (int v = std::max(y - kHalf, 0); v <= std::min(y + kHalf, left.height() - 1); ++v) {
      for (int u = std::max(x - kHalf, 0); u <= std::min(x + kHalf, left.width() - 1); ++u) {
        if (mask(u, v) != kMaskSeenByBoth) continue;
        const double there = u - static_cast<double>(truth(u, v));
        const int column = static_cast<int>(std::floor(there));
        if (column < 0 || column + 1 >= right.width()) continue;
        const double part = there - column, l = left(u, v),
                     r = (1 - part) * right(column, v) + part * right(column + 1, v);
        n += 1;
        a += l;
        b += r;
        aa += l * l;
        bb += r * r;
        ab += l * r;
      }
    }
    constexpr int kPixels = (2 * kHalf + 1) * (2 * kHalf + 1);
    if (2 * n < kPixels) return std::nan("");
    const double va = aa - a * a / n, vb = bb - b * b / n;
    return va > 0 && vb > 0 ? (ab - a * b / n) / std::sqrt(va * vb) : 0;
  }
};

void add(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right, ImageView<const float> truth,
         ImageView<const std::uint8_t> mask, Count& count) {
  const Window window{left, right, truth, mask};
  for (int y = 0; y < truth.height(); y += 2) {
    for (int x = 0; x < truth.width(); x += 2) {
      if (mask(x, y) != kMaskSeenByBoth) continue;
      const double c = window.correlation(x, y);
      if (std::isnan(c)) continue;
      count.windows += 1;
      count.poor += c < kPoor ? 1 : 0;
      count.correlations.push_back(static_cast<float>(c));
    }
  }
}

void print(const std::string& name, Count& count) {
  if (count.windows < 1) return;
  const auto quantile = [&](double q) {
    const auto at = count.correlations.begin() +
                    static_cast<std::ptrdiff_t>(q * static_cast<double>(count.correlations.size() - 1));
    std::nth_element(count.correlations.begin(), at, count.correlations.end());
    return *at;
  };
  fmt::print("{:<34} {:>10.2f} {:>12.3f} {:>8.3f}\n", name, 100 * count.poor / count.windows, quantile(0.05),
             quantile(0.5));
}

void count_recording(const std::string& folder, const std::string& scenario, const std::string& pair_name, int wanted) {
  const std::string recording = folder + "/" + scenario;
  const auto source = open_recording(recording);
  if (!source) {
    fmt::print("{:<34} skipped: {}\n", scenario, source.error().message());
    return;
  }
  auto imager = Imager::create((*source)->info().rig, ImagingOptions(), ThreadPool(2));
  if (!imager) return;
  const std::vector<Stamp> stamps = (*source)->listed_stamps(pair_name);
  Count count;
  const auto frames = std::min(static_cast<std::size_t>(wanted), stamps.size());
  for (std::size_t k = 0; k < frames; ++k) {
    const Stamp stamp = stamps[k * stamps.size() / frames];
    const auto frame = (*source)->frame_at(pair_name, stamp);
    const std::string name = fmt::format("/{}/{}.png", pair_name, stamp.ns);
    const auto truth = read_disparity(fmt::format("{}/truth/disparity{}", recording, name));
    const auto mask = read_truth_mask(fmt::format("{}/truth/mask{}", recording, name));
    if (!frame || !truth || !mask) continue;
    const auto view = imager->process(*frame);
    if (view) add(view->left, view->right, *truth, *mask, count);
  }
  print(scenario, count);
}

void run(const std::vector<std::string>& words) {
  const RecordingArguments arguments = read_arguments(words, {{"--pairs", "6"}, {"--pair", "wide"}});
  fmt::print("{:<34} {:>10} {:>12} {:>8}\n", "pair or recording", "poor %", "5 % below", "median");
  const char* const data = std::getenv("SPARTAN_DATA");
  if (data == nullptr) fmt::print("no real pairs: set SPARTAN_DATA to the data folder\n");
  for (const Pair& pair : data != nullptr ? load_stereo_pairs(data) : std::vector<Pair>()) {
    Count count;
    add(pair.left, pair.right, pair.truth, pair.mask, count);
    print(pair.name, count);
  }
  for (const std::string& scenario : arguments.scenarios)
    count_recording(arguments.folder, scenario, arguments.options.at("--pair"), arguments.number("--pairs"));
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
