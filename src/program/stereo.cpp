// spartan stereo: computes the disparity image of one pair of images.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include "program/commands.h"
#include "program/disparity_scores.h"
#include "program/image_memory.h"
#include "program/interrupt.h"
#include "program/json.h"
#include "program/run_arguments.h"
#include "spartan/calibration/pair_check.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/image_io/image_io.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/point_cloud.h"
#include "spartan/reconstruction/rendering.h"

namespace spartan::program {
namespace {

// Decoding and rectifying a pixel takes up to four copies of three samples of 16 bits.
constexpr std::int64_t kBytesOfPixel = 24;
constexpr double kLowDensity_percent = 50;  // of good pairs of the usual data sets: above 80
constexpr double kLargestRowError_px = 1;   // mean; of rectified images: below 0.5

struct StereoArguments {
  std::string left, right, output, rig, calib, truth, mask;
  std::optional<int> min_disparity, max_disparity;
  std::optional<double> truth_scale;
  double max_range_m = 0;
  std::string config;
  std::string method;
  std::vector<std::string> set;
};

// A rectified pair and what is known about its cameras.
struct Pair {
  Image<std::uint8_t> left, right, left_mask, right_mask;
  std::optional<RectifiedStereo> geometry;
  double nearest_m = 0;
};

Result<Pair> load_rectified(const StereoArguments& a) {
  Pair pair;
  auto left = read_gray8(a.left);
  if (!left) return failure(left);
  auto right = read_gray8(a.right);
  if (!right) return failure(right);
  pair.left = std::move(*left);
  pair.right = std::move(*right);
  if (a.calib.empty()) return pair;
  const auto rig = read_rig(a.calib, pair.left.size());
  if (!rig) return failure(rig);
  const StereoPair& stereo_pair = rig->pairs.front();
  const Camera& camera = *rig->find_camera(stereo_pair.left);
  const auto* pinhole = std::get_if<PinholeModel>(&camera.model);
  if (pinhole == nullptr) {
    return failure(ErrorCode::configuration, "is not a calibration of rectified images", a.calib,
                   "use --rig to rectify first");
  }
  const double baseline = rig->right_from_left(stereo_pair).translation().norm();
  pair.geometry = RectifiedStereo{camera.size, pinhole->fx, {pinhole->cx, pinhole->cy}, baseline};
  pair.nearest_m = stereo_pair.nearest_m;
  return pair;
}

Result<Pair> load_and_rectify(const StereoArguments& a, const ImagingOptions& options, int threads) {
  auto left = read_image(a.left);
  if (!left) return failure(left);
  auto right = read_image(a.right);
  if (!right) return failure(right);
  const auto rig = read_rig(a.rig, left->size());
  if (!rig) return failure(rig);
  auto imager = Imager::create(*rig, options, ThreadPool(threads), std::filesystem::path(a.rig).parent_path().string());
  if (!imager) return failure(imager);
  StereoFrame frame;
  const StereoPair& stereo_pair = rig->pairs.front();
  frame.pair = stereo_pair.name;
  frame.left = interpret(*left, rig->find_camera(stereo_pair.left)->pixel_format);
  frame.right = interpret(*right, rig->find_camera(stereo_pair.right)->pixel_format);
  const auto rectified = imager->process(frame);
  if (!rectified) return failure(rectified);
  Pair pair;
  pair.left = Image<std::uint8_t>::copy_of(rectified->left);
  pair.right = Image<std::uint8_t>::copy_of(rectified->right);
  pair.left_mask = Image<std::uint8_t>::copy_of(rectified->left_mask);
  pair.right_mask = Image<std::uint8_t>::copy_of(rectified->right_mask);
  pair.geometry = rectified->geometry;
  pair.nearest_m = stereo_pair.nearest_m;
  return pair;
}

Result<DisparityRange> search_range(const StereoArguments& a, const Pair& pair) {
  const RectifiedStereo geometry = pair.geometry.value_or(RectifiedStereo{pair.left.size(), 1, {0, 0}, 1});
  DisparityRange range = disparity_range(geometry, pair.geometry ? pair.nearest_m : 0);
  if (a.min_disparity) range.min = *a.min_disparity;
  if (a.max_disparity) range.max = *a.max_disparity;
  if (!a.min_disparity && !a.max_disparity) return range;
  const std::string place = "--min-disparity, --max-disparity";
  if (range.min > range.max) {
    return failure(ErrorCode::usage, fmt::format("the range from {} to {} px is empty", range.min, range.max), place,
                   "the minimum must not be greater than the maximum");
  }
  if (range.max >= pair.left.width() || range.min <= -pair.left.width()) {
    return failure(ErrorCode::usage,
                   fmt::format("the range from {} to {} px exceeds the image, which is {} px wide", range.min,
                               range.max, pair.left.width()),
                   place, "disparities are less than the width of the image");
  }
  return range;
}

constexpr float kLargestFixedPoint = 65535.0F / 256;  // of disparity.png

std::int64_t saturated_pixels(ImageView<const float> disparity) {
  std::int64_t count = 0;
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) count += disparity(x, y) > kLargestFixedPoint ? 1 : 0;
  }
  return count;
}

