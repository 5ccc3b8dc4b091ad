#include "program/rig_inspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "program/inspected_pair.h"
#include "program/inspection_images.h"
#include "program/json.h"
#include "program/progress.h"
#include "program/recording_arguments.h"
#include "program/rig_convert.h"
#include "program/rig_inspect_apply.h"
#include "spartan/calibration/pair_check.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/pose.h"
#include "spartan/image_io/image_io.h"
#include "spartan/report/report.h"
#include "spartan/rig/describe.h"

namespace spartan::program {
namespace {

struct InspectArguments {
  std::string rig, left, right, recording, pair, apply, figure;
  RecordingArguments of_recording;
  int frames = 12;
  bool check = false;
};

Result<InspectedPair> check_with_images(const Rig& rig, const StereoPair& pair, std::vector<ImagePair> images,
                                        bool guessed, const ThreadPool& workers, bool quiet) {
  const int count = static_cast<int>(images.size());
  std::vector<StereoViews> frames;
  frames.reserve(images.size());
  for (const ImagePair& image : images) frames.push_back({image.left.view(), image.right.view()});
  Progress progress(quiet || count == 1);
  const auto show = [&](std::size_t matched) {
    const char* next = static_cast<int>(matched) == count ? " matched, checking the calibration" : "";
    progress.show(static_cast<int>(matched), count, fmt::format("frames of pair {}{}", pair.name, next));
  };
  show(0);
  auto inspection = guessed ? inspect_images(frames, workers, show) : inspect_pair(rig, pair, frames, workers, show);
  if (!inspection) return failure(inspection);
  // The figure shows the frame with the most matches.
  const auto best = std::max_element(inspection->matches.begin(), inspection->matches.end(),
                                     [](const auto& a, const auto& b) { return a.size() < b.size(); });
  ImagePair& shown = images[static_cast<std::size_t>(best - inspection->matches.begin())];
  return InspectedPair{pair,
                       std::move(inspection->check),
                       std::move(shown.name),
                       std::move(shown.left),
                       std::move(shown.right),
                       std::move(*best)};
}

Json rows_json(const RowErrors& rows) {
  return {{"mean", number(rows.mean_px)}, {"p95", number(rows.p95_px)}, {"median", number(rows.median_px)}};
}

Json corrections_json(const PairCorrection& c, double focal_ratio) {
  return {{"pitch_deg", number(c.pitch_rad * kDegreesPerRadian)},
          {"roll_deg", number(c.roll_rad * kDegreesPerRadian)},
          {"yaw_deg", number(c.yaw_rad * kDegreesPerRadian)},
          {"focal_ratio", number(focal_ratio)}};
}

Json findings_json(const std::vector<RigFinding>& findings) {
  Json list = Json::array();
  for (const RigFinding& f : findings) list.push_back({{"id", f.id}, {"text", f.text}, {"value", number(f.value)}});
  return list;
}

// Without a calibration, figures that the images do not tell are null.
Json inspection_to_json(const LoadedRig& read, const std::vector<InspectedPair>& inspected, bool guessed) {
  const Rig& rig = read.rig;
  Json pairs = Json::object();
  for (const StereoPair& pair : rig.pairs) {
    const PairSummary summary = summarize_pair(rig, pair);
    const auto known = [&](double value) { return guessed ? Json(nullptr) : number(value); };
    pairs[pair.name] = {{"baseline_m", known(summary.baseline_m)},
                        {"focal_px", known(summary.focal_px)},
                        {"hfov_deg", known(summary.hfov_deg)},
                        {"vfov_deg", known(summary.vfov_deg)},
                        {"findings", findings_json(plausibility_findings(rig, pair))}};
  }
  for (const InspectedPair& one : inspected) {
    const PairCheck& check = one.check;
    Json& pair = pairs[one.pair.name];
    pair["findings"] = findings_json(check.findings);
    pair["verdict"] = name_of(check.grade);
    pair["matches"] = check.matches;
    pair["inliers"] = check.inliers;
    pair["row_error_px"] = {{"before", rows_json(check.unrectified_rows)},
                            {"after", rows_json(check.nominal_rows)},
                            {"corrected", rows_json(check.corrected_rows)}};
    pair["corrections"] = corrections_json(check.correction, check.correction.focal_ratio);
    pair["corrections"]["sigma"] = corrections_json(check.sigma, check.sigma.focal_ratio);
    pair["yaw_sigma_px"] = number(check.yaw_sigma_px);
    Json map = Json::array();
    for (const RowErrorCell& cell : check.map) {
      map.push_back({{"x_px", number(cell.centre_px.x())},
                     {"y_px", number(cell.centre_px.y())},
                     {"matches", cell.matches},
                     {"median_px", number(cell.median_px)}});
    }
    pair["row_error_map"] = std::move(map);
  }
  Json ignored = Json::array();
  for (const RigDifference& d : read.ignored) ignored.push_back({{"key", d.key}, {"text", d.text}});
  return {{"schema", 1},
          {"body", read.body.empty() ? Json(nullptr) : Json(read.body)},
          {"notes", read.notes},
          {"ignored", std::move(ignored)},
          {"pairs", std::move(pairs)}};
}

// Rounded to the printed digits, which avoids "-0.00".
double hundredths(double value) {
  return std::round(100 * value) / 100 + 0.0;
}

std::string rotation_text(double radians, double sigma, const char* above, const char* below) {
  return fmt::format("{:.3f}° ± {:.3f}° {}", std::abs(radians) * kDegreesPerRadian, sigma * kDegreesPerRadian,
                     radians > 0 ? above : below);
}

std::string inspection_to_text(const InspectedPair& one, bool guessed) {
  const PairCheck& check = one.check;
  const std::string pair = fmt::format("pair {}: ", one.pair.name);
  std::string text = fmt::format("{}{} matches, {} inliers\n", pair, check.matches, check.inliers);
  std::vector<std::string> rows;
  const auto add_rows = [&](const char* what, const RowErrors& e) {
    if (std::isfinite(e.mean_px))
      rows.push_back(fmt::format("{} {:.2f} px (95 % below {:.2f} px)", what, e.mean_px, e.p95_px));
  };
  add_rows("unrectified", check.unrectified_rows);
  if (!guessed) add_rows("rectified with the given calibration", check.nominal_rows);
  add_rows("corrected", check.corrected_rows);
  if (!rows.empty()) text += fmt::format("{}mean row error {}\n", pair, fmt::join(rows, ", "));
  const PairCorrection &c = check.correction, &s = check.sigma;
  if (std::isfinite(c.pitch_rad)) {
    text += fmt::format(
        "{}estimated correction of the right camera: rotation {}, {}, {}; focal length {:+.2f} % ± {:.2f} %\n", pair,
        rotation_text(c.pitch_rad, s.pitch_rad, "up", "down"),
        rotation_text(c.yaw_rad, s.yaw_rad, "to the right", "to the left"),
        rotation_text(c.roll_rad, s.roll_rad, "clockwise", "counter-clockwise"), hundredths(100 * (c.focal_ratio - 1)),
        100 * s.focal_ratio);
    text += fmt::format(
        "{}yaw is weakly observable from row errors (correlated with distortion): its standard deviation is {:.1f} px "
        "of "
        "disparity, so long ranges are not verified\n",
        pair, check.yaw_sigma_px);
  }
  for (const RigFinding& f : check.findings) text += fmt::format("{}finding {}: {}\n", pair, f.id, f.text);
  if (!one.checked()) return text + pair + "calibration: not verified by these images, see the findings\n";
  return text + fmt::format("{}{}: {}\n", pair, guessed ? "as rectified images" : "calibration", name_of(check.grade));
}

// Checks the requested pairs, with images of the recording, or with the given images of one pair.
Result<std::vector<InspectedPair>> check_requested_pairs(const InspectArguments& a, const Rig& rig,
                                                         std::vector<ImagePair> given, const ThreadPool& workers,
                                                         bool quiet) {
  std::vector<InspectedPair> inspected;
  const auto wanted = [&](const StereoPair& pair) { return a.pair.empty() || pair.name == a.pair; };
  if (!a.pair.empty() && !rig.find_pair(a.pair)) {
    return failure(ErrorCode::usage, fmt::format("the rig has no pair '{}'", a.pair), "--pair");
  }
  if (!a.recording.empty()) {
    auto open = open_options(a.of_recording);
    if (!open) return failure(open);
    open->rig_file = a.rig;  // a recording without a calibration will do
    auto source = open_recording(a.recording, *open);
    if (!source) return failure(source);
    for (const StereoPair& pair : rig.pairs) {
      if (!wanted(pair) || !(*source)->info().rig.find_pair(pair.name)) continue;
      auto images = load_frames(**source, pair.name, a.frames, workers);
      if (!images) return failure(images);
      auto checked = check_with_images(rig, pair, std::move(*images), a.rig == "-", workers, quiet);
      if (!checked) return failure(checked);
      inspected.push_back(std::move(*checked));
    }
    if (inspected.empty()) return failure(ErrorCode::input, "has no pair of this rig", a.recording);
    return inspected;
  }
  const auto pair = std::find_if(rig.pairs.begin(), rig.pairs.end(), wanted);
  const Camera &left = *rig.find_camera(pair->left), &right = *rig.find_camera(pair->right);
  if (left.pixel_format != PixelFormat() || right.pixel_format != PixelFormat()) {
    auto decoded = load_images_of(left, right, a.left, a.right, a.frames, workers);
    if (!decoded) return failure(decoded);
    given = std::move(*decoded);
  }
  auto checked = check_with_images(rig, *pair, std::move(given), a.rig == "-", workers, quiet);
  if (!checked) return failure(checked);
  inspected.push_back(std::move(*checked));
  return inspected;
}

// Formats that do not hold the image size, and a missing calibration, take it from the images.
Result<LoadedRig> read_or_guess(const std::string& rig, ImageSize size) {
  if (rig != "-") return read_calibration(rig, size);
  LoadedRig guess;
  guess.rig = guessed_rig(size);
  return guess;
}

Status check_usage(const InspectArguments& a) {
  const bool files = !a.left.empty(), recording = !a.recording.empty();
  if (files && a.right.empty())
    return failure(ErrorCode::usage, "RIGHT is missing: give a left and a right image", "rig inspect");
  if (files && recording) return failure(ErrorCode::usage, "give LEFT and RIGHT, or --recording", "rig inspect");
  if (!files && a.rig == "-") {
    return failure(ErrorCode::usage, "without a calibration (-) give LEFT and RIGHT", "rig inspect");
  }
  if (!files && !recording && (!a.apply.empty() || !a.figure.empty() || a.check)) {
    return failure(ErrorCode::usage, "--apply, --figure and --check need images", "rig inspect");
  }
  if (!a.figure.empty() && std::filesystem::path(a.figure).extension() != ".png") {
    return failure(ErrorCode::usage, "the figure is a PNG: give it a name that ends in .png", "--figure");
  }
  return {};
}

Status write_figure(const std::string& path, const Rig& rig, const InspectedPair& one, const ThreadPool& workers) {
  const auto figure = draw_pair_check(rig, one.pair, one.check, std::as_const(one.left).view(),
                                      std::as_const(one.right).view(), one.matches, workers);
  if (!figure) return failure(figure);
  return write_png(path, std::as_const(*figure).view());
}

std::string inspection_to_text(const InspectArguments& a, const LoadedRig& read,
                               const std::vector<InspectedPair>& inspected) {
  const bool guessed = a.rig == "-";
  std::string text;
  if (guessed) {
    text = fmt::format(
        "no calibration: two pinhole cameras side by side are assumed, with a focal length of {:.0f} px; the length "
        "of the baseline is unknown\n",
        summarize_pair(read.rig, read.rig.pairs.front()).focal_px);
  } else {
    for (const std::string& sentence : describe_rig(read.rig)) text += sentence + "\n";
    for (const StereoPair& pair : read.rig.pairs) {
      const bool checked = std::any_of(inspected.begin(), inspected.end(),
                                       [&](const InspectedPair& one) { return one.pair.name == pair.name; });
      if (checked) continue;  // the images tell more
      for (const std::string& finding : describe_plausibility(read.rig, pair)) text += finding + "\n";
    }
    for (const std::string& note : read.notes) text += note + "\n";
    for (const RigDifference& d : read.ignored) text += fmt::format("not used: {}: {}\n", d.key, d.text);
  }
  for (const InspectedPair& one : inspected) text += inspection_to_text(one, guessed);
  const bool correctable = std::any_of(inspected.begin(), inspected.end(), [&](const InspectedPair& one) {
    return one.checked() && one.check.corrected && *one.check.corrected != read.rig;
  });
  if (correctable && !guessed && a.apply.empty()) text += "use --apply FILE to write the corrected rig\n";
  return text;
}

Result<ExitCode> verdict(const InspectArguments& a, const std::vector<InspectedPair>& inspected) {
  const bool bad = std::any_of(inspected.begin(), inspected.end(),
                               [](const InspectedPair& one) { return one.check.grade == PairGrade::bad; });
  return a.check && bad ? kBadCalibration : kDone;
}

Result<ExitCode> inspect(const Context& context, const InspectArguments& a) {
  if (Status usage = check_usage(a); !usage) return failure(usage);
  if (Status there = a.rig == "-" ? Status() : calibration_is_there(a.rig); !there) return failure(there);
  for (const std::string& output : {a.figure, a.apply}) {
    if (Status s = expect_new_file(context, output); !s) return failure(s);
  }
  std::vector<ImagePair> images;
  if (!a.left.empty()) {
    auto loaded = load_images(a.left, a.right, a.frames);
    if (!loaded) return failure(loaded);
    images = std::move(*loaded);
  }
  const ImageSize size = images.empty() ? ImageSize() : images.front().left.size();
  const auto read = read_or_guess(a.rig, size);
  if (!read) return failure(read);
  const ThreadPool workers(context.threads);
  std::vector<InspectedPair> inspected;
  if (!a.left.empty() || !a.recording.empty()) {
    auto result = check_requested_pairs(a, read->rig, std::move(images), workers, context.quiet);
    if (!result) return failure(result);
    inspected = std::move(*result);
  }
  const std::string text = context.json ? text_of(inspection_to_json(*read, inspected, a.rig == "-")) + "\n"
                                        : inspection_to_text(a, *read, inspected);
  if (Status printed = print(text); !printed) return failure(printed);
  if (!a.figure.empty()) {
    if (Status drawn = write_figure(a.figure, read->rig, inspected.front(), workers); !drawn) return failure(drawn);
  }
  if (a.apply.empty()) return verdict(a, inspected);
  const auto sentences = write_corrected_rig(*read, inspected, a.apply);
  if (!sentences) return failure(sentences);
  if (context.json) {
    // The findings in the JSON tell the first; the rest are warnings.
    for (std::size_t i = 1; i < sentences->size(); ++i) context.log.warning((*sentences)[i]);
    return verdict(a, inspected);
  }
  if (Status printed = print(fmt::format("{}\n", fmt::join(*sentences, "\n"))); !printed) return failure(printed);
  return verdict(a, inspected);
}

}  // namespace

void add_rig_inspect(CLI::App& rig, Context& context) {
  const auto a = std::make_shared<InspectArguments>();
  CLI::App* command =
      add_command(rig, context, "inspect", "Print a calibration, and check and correct it with images of its pairs",
                  "rig inspect rig.yaml left.png right.png --figure rows.png --apply corrected.yaml",
                  [&context, a] { return inspect(context, *a); });
  command
      ->add_option("rig", a->rig,
                   "Calibration in any supported format (docs/reference/calibration_files.md), or - for none.")
      ->required()
      ->option_text("RIG REQUIRED");
  command->add_option("left", a->left, "Left image, a folder of images, or a quoted pattern (\"left*.jpg\").")
      ->option_text("LEFT");
  command
      ->add_option("right", a->right,
                   "Right image, folder or pattern; paired with the left ones in the order of their names.")
      ->option_text("RIGHT");
  command->add_option(
      "--recording", a->recording,
      "Take the images from this recording, for every pair of the rig (default: none, LEFT and RIGHT).");
  add_recording_options(*command, a->of_recording);
  command->add_option("--pair", a->pair,
                      "Check only this pair of the rig (default with LEFT and RIGHT: the first one).");
  command
      ->add_option("--frames", a->frames,
                   "Maximum number of frames of a pair, spread evenly over all (default 12). More frames "
                   "give a more certain correction and take longer.")
      ->check(CLI::Range(1, 1000));
  command->add_option(
      "--apply", a->apply,
      "Write the corrected rig to this rig.yaml (default: none is written). Only parameters that are reported "
      "as wrong are changed.");
  command->add_flag("--check", a->check,
                    "Return exit code 7 where the calibration of a pair is bad, or the images do not suffice.");
  command->add_option("--figure", a->figure,
                      "Write a PNG that shows the row errors of the first pair, before and after (default: none).");
  add_former_name(*command, context, "--shots", "--frames", a->frames)->check(CLI::Range(1, 1000));
  add_former_name(*command, context, "--picture", "--figure", a->figure);
  add_force_flag(*command, context);
  add_threads_option(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
