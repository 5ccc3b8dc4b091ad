// Effect of the imaging options on stereo matching of real pairs with ground truth, and their cost. `make
// bench-imaging`.
//
//   imaging [--threads N]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/image_io/image_io.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/imaging/imager.h"
#include "spartan/imaging/internal/contrast.h"
#include "spartan/imaging/internal/debayer.h"
#include "spartan/numerics/random.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "stereo_pairs.h"
#include "timing.h"

namespace spartan {

using namespace internal;
namespace {

struct Variant {
  std::string name;
  ImagingOptions options;
};

ImagingOptions with(bool gain_compensation, bool contrast, double local_clip = 0) {
  ImagingOptions options;
  options.gain_compensation = gain_compensation;
  options.contrast = contrast;
  if (local_clip > 0) options.local_contrast = {true, 8, local_clip};
  return options;
}

const std::vector<Variant> kGrayVariants = {
    {"no contrast", with(false, false)},        {"stretch", with(false, true)},
    {"stretch, balance", with(true, true)},     {"stretch, local 2", with(false, true, 2)},
    {"stretch, local 4", with(false, true, 4)}, {"all three, local 2", with(true, true, 2)}};

/// Two images as recorded.
struct RawPair {
  FrameImage left, right;
  std::vector<double> vignetting;  ///< coefficients in the rig file, both cameras
};

struct Scores {
  double bad_2 = 0, matched_bad_2 = 0, density = 0, ms = 0;
  void add(const Scores& other) {
    bad_2 += other.bad_2;
    matched_bad_2 += other.matched_bad_2;
    density += other.density;
    ms += other.ms;
  }
};

Scores score(const Pair& pair, const RawPair& raw, const ImagingOptions& options, int threads) {
  Camera left;
  left.name = "left";
  left.size = raw.left.size();
  left.pixel_format = raw.left.format();
  left.model = PinholeModel{1000, 1000, (left.size.width - 1) / 2.0, (left.size.height - 1) / 2.0};
  left.vignetting.coefficients = raw.vignetting;
  Camera right = left;
  right.name = "right";
  const Rig rig = rig_of_one_pair(pair.name, left, right, Pose(Eigen::Quaterniond::Identity(), {-0.1, 0, 0}));
  auto imager = must(Imager::create(rig, options, ThreadPool(threads)));
  StereoFrame frame;
  frame.pair = rig.pairs.front().name;
  frame.left = raw.left;
  frame.right = raw.right;
  std::vector<double> times;
  RectifiedPair rectified;
  for (int i = 0; i < 5; ++i) {
    rectified = must(imager.process(frame));
    double sum = 0;
    for (const StageTime& t : rectified.times) sum += t.wall_ms;
    times.push_back(sum);
  }
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(threads)).value();
  const auto image = must(computer.compute(rectified.left, rectified.right, {0, pair.disparities - 1}));
  const auto all = must(compare_disparities(image.disparity, pair.truth, pair.mask)).all;
  return {all.bad_2.value_or(0), all.matched_bad_2.value_or(0), all.density_percent.value_or(0),
          *std::min_element(times.begin(), times.end())};
}

/// The image as recorded by a camera with another gain and vignetting, 12 bits.
FrameImage simulate_lens(ImageView<const std::uint8_t> image, double gain, const std::vector<double>& vignetting) {
  const PixelFormat format{PixelLayout::gray, 12};
  const Vignetting lens{vignetting, {}};
  Image<std::uint16_t> recorded(image.size());
  const double cx = (image.width() - 1) / 2.0, cy = (image.height() - 1) / 2.0;
  const double diagonal_squared = image.width() * image.width() + image.height() * image.height();
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double rho2 = 4 * ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / diagonal_squared;
      recorded(x, y) =
          static_cast<std::uint16_t>(std::min(4095.0, image(x, y) * 16 * gain * lens.relative_illumination(rho2)));
    }
  }
  return FrameImage::own(std::move(recorded), format);
}

