// How much the contrast mapping changes from image to image. `build/release/bench/contrast_flicker RECORDING...`
//
// The mapping of a frame is found by comparing its left image with the same image without the mapping. Printed for the
// odometry pair of each recording: RMS, 99th percentile and largest change of the gray level (0 … 255) that the median
// of the frame before is mapped to; RMS of the change of the slope in %; RMS and largest change of the median of the
// image, without and with the mapping.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/imaging/imager.h"
#include "spartan/system/run_options.h"

namespace spartan {
namespace {

// Output level = slope · input level + offset.
struct Line {
  double slope = 0, offset = 0;
  double at(double level) const { return slope * level + offset; }
};

struct Mapped {
  Line line;
  double median = 0;  // of the input
};

std::optional<Mapped> mapping_of(ImageView<const std::uint8_t> plain, ImageView<const std::uint8_t> mapped) {
  std::array<double, 256> counts{}, sums{};
  for (int y = 0; y < plain.height(); ++y) {
    for (int x = 0; x < plain.width(); ++x) {
      counts[plain(x, y)] += 1;
      sums[plain(x, y)] += mapped(x, y);
    }
  }
  double total = 0, below = 0;
  for (const double count : counts) total += count;
  Mapped result;
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    if (below < total / 2 && below + counts[level] >= total / 2) result.median = static_cast<double>(level);
    below += counts[level];
    if (counts[level] < 50) continue;
    const double x = static_cast<double>(level), y = sums[level] / counts[level];
    if (y < 3 || y > 252) continue;
    const double w = counts[level];
    n += w, sx += w * x, sy += w * y, sxx += w * x * x, sxy += w * x * y;
  }
  const double determinant = n * sxx - sx * sx;
  if (determinant <= 0) return std::nullopt;
  result.line.slope = (n * sxy - sx * sy) / determinant;
  result.line.offset = (sy - result.line.slope * sx) / n;
  return result;
}

struct Summary {
  double rms = 0, percentile_99 = 0, largest = 0;
};

Summary summary_of(std::vector<double> values) {
  if (values.empty()) return {};
  double square = 0;
  for (const double value : values) square += value * value;
  std::sort(values.begin(), values.end());
  return {std::sqrt(square / static_cast<double>(values.size())), values[values.size() * 99 / 100], values.back()};
}

int measure(const std::string& folder) {
  auto recording = open_recording(folder);
  if (!recording) {
    fmt::print(stderr, "{}\n", recording.error().message());
    return 2;
  }
  const Rig& rig = (*recording)->info().rig;
  const std::string pair = odometry_pair_of(rig, {})->name;
  ImagingOptions plain_options;
  plain_options.contrast = false;
  const ThreadPool workers(2);
  Imager plain = Imager::create(rig, plain_options, workers, "").value();
  Imager mapped = Imager::create(rig, {}, workers, "").value();
  std::optional<Mapped> last;
  std::vector<double> changes, medians, mapped_medians;
  double slopes = 0;
  for (;;) {
    auto read = (*recording)->read({});
    if (!read || !read->sample) break;
    const auto* frame = std::get_if<StereoFrame>(&*read->sample);
    if (frame == nullptr || frame->pair != pair) continue;
    const auto a = plain.process(*frame);
    const auto b = mapped.process(*frame);
    if (!a || !b) continue;
    const auto now = mapping_of(a->left, b->left);
    if (!now) continue;
    if (last) {
      changes.push_back(std::abs(now->line.at(last->median) - last->line.at(last->median)));
      medians.push_back(std::abs(now->median - last->median));
      mapped_medians.push_back(std::abs(now->line.at(now->median) - last->line.at(last->median)));
      slopes += std::pow(std::log(now->line.slope / last->line.slope), 2);
    }
    last = now;
  }
  const auto [rms, high, largest] = summary_of(changes);
  const auto [median_rms, median_high, median_largest] = summary_of(medians);
  const auto [mapped_rms, mapped_high, mapped_largest] = summary_of(mapped_medians);
  fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.1f}, {:.0f} | {:.1f}, {:.0f} |\n", folder,
             changes.size(), rms, high, largest, 100 * std::sqrt(slopes / static_cast<double>(changes.size())),
             median_rms, median_largest, mapped_rms, mapped_largest);
  return 0;
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  fmt::print(
      "| recording | frames | RMS | 99 % | largest | slope, RMS, % | median | mapped median "
      "|\n|---|---|---|---|---|---|---|---|\n");
  int result = 0;
  for (int i = 1; i < argc; ++i) result = std::max(result, spartan::measure(argv[i]));
  return result;
}