Image<std::uint16_t> to_fixed_point(ImageView<const float> disparity) {
  Image<std::uint16_t> fixed(disparity.size());
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const float d = disparity(x, y);
      if (d > 0) fixed(x, y) = static_cast<std::uint16_t>(std::min(65535.0F, std::round(d * 256.0F)));
    }
  }
  return fixed;
}

Status write_results(const StereoArguments& a, const Pair& pair, const DisparityImage& image, const Log& log) {
  const ImageView<const float> disparity = image.disparity;
  if (Status s = make_folder(a.output); !s) return s;
  if (Status s = write_pfm(a.output + "/disparity.pfm", disparity); !s) return s;
  if (Status s = write_pfm(a.output + "/sigma.pfm", image.sigma); !s) return s;
  if (Status s = write_png(a.output + "/disparity.png", to_fixed_point(disparity)); !s) return s;
  if (Status s = write_png(a.output + "/disparity_colour.png", colour_disparity(disparity)); !s) return s;
  std::error_code ignored;  // files of an earlier pair that this one does not have
  for (const char* name : {"/left_rectified.png", "/points.ply"}) std::filesystem::remove(a.output + name, ignored);
  if (!a.rig.empty()) {
    if (Status s = write_png(a.output + "/left_rectified.png", pair.left); !s) return s;
  }
  if (!pair.geometry) {
    log.info("points.ply is not written: the scale is unknown without --rig or --calib");
    return {};
  }
  CloudSampling sampling;
  sampling.max_range_m = a.max_range_m;
  return write_ply(a.output + "/points.ply",
                   to_point_cloud(disparity, image.sigma, pair.left, *pair.geometry, Pose(), Stamp(), sampling));
}

double known_percent(ImageView<const float> disparity) {
  std::int64_t known = 0;
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) known += !std::isnan(disparity(x, y));
  }
  return 100.0 * static_cast<double>(known) / (static_cast<double>(disparity.width()) * disparity.height());
}

Json times_of(const DisparityTimes& t) {
  return {{"total", t.total}, {"coarse", t.coarse}, {"match", t.match}, {"filter", t.filter}, {"refine", t.refine}};
}

Result<std::optional<DisparityMetrics>> score_disparity(const StereoArguments& a, ImageView<const float> disparity) {
  if (a.truth.empty()) return std::nullopt;
  const auto truth = read_disparity(a.truth, a.truth_scale.value_or(1));
  if (!truth) return failure(truth);
  Image<std::uint8_t> mask;
  if (!a.mask.empty()) {
    auto read = read_truth_mask(a.mask);
    if (!read) return failure(read);
    mask = std::move(*read);
  }
  const auto metrics = compare_disparities(disparity, *truth, mask);
  if (!metrics) return failure(metrics);
  return *metrics;
}