Image<Rgb8> read_colours(const std::filesystem::path& path) {
  cv::Mat colours;
  cv::cvtColor(cv::imread(path.string()), colours, cv::COLOR_BGR2RGB);
  return Image<Rgb8>::copy_of(as_view<Rgb8>(colours));
}

FrameImage mosaic_of(const Image<Rgb8>& colours) {
  Image<std::uint8_t> mosaic(colours.size());
  for (int y = 0; y < mosaic.height(); ++y) {
    for (int x = 0; x < mosaic.width(); ++x) {
      const Rgb8 c = colours(x, y);
      mosaic(x, y) = (x & 1) != (y & 1) ? c.g : (y & 1) == 0 ? c.r : c.b;
    }
  }
  return FrameImage::own(std::move(mosaic), PixelFormat{PixelLayout::bayer_rggb, 8});
}

class Table {
 public:
  explicit Table(const std::string& title) {
    fmt::print("\n{}\n{:<18} {:<26} {:>7} {:>9} {:>8} {:>9}\n", title, "pair", "variant", "bad-2", "of match.",
               "density", "imaging ms");
  }
  void note(const std::string& pair, const std::string& variant_name, const Scores& s) {
    print(pair, variant_name, s);
    if (!sums_.contains(variant_name)) order_.push_back(variant_name);
    sums_[variant_name].add(s);
    ++counts_[variant_name];
  }
  ~Table() {
    for (const std::string& name : order_) {
      Scores s = sums_[name];
      const double n = counts_[name];
      print("mean", name, {s.bad_2 / n, s.matched_bad_2 / n, s.density / n, s.ms / n});
    }
  }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

 private:
  static void print(const std::string& pair, const std::string& variant_name, const Scores& s) {
    fmt::print("{:<18} {:<26} {:7.2f} {:9.2f} {:8.2f} {:9.3f}\n", pair, variant_name, s.bad_2, s.matched_bad_2,
               s.density, s.ms);
  }
  std::vector<std::string> order_;
  std::map<std::string, Scores> sums_;
  std::map<std::string, int> counts_;
};

void compare_contrast(const std::vector<Pair>& pairs, int threads) {
  Table table("Gray pairs, unchanged");
  for (const Pair& pair : pairs) {
    const RawPair raw{FrameImage::borrow(pair.left.view(), {}), FrameImage::borrow(pair.right.view(), {}), {}};
    for (const Variant& v : kGrayVariants) table.note(pair.name, v.name, score(pair, raw, v.options, threads));
  }
}

void compare_lenses(const std::vector<Pair>& pairs, int threads) {
  Table table("12 bits; right camera at 0.6 of the light, then both cameras with vignetting to 0.4 in the corners");
  for (const Pair& pair : pairs) {
    const RawPair dark{simulate_lens(pair.left, 1, {}), simulate_lens(pair.right, 0.6, {}), {}};
    for (const bool gain_compensation : {false, true}) {
      ImagingOptions options;
      options.gain_compensation = gain_compensation;
      table.note(pair.name, gain_compensation ? "dark right, balance" : "dark right",
                 score(pair, dark, options, threads));
    }
    const std::vector<double> lens{-0.6};
    const RawPair shaded{simulate_lens(pair.left, 1, lens), simulate_lens(pair.right, 1, lens), lens};
    for (const bool undo : {false, true}) {
      ImagingOptions options;
      options.vignetting = undo;
      table.note(pair.name, undo ? "vignetting, corrected" : "vignetting", score(pair, shaded, options, threads));
    }
  }
}

void compare_debayering(const std::vector<Pair>& pairs, int threads) {
  Table table("Colour pairs as Bayer mosaics");
  for (const Pair& pair : pairs) {
    if (!std::filesystem::exists(pair.folder / "view5.png")) continue;
    const auto left = read_colours(pair.folder / "view1.png"), right = read_colours(pair.folder / "view5.png");
    const PixelFormat rgb{PixelLayout::rgb, 8};
    const RawPair full{FrameImage::borrow(left.view(), rgb), FrameImage::borrow(right.view(), rgb), {}};
    table.note(pair.name, "full colour", score(pair, full, {}, threads));
    const RawPair mosaics{mosaic_of(left), mosaic_of(right), {}};
    for (const char* method : {"bilinear", "edge_aware"}) {
      const auto options = must(set_option(ImagingOptions(), fmt::format("debayer={}", method)));
      table.note(pair.name, method, score(pair, mosaics, options, threads));
    }
  }
}

