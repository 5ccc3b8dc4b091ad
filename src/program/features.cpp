// spartan features: detectors of landmarks, compared on two images.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string_view>

#include "program/commands.h"
#include "program/feature_report.h"
#include "program/image_memory.h"
#include "program/interrupt.h"
#include "program/run_arguments.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/odometry/view_matching.h"

namespace spartan::program {
namespace {

struct CompareArguments {
  std::string first, second, output, homography, config;
  bool rectified = false;
  std::optional<double> rotate_deg, scale;
  std::vector<std::string> detectors, set;
  int features = 500, repetitions = 5;
  double tolerance_px = 2;
};

// SIFT enlarges an image twice; its pyramid has the most bytes for a pixel.
constexpr std::int64_t kBytesOfPixel = 300;
// A view that is made may have so many times the pixels of the image: turned by 45°, or 1.5 times as wide.
constexpr double kLargestMadeArea = 2.3;
constexpr double kSmallestSide_px = 16;

struct NamedDetector {
  std::string_view name;
  DetectorType type;
  bool oriented, refined;  // SURF only: surf.upright=false, surf.refine=true
};
constexpr std::array kDetectors{NamedDetector{"surf", DetectorType::surf, false, false},
                                NamedDetector{"surf_oriented", DetectorType::surf, true, false},
                                NamedDetector{"surf_refined", DetectorType::surf, true, true},
                                NamedDetector{"harris", DetectorType::harris, false, false},
                                NamedDetector{"orb", DetectorType::orb, false, false},
                                NamedDetector{"sift", DetectorType::sift, false, false},
                                NamedDetector{"akaze", DetectorType::akaze, false, false}};

DetectionOptions options_of(const NamedDetector& detector, DetectionOptions options, int features) {
  options.detector = detector.type;
  options.landmarks = features;
  if (detector.oriented) options.surf.upright = false;
  if (detector.refined) options.surf.refine = true;
  return options;
}

struct ViewAndGeometry {
  ComparedView view;
  std::optional<ImageRelation> geometry;  // none: to be estimated
};

ViewAndGeometry made_view(ImageView<const std::uint8_t> first, double rotation_deg, double scale) {
  TransformedView made = transform_view(first, rotation_deg * std::numbers::pi / 180, scale);
  ComparedView view;
  const bool both = rotation_deg != 0 && scale != 1;
  if (rotation_deg != 0 || scale == 1) view.name = fmt::format("rotation {:g} deg", rotation_deg);
  if (both) view.name += ", ";
  if (scale != 1) view.name += fmt::format("scale {:g}", scale);
  for (const char c : view.name) {
    if (c != ',') view.file_tag += c == ' ' ? '_' : c;
  }
  view.geometry = "homography";
  view.rotation_deg = rotation_deg;
  view.scale = scale;
  view.made = true;
  view.image = std::move(made.image);
  return {std::move(view), made.geometry};
}

Status check_usage(const CompareArguments& a) {
  const std::string command = "features compare";
  const bool made = a.rotate_deg || a.scale;
  if (!a.second.empty() && made) {
    return failure(ErrorCode::usage, "B is given, and --rotate-deg or --scale, which make it from A", command,
                   "give one of them");
  }
  if (a.second.empty() && (a.rectified || !a.homography.empty())) {
    return failure(ErrorCode::usage, "--homography and --rectified need B", command, "give a second image");
  }
  return {};
}

// The second image of a file, with what the command line says about its geometry.
Result<ViewAndGeometry> given_view(const CompareArguments& a, ImageSize first) {
  auto image = read_gray8(a.second);
  if (!image) return failure(image);
  ViewAndGeometry result;
  result.view.name = a.second;
  result.view.geometry = "estimated";
  result.view.image = std::move(*image);
  if (!a.homography.empty()) {
    const auto text = read_file(a.homography, 1 << 16);
    if (!text) return failure(text);
    const auto matrix = parse_homography(*text, a.homography);
    if (!matrix) return failure(matrix);
    result.view.geometry = "homography";
    result.geometry = ImageRelation{ImageRelation::Kind::homography, *matrix};
  } else if (a.rectified) {
    if (result.view.image.size() != first) {
      return failure(ErrorCode::input,
                     fmt::format("is {} x {} px, {} {} x {}", result.view.image.width(), result.view.image.height(),
                                 a.first, first.width, first.height),
                     a.second, "rectified images of a pair have one size");
    }
    // Corresponding points have the same y.
    Eigen::Matrix3d rows;
    rows << 0, 0, 0, 0, 0, -1, 0, 1, 0;
    result.view.geometry = "rectified";
    result.geometry = ImageRelation{ImageRelation::Kind::epipolar, rows};
  }
  return result;
}

Result<std::vector<ViewAndGeometry>> views_of(const CompareArguments& a, ImageView<const std::uint8_t> first) {
  std::vector<ViewAndGeometry> views;
  if (!a.second.empty()) {
    auto given = given_view(a, first.size());
    if (!given) return failure(given);
    views.push_back(std::move(*given));
    return views;
  }
  if (a.rotate_deg || a.scale) {
    const double scale = a.scale.value_or(1);
    const double side = std::max(first.width(), first.height()) * scale * std::numbers::sqrt2;
    if (std::min(first.width(), first.height()) * scale < kSmallestSide_px || side >= 32767) {
      return failure(
          ErrorCode::usage,
          fmt::format("an image of {} x {} px cannot be scaled by {:g}", first.width(), first.height(), scale),
          "--scale", "the result must have sides from 16 to 32766 px");
    }
    views.push_back(made_view(first, a.rotate_deg.value_or(0), scale));
    return views;
  }
  for (const auto& [rotation_deg, scale] : {std::pair(10.0, 1.0), {45.0, 1.0}, {0.0, 0.7}, {0.0, 1.5}})
    views.push_back(made_view(first, rotation_deg, scale));
  return views;
}

Status compare_on(const CompareArguments& a, const DetectionOptions& detection, ImageView<const std::uint8_t> first,
                  const ThreadPool& workers, ViewAndGeometry& pair) {
  std::vector<FeatureComparison> comparisons;
  std::vector<std::string> names;
  for (const NamedDetector& detector : kDetectors) {
    const auto& wanted = a.detectors;
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), detector.name) == wanted.end()) continue;
    if (Status s = expect_not_interrupted(); !s) return s;
    FeatureComparisonOptions options;
    options.detection = options_of(detector, detection, a.features);
    options.repetitions = a.repetitions;
    comparisons.push_back(
        match_features(first, std::as_const(pair.view.image).view(), pair.geometry, options, workers));
    names.emplace_back(detector.name);
  }
  if (!pair.geometry) pair.geometry = estimate_epipolar_geometry(comparisons, a.tolerance_px);
  if (!pair.geometry) {
    return failure(ErrorCode::input, "too few matches agree on an epipolar geometry", a.first + ", " + a.second,
                   "give images of one scene, or the geometry with --homography or --rectified");
  }
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    score_features(*pair.geometry, a.tolerance_px, comparisons[i]);
    pair.view.detectors.push_back({names[i], std::move(comparisons[i])});
  }
  return {};
}

