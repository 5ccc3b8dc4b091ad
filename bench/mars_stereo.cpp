// Stereo matching of simulated pairs by Spartan and OpenCV against ground truth, by range. `make bench-mars_stereo`.
//
//   mars_stereo [--from FOLDER] [--pairs N] [--pair NAME] SCENARIO...
//
// Uses recordings from scripts/recordings. Default: 10 frames of the wide pair (different stops and pans) of
// rocky_20pct, diffuse_200lux, night_edge, flat_featureless.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "standard_recordings.h"
#include "stereo_rivals.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

constexpr double kTwoCentimetres_m = 0.02;
struct RangeBin {
  double from_m, to_m;
};
constexpr std::array<RangeBin, 5> kBins{RangeBin{0, 100}, RangeBin{0, 1.5}, RangeBin{1.5, 2.5}, RangeBin{2.5, 4},
                                        RangeBin{4, 100}};

// Sums over pixels visible in both cameras, for one matcher and one range.
struct Score {
  double truth = 0, matched = 0, beyond_1_px = 0, beyond_2_cm = 0, inside = 0, sum = 0, squares = 0;
  void add(double disparity, double true_disparity, double focal_times_baseline) {
    truth += 1;
    if (!std::isfinite(disparity) || disparity <= 0) return;
    matched += 1;
    const double error = disparity - true_disparity;
    if (std::abs(error) > 1) {
      beyond_1_px += 1;
    } else {
      inside += 1;
      sum += error;
      squares += error * error;
    }
    if (std::abs(focal_times_baseline / disparity - focal_times_baseline / true_disparity) > kTwoCentimetres_m)
      beyond_2_cm += 1;
  }
};
using Scores = std::map<std::string, std::array<Score, kBins.size()>>;

void add_scores(ImageView<const float> estimate, ImageView<const float> truth, ImageView<const std::uint8_t> mask,
                const RectifiedStereo& geometry, std::array<Score, kBins.size()>& scores) {
  const double fb = geometry.focal_px * geometry.baseline_m;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (mask(x, y) != 255) continue;
      const double depth = fb / truth(x, y), u = (x - geometry.centre_px.x()) / geometry.focal_px,
                   v = (y - geometry.centre_px.y()) / geometry.focal_px;
      const double range = depth * std::sqrt(1 + u * u + v * v);
      for (std::size_t b = 0; b < kBins.size(); ++b) {
        if (range >= kBins[b].from_m && range < kBins[b].to_m) scores[b].add(estimate(x, y), truth(x, y), fb);
      }
    }
  }
}

void compare_pair(Recording& source, Imager& imager, const StereoPair& pair, Stamp stamp, const std::string& recording,
                  Scores& scores) {
  const auto frame = source.frame_at(pair.name, stamp);
  const std::string name = fmt::format("/{}/{}.png", pair.name, stamp.ns);
  const auto truth = read_disparity(recording + "/truth/disparity" + name);
  const auto mask = read_truth_mask(recording + "/truth/mask" + name);
  if (!frame || !truth || !mask) return;
  const auto view = imager.process(*frame);
  if (!view) return;
  const DisparityRange range = disparity_range(view->geometry, pair.nearest_m);
  const int disparities = (range.max + 15) / 16 * 16;
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(2)).value();
  if (const auto ours = computer.compute(view->left, view->right, range, view->left_mask, view->right_mask))
    add_scores(ours->disparity, *truth, *mask, view->geometry, scores["Spartan"]);
  for (const OpenCvMatcher& rival :
       {OpenCvMatcher{"SGBM", cv::StereoSGBM::MODE_SGBM}, {"HH", cv::StereoSGBM::MODE_HH}}) {
    add_scores(opencv_disparity(view->left, view->right, disparities, rival), *truth, *mask, view->geometry,
               scores[rival.name]);
  }
}

void print(const std::string& scenario, const Scores& scores) {
  for (const auto& [matcher, bins] : scores) {
    for (std::size_t b = 0; b < kBins.size(); ++b) {
      const Score& s = bins[b];
      if (s.truth < 1) continue;
      const std::string range =
          b == 0 ? "all" : fmt::format("{:.1f}-{:.1f} m", kBins[b].from_m, std::min(kBins[b].to_m, 9.9));
      fmt::print("{:<18} {:<8} {:<10} {:>7.3f} {:>7.3f} {:>9.2f} {:>9.2f} {:>10.2f} {:>9.1f}\n", scenario, matcher,
                 range, std::sqrt(s.squares / s.inside), s.sum / s.inside, 100 * s.beyond_1_px / s.matched,
                 100 * s.beyond_2_cm / s.matched, 100 * (1 - s.matched / s.truth), s.truth / 1e6);
    }
  }
}

void compare(const std::string& folder, const std::string& scenario, const std::string& pair_name, int wanted) {
  const std::string recording = folder + "/" + scenario;
  const auto source = open_recording(recording);
  if (!source) {
    fmt::print("{:<18} skipped: {} (create it with scripts/recordings)\n", scenario, source.error().message());
    return;
  }
  auto imager = Imager::create((*source)->info().rig, ImagingOptions(), ThreadPool(2));
  if (!imager) return;
  Scores scores;
  for (const StereoPair& pair : (*source)->info().rig.pairs) {
    if (pair.name != pair_name) continue;
    const std::vector<Stamp> stamps = (*source)->listed_stamps(pair.name);
    // Spread over the recording, so that stops and pans vary.
    const std::size_t count = std::min<std::size_t>(static_cast<std::size_t>(wanted), stamps.size());
    for (std::size_t i = 0; i < count; ++i)
      compare_pair(**source, *imager, pair, stamps[i * stamps.size() / count], recording, scores);
  }
  print(scenario, scores);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--pairs", "10"}, {"--pair", "wide"}});
  std::vector<std::string>& scenarios = arguments.scenarios;
  if (scenarios.empty()) scenarios = {"rocky_20pct", "diffuse_200lux", "night_edge", "flat_featureless"};
  fmt::print("{:<18} {:<8} {:<10} {:>7} {:>7} {:>9} {:>9} {:>10} {:>9}\n", "scenario", "matcher", "range", "RMS px",
             "mean px", "> 1 px %", "> 2 cm %", "unmatched%", "Mpixels");
  for (const std::string& scenario : scenarios)
    compare(arguments.folder, scenario, arguments.options.at("--pair"), arguments.number("--pairs"));
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