/// The median ratio of left to right gray level over pixels matched by stereo.
double matched_ratio(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right, int threads) {
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(threads)).value();
  const auto image = must(computer.compute(left, right, {0, 127}));
  Random random(1);
  std::vector<double> ratios;
  for (int y = 0; y < left.height(); ++y) {
    for (int x = 0; x < left.width(); ++x) {
      const float d = image.disparity(x, y);
      const int right_x = std::isnan(d) ? -1 : x - static_cast<int>(std::lround(d));
      if (right_x < 0 || left(x, y) < 8 || right(right_x, y) < 8 || left(x, y) > 254 || right(right_x, y) > 254)
        continue;
      // Dither: gray levels are integers, and the median of their ratios would be quantized.
      ratios.push_back((left(x, y) + random.uniform(-0.5, 0.5)) / right(right_x, y));
    }
  }
  return median(std::move(ratios));
}

/// Brightness ratio of the cameras by histograms, frame by frame, against the ratio over pixels matched by stereo.
void compare_gains(const std::filesystem::path& folder, int threads) {
  fmt::print("\n{:<14} {:>6} {:>11} {:>9} {:>13} {:>11}\n", "recording", "frames", "RMS error", "largest",
             "largest step", "of the gain");
  for (const char* name : {"kitti_06", "kitti_0013", "rover_sandbox"}) {
    if (!std::filesystem::exists(folder / name)) continue;
    auto source = must(open_recording((folder / name).string()));
    double squares = 0, largest = 0, step_of_ratio = 0, step_of_gain = 0, ratio_before = 0, gain_before = 0;
    int frames = 0;
    for (auto sample = must(source->next()); sample; sample = must(source->next())) {
      const auto* frame = std::get_if<StereoFrame>(&*sample);
      if (frame == nullptr) continue;
      const auto left = frame->left.as<std::uint8_t>(), right = frame->right.as<std::uint8_t>();
      GrayHistogram left_histogram({}), right_histogram({});
      left_histogram.add(left);
      right_histogram.add(right);
      const double ratio = brightness_ratio(left_histogram, right_histogram);
      const double gain = gain_between(left_histogram, right_histogram);
      const double error = ratio / matched_ratio(left, right, threads) - 1;
      squares += error * error;
      largest = std::max(largest, std::abs(error));
      if (frames > 0) {
        step_of_ratio = std::max(step_of_ratio, std::abs(ratio - ratio_before));
        step_of_gain = std::max(step_of_gain, std::abs(gain - gain_before));
      }
      ratio_before = ratio;
      gain_before = gain;
      ++frames;
    }
    fmt::print("{:<14} {:6} {:11.3f} {:9.3f} {:13.3f} {:11.3f}\n", name, frames, std::sqrt(squares / frames), largest,
               step_of_ratio, step_of_gain);
  }
}

void run(int threads) {
  const char* const data = std::getenv("SPARTAN_DATA");
  const std::filesystem::path folder = data != nullptr ? data : "../shared/data";
  if (!std::filesystem::exists(folder / "middlebury")) {
    fmt::print("no stereo pairs: set SPARTAN_DATA to the data folder\n");
    return;
  }
  const std::vector<Pair> pairs = load_stereo_pairs(folder);
  compare_contrast(pairs, threads);
  compare_lenses(pairs, threads);
  compare_debayering(pairs, threads);
  compare_gains(folder, threads);
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) try {
  int threads = 1;
  for (int i = 1; i + 1 < argc; ++i) {
    if (std::strcmp(argv[i], "--threads") == 0) threads = std::max(1, std::atoi(argv[i + 1]));
  }
  spartan::run(threads);
  return 0;
} catch (const std::exception& e) {
  std::fputs(e.what(), stderr);
  return 1;
}