Status draw_views(const std::string& folder, ImageView<const std::uint8_t> first,
                  const std::vector<ComparedView>& views) {
  if (folder.empty()) return {};
  if (Status s = make_folder(folder); !s) return s;
  for (const ComparedView& view : views) {
    for (const ComparedDetector& detector : view.detectors) {
      const std::string path =
          fmt::format("{}/{}{}{}.png", folder, view.file_tag, view.file_tag.empty() ? "" : "_", detector.name);
      const Image<Rgb8> figure = draw_comparison(first, view.image, detector.result);
      if (Status s = write_png(path, figure.view()); !s) return s;
    }
  }
  return {};
}

Result<ExitCode> compare(const Context& context, const CompareArguments& a) {
  if (Status s = check_usage(a); !s) return failure(s);
  const auto options = run_options(context, a.config, a.set);
  if (!options) return failure(options);
  if (Status s = expect_new_folder(context, a.output); !s) return failure(s);
  std::vector<std::string> files{a.first};
  if (!a.second.empty()) files.push_back(a.second);
  const double enlarged = a.second.empty() ? std::max(kLargestMadeArea, 2 * std::pow(a.scale.value_or(1), 2)) : 1;
  const auto bytes = static_cast<std::int64_t>(std::ceil(enlarged * static_cast<double>(kBytesOfPixel)));
  if (Status s = check_images_fit(files, bytes, memory_bound(context)); !s) return failure(s);
  const auto image = read_gray8(a.first);
  if (!image) return failure(image);
  const ImageView<const std::uint8_t> first = image->view();
  auto pairs = views_of(a, first);
  if (!pairs) return failure(pairs);
  const ThreadPool workers(context.threads);
  std::vector<ComparedView> views;
  for (ViewAndGeometry& pair : *pairs) {
    if (Status s = compare_on(a, options->odometry.detection, first, workers, pair); !s) return failure(s);
    views.push_back(std::move(pair.view));
  }
  if (Status s = draw_views(a.output, first, views); !s) return failure(s);
  const ComparisonSettings settings{a.features, a.tolerance_px};
  const std::string text =
      context.json ? text_of(comparison_to_json(settings, views)) + "\n" : comparison_to_text(settings, views);
  if (Status s = print(text); !s) return failure(s);
  return kDone;
}