// Images that are not rectified or exchanged give few disparities, many of them wrong: says what the images show.
void check_images(const StereoArguments& a, const Pair& pair, double density_percent, const Context& context) {
  const bool few = density_percent < kLowDensity_percent;
  if (!few && !a.rig.empty()) return;
  const std::array<StereoViews, 1> views{{{pair.left, pair.right}}};
  const auto inspection = inspect_images(views, ThreadPool(context.threads));
  const std::string check = fmt::format("spartan rig inspect {} {} {}", a.rig.empty() ? "-" : a.rig, a.left, a.right);
  bool explained = false;
  if (inspection && inspection->sufficient()) {
    const PairCheck& result = inspection->check;
    explained = result.images_swapped || result.unrectified_rows.mean_px > kLargestRowError_px;
    if (result.images_swapped) {
      context.log.warning("left and right are exchanged: the left image was taken by the right camera");
    } else if (explained) {
      context.log.warning(
          fmt::format("the images are not rectified: rows differ by {:.1f} px (95 % below {:.1f} px){}; check with: {}",
                      result.unrectified_rows.mean_px, result.unrectified_rows.p95_px,
                      a.rig.empty() ? "; give their calibration with --rig" : " with this calibration", check));
    }
  }
  if (few && !explained) {
    context.log.warning(fmt::format(
        "only {:.0f} % of the pixels have a disparity: left and right exchanged, images that are not rectified or of "
        "different times, too small a range (--max-disparity), or little texture; check with: {}",
        density_percent, check));
  }
}

// 8-bit truth of some data sets is scaled.
Status check_truth_scale(const StereoArguments& a, const Log& log) {
  if (a.truth.empty() || a.truth_scale || std::filesystem::path(a.truth).extension() == ".pfm") return {};
  const auto image = read_image(a.truth);
  if (!image) return failure(image);
  if (image->format().bits == 8) {
    log.warning(fmt::format(
        "{}: 8-bit true disparities are taken as whole pixels; state their scale with --truth-scale (Middlebury: 2, 4 "
        "or 8, or 1)",
        a.truth));
  }
  return {};
}

