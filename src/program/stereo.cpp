// spartan stereo: one pair of images to a disparity image.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "program/disparity_scores.h"
#include "program/json.h"
#include "program/run_arguments.h"
#include "program/verbs.h"
#include "spartan/camera/interpretation.h"
#include "spartan/core/files.h"
#include "spartan/core/image_io.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/eval/disparity_truth.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/disparity_colour.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/disparity_options.h"
#include "spartan/reconstruction/point_cloud.h"
#include "spartan/rig/formats/rig_files.h"

namespace spartan::program {
namespace {

struct StereoArguments {
  std::string left, right, output, rig, calib, truth, mask;
  std::optional<int> min_disparity, max_disparity;
  double truth_scale = 1;
  std::string config;
  std::vector<std::string> set;
};

// A pair with common rows, and what is known about its cameras.
struct Shot {
  Image<std::uint8_t> left, right, left_mask, right_mask;
  std::optional<RectifiedStereo> geometry;
  double nearest_m = 0;
};

Result<Shot> load_rectified(const StereoArguments& a) {
  Shot shot;
  auto left = read_gray8(a.left);
  if (!left) return failure(left);
  auto right = read_gray8(a.right);
  if (!right) return failure(right);
  shot.left = std::move(*left);
  shot.right = std::move(*right);
  if (a.calib.empty()) return shot;
  const auto rig = read_rig(a.calib, shot.left.size());
  if (!rig) return failure(rig);
  const StereoPair& pair = rig->pairs.front();
  const Camera& camera = *rig->find_camera(pair.left);
  const auto* pinhole = std::get_if<PinholeModel>(&camera.model);
  if (pinhole == nullptr) {
    return failure(ErrorCode::configuration, "is not the calibration of rectified images", a.calib,
                   "use --rig to rectify first");
  }
  const double baseline = rig->right_from_left(pair).translation().norm();
  shot.geometry = RectifiedStereo{camera.size, pinhole->fx, {pinhole->cx, pinhole->cy}, baseline};
  shot.nearest_m = pair.nearest_m;
  return shot;
}

Result<Shot> load_and_rectify(const StereoArguments& a, const ImagingOptions& options, int threads) {
  auto left = read_image(a.left);
  if (!left) return failure(left);
  auto right = read_image(a.right);
  if (!right) return failure(right);
  const auto rig = read_rig(a.rig, left->size());
  if (!rig) return failure(rig);
  auto imager = Imager::create(*rig, options, Workers(threads), std::filesystem::path(a.rig).parent_path().string());
  if (!imager) return failure(imager);
  StereoFrame frame;
  const StereoPair& pair = rig->pairs.front();
  frame.pair = pair.name;
  frame.left = interpret(*left, rig->find_camera(pair.left)->pixel_format);
  frame.right = interpret(*right, rig->find_camera(pair.right)->pixel_format);
  const auto rectified = imager->process(frame);
  if (!rectified) return failure(rectified);
  Shot shot;
  shot.left = Image<std::uint8_t>::copy_of(rectified->left);
  shot.right = Image<std::uint8_t>::copy_of(rectified->right);
  shot.left_mask = Image<std::uint8_t>::copy_of(rectified->left_mask);
  shot.right_mask = Image<std::uint8_t>::copy_of(rectified->right_mask);
  shot.geometry = rectified->geometry;
  shot.nearest_m = pair.nearest_m;
  return shot;
}

DisparityRange search_range(const StereoArguments& a, const Shot& shot) {
  const RectifiedStereo geometry = shot.geometry.value_or(RectifiedStereo{shot.left.size(), 1, {0, 0}, 1});
  DisparityRange range = disparity_range(geometry, shot.geometry ? shot.nearest_m : 0);
  if (a.min_disparity) range.min = *a.min_disparity;
  if (a.max_disparity) range.max = *a.max_disparity;
  return range;
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

Status write_results(const StereoArguments& a, const Shot& shot, ImageView<const float> disparity, const Log& log) {
  if (Status s = make_folder(a.output); !s) return s;
  if (Status s = write_pfm(a.output + "/disparity.pfm", disparity); !s) return s;
  if (Status s = write_png(a.output + "/disparity.png", to_fixed_point(disparity)); !s) return s;
  if (Status s = write_png(a.output + "/disparity_colour.png", colour_disparity(disparity)); !s) return s;
  if (!a.rig.empty()) {
    if (Status s = write_png(a.output + "/left_rectified.png", shot.left); !s) return s;
  }
  if (!shot.geometry) {
    log.info("no points.ply: without --rig or --calib the scale is not known");
    return {};
  }
  return write_ply(a.output + "/points.ply", to_point_cloud(disparity, shot.left, *shot.geometry, Pose(), 1, 0.5));
}

double known_percent(ImageView<const float> disparity) {
  std::int64_t known = 0;
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) known += !std::isnan(disparity(x, y));
  }
  return 100.0 * static_cast<double>(known) / (static_cast<double>(disparity.width()) * disparity.height());
}

Json times_of(const DisparityTimes& t) {
  return {{"total", t.total},   {"cost", t.cost},   {"aggregate", t.aggregate}, {"select", t.select},
          {"refine", t.refine}, {"check", t.check}, {"filter", t.filter}};
}

Result<std::optional<DisparityMetrics>> score(const StereoArguments& a, ImageView<const float> disparity) {
  if (a.truth.empty()) return std::nullopt;
  const auto truth = read_disparity(a.truth, a.truth_scale);
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

Result<ExitCode> stereo(const Context& context, const StereoArguments& a) {
  const auto options = run_options(a.config, a.set);
  if (!options) return failure(options);
  auto shot = a.rig.empty() ? load_rectified(a) : load_and_rectify(a, options->imaging, context.threads);
  if (!shot) return failure(shot);
  DisparityComputer computer(options->reconstruction, Workers(context.threads));
  const auto image =
      computer.compute(shot->left, shot->right, search_range(a, *shot), shot->left_mask, shot->right_mask);
  if (!image) {
    Error error = image.error();
    if (error.where.empty()) error.where = a.left + ", " + a.right;
    return tl::unexpected<Error>(error);
  }
  const auto metrics = score(a, image->disparity);
  if (!metrics) return failure(metrics);
  if (Status s = write_results(a, *shot, image->disparity, context.log); !s) return failure(s);

  Json json{{"schema", 1},
            {"width", image->disparity.width()},
            {"height", image->disparity.height()},
            {"density_percent", known_percent(image->disparity)},
            {"time_ms", times_of(image->times)},
            {"peak_bytes", image->buffer_bytes}};
  if (*metrics) json["scores"] = to_json(**metrics);
  std::string text = json.dump(2) + "\n";
  if (!context.json) {
    text = fmt::format("{} x {} px, {:.1f} % known, {:.1f} ms; results in {}\n", image->disparity.width(),
                       image->disparity.height(), known_percent(image->disparity), image->times.total, a.output);
    if (*metrics) text += table_of(**metrics);
  }
  if (Status s = print(text); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_stereo(CLI::App& app, Context& context) {
  auto a = std::make_shared<StereoArguments>();
  CLI::App* verb =
      add_verb(app, context, "stereo", "One pair of images to a disparity image and a point cloud",
               "stereo left.png right.png -o out --calib calib.txt", [&context, a] { return stereo(context, *a); });
  verb->add_option("left", a->left, "left image")->required();
  verb->add_option("right", a->right, "right image")->required();
  verb->add_option("-o,--output", a->output, "folder for the results")->required();
  auto* rig = verb->add_option("--rig", a->rig, "calibration of the images as taken: they are rectified first");
  verb->add_option("--calib", a->calib, "calibration of images that are rectified already")->excludes(rig);
  verb->add_option("--min-disparity", a->min_disparity, "smallest disparity, px (default 0)");
  verb->add_option("--max-disparity", a->max_disparity,
                   "largest disparity, px (default: from the rig, else a quarter of the width)");
  verb->add_option("--truth", a->truth, "true disparities (PFM, or PNG) to score against");
  verb->add_option("--truth-scale", a->truth_scale, "8-bit truth is divided by this");
  verb->add_option("--mask", a->mask, "255 scored and seen by both eyes, 128 occluded, 0 no truth");
  verb->add_option("--config", a->config, "options that differ from the defaults, as for run: imaging, reconstruction");
  verb->add_option("--set", a->set, "one option, like imaging.view.policy=all_valid; may be given again")
      ->allow_extra_args(false);
  add_threads_option(*verb, context);
  add_json_flag(*verb, context);
}

}  // namespace spartan::program