void add_compare(CLI::App& features, Context& context) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* command = add_command(
      features, context, "compare", "Compare landmark detectors: repeatability, matching precision and time",
      "features compare left.png right.png --rectified -o figures", [&context, a] { return compare(context, *a); });
  command->add_option("first", a->first, "First image.")->required()->option_text("A REQUIRED");
  command
      ->add_option("second", a->second,
                   "Second image. Without it, it is made from A: by --rotate-deg and --scale, else four times, rotated "
                   "by 10 and 45 degrees and scaled by 0.7 and 1.5.")
      ->option_text("B");
  auto* homography = command->add_option(
      "--homography", a->homography,
      "File with the 3x3 homography from A to B, nine numbers row by row (default: none). Without it and "
      "--rectified the epipolar geometry is estimated from the matches of all detectors.");
  command
      ->add_flag("--rectified", a->rectified,
                 "A and B are a rectified stereo pair: corresponding points lie in the same row.")
      ->excludes(homography);
  command
      ->add_option("--rotate-deg", a->rotate_deg,
                   "Make B from A by this rotation in degrees, clockwise about the centre (default 0).")
      ->check(CLI::Range(-360.0, 360.0));
  command->add_option("--scale", a->scale, "Make B from A by this factor of its size (default 1).")
      ->check(CLI::Range(0.05, 20.0));
  command->add_option("-o,--output", a->output,
                      "Folder for a PNG of each detector, with features and matches (default: none is drawn).");
  std::vector<std::string> names;
  names.reserve(kDetectors.size());
  for (const NamedDetector& detector : kDetectors) names.emplace_back(detector.name);
  command
      ->add_option("--detectors", a->detectors,
                   "Detectors to compare, separated by commas: surf (as the options say, by default upright), "
                   "surf_oriented, surf_refined (oriented and refined), harris, orb, sift, akaze (default: all).")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(names))
      ->option_text("NAME,...");
  command
      ->add_option("--features", a->features,
                   "Maximum number of features of an image, spread evenly (default 500). The same for all detectors.")
      ->check(CLI::Range(20, 10000));
  command
      ->add_option("--tolerance-px", a->tolerance_px,
                   "Largest distance in pixels, in either image, of features that correspond (default 2).")
      ->check(positive_number());
  command
      ->add_option("--repetitions", a->repetitions, "Runs of a detector of which the time is the median (default 5).")
      ->check(CLI::Range(1, 1000));
  command->add_option("--config", a->config,
                      "YAML file with options as for `spartan run`; `odometry.detection` applies (default: none).");
  command
      ->add_option("--set", a->set,
                   "Set one option, e.g. odometry.detection.spacing_px=8. Repeatable; overrides --config.")
      ->allow_extra_args(false)
      ->option_text("KEY=VALUE");
  add_force_flag(*command, context);
  add_threads_option(*command, context);
  add_memory_option(*command, context);
  add_json_flag(*command, context);
}

}  // namespace

void add_features(CLI::App& app, Context& context) {
  CLI::App* features = app.add_subcommand("features", "Compare landmark detectors");
  features->require_subcommand(1);
  add_compare(*features, context);
}

}  // namespace spartan::program