Result<ExitCode> stereo(const Context& context, const StereoArguments& a) {
  std::vector<std::string> set = a.set;
  if (!a.method.empty()) set.push_back("reconstruction.method=" + a.method);
  const auto options = run_options(context, a.config, set);
  if (!options) return failure(options);
  if (Status s = expect_new_folder(context, a.output); !s) return failure(s);
  if (Status s = check_images_fit({a.left, a.right}, kBytesOfPixel, memory_bound(context)); !s) return failure(s);
  auto pair = a.rig.empty() ? load_rectified(a) : load_and_rectify(a, options->imaging, context.threads);
  if (!pair) return failure(pair);
  auto computer = DisparityComputer::create(options->reconstruction, ThreadPool(context.threads));
  if (!computer) return failure(computer);
  const auto range = search_range(a, *pair);
  if (!range) return failure(range);
  if (Status s = DisparityComputer::check_memory(pair->left.size(), *range, context.threads, memory_bound(context)); !s)
    return failure(s);
  if (Status s = expect_not_interrupted(); !s) return failure(s);
  context.log.info(fmt::format("matching {} x {} px, disparities {} to {}", pair->left.width(), pair->left.height(),
                               range->min, range->max));
  const auto image = computer->compute(pair->left, pair->right, *range, pair->left_mask, pair->right_mask);
  if (!image) {
    Error error = image.error();
    if (error.where.empty()) error.where = a.left + ", " + a.right;
    return tl::unexpected<Error>(error);
  }
  if (Status s = expect_not_interrupted(); !s) return failure(s);
  const double density_percent = known_percent(image->sigma);  // measured pixels, not filled ones
  check_images(a, *pair, density_percent, context);
  if (const std::int64_t saturated = saturated_pixels(image->disparity); saturated > 0) {
    context.log.warning(
        fmt::format("{} disparities of more than {:.0f} px are saturated in disparity.png; "
                    "disparity.pfm has their values",
                    saturated, kLargestFixedPoint));
  }
  if (Status s = check_truth_scale(a, context.log); !s) return failure(s);
  const auto metrics = score_disparity(a, image->disparity);
  if (!metrics) return failure(metrics);
  if (Status s = write_results(a, *pair, *image, context.log); !s) return failure(s);

  Json json{{"schema", 1},
            {"width", image->disparity.width()},
            {"height", image->disparity.height()},
            {"density_percent", density_percent},
            {"time_ms", times_of(image->times)},
            {"peak_bytes", image->buffer_bytes}};
  if (*metrics) json["scores"] = to_json(**metrics);
  std::string text = text_of(json) + "\n";
  if (!context.json) {
    text = fmt::format("{} x {} px, density {:.1f} %, {:.1f} ms; results in {}\n", image->disparity.width(),
                       image->disparity.height(), density_percent, image->times.total, a.output);
    if (*metrics) text += table_of(**metrics);
  }
  if (Status s = print(text); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_stereo(CLI::App& app, Context& context) {
  auto a = std::make_shared<StereoArguments>();
  CLI::App* command =
      add_command(app, context, "stereo", "Compute the disparity image and the point cloud of one pair of images",
                  "stereo left.png right.png -o out --calib calib.txt", [&context, a] { return stereo(context, *a); });
  command->add_option("left", a->left, "Left image.")->required();
  command->add_option("right", a->right, "Right image.")->required();
  command->add_option("-o,--output", a->output, "Folder for the results; created if missing.")->required();
  auto* rig = command->add_option("--rig", a->rig,
                                  "Calibration of unrectified images, which are rectified first (default: none).");
  command
      ->add_option(
          "--calib", a->calib,
          "Calibration of images that are already rectified, for the point cloud (default: none). Without --rig and "
          "--calib images are taken as rectified, and there is no point cloud.")
      ->excludes(rig);
  command->add_option("--min-disparity", a->min_disparity, "Minimum disparity in pixels (default 0).");
  command->add_option("--max-disparity", a->max_disparity,
                      "Maximum disparity in pixels (default: of the nearest distance that the rig states, else a "
                      "quarter of the width, rounded up to a multiple of 16, less 1). A larger one costs time.");
  command
      ->add_option(
          "--method", a->method,
          "Matching method: sgm is semi-global matching, block is block matching of Gaussian-weighted absolute "
          "differences (default: reconstruction.method, which is sgm).")
      ->check(CLI::IsMember({"sgm", "block"}));
  command
      ->add_option("--max-range-m", a->max_range_m,
                   "Maximum distance of the points of points.ply from the camera in metres (default: no limit).")
      ->check(positive_number());
  command->add_option("--truth", a->truth, "True disparities (PFM or PNG) to compare with (default: none).");
  command->add_option("--truth-scale", a->truth_scale, "Divisor of 8-bit true disparities (default 1).");
  command->add_option(
      "--mask", a->mask,
      "Mask of the true disparities: 255 scored and non-occluded, 128 occluded, 0 no truth (default: all scored).");
  command->add_option("--config", a->config,
                      "YAML file with options as for `spartan run`; `imaging` (with --rig) and `reconstruction` apply "
                      "(default: none).");
  command
      ->add_option("--set", a->set,
                   "Set one option, e.g. imaging.view.policy=all_valid. Repeatable; overrides --config.")
      ->allow_extra_args(false)
      ->option_text("KEY=VALUE");
  add_force_flag(*command, context);
  add_threads_option(*command, context);
  add_memory_option(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
