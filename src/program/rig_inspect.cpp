#include "program/rig_inspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>

#include "program/inspected_pair.h"
#include "program/json.h"
#include "program/progress.h"
#include "program/rig_convert.h"
#include "program/rig_inspect_apply.h"
#include "program/rig_inspect_picture.h"
#include "program/rig_pictures.h"
#include "spartan/core/image_io.h"
#include "spartan/odometry/view_matching.h"
#include "spartan/rig/describe.h"
#include "spartan/rig/formats/rig_files.h"
#include "spartan/rig/inspection/pair_check.h"

namespace spartan::program {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

struct InspectArguments {
  std::string rig, left, right, recording, pair, apply, picture;
  int shots = 12;
};

InspectedPair inspect_pair(const Rig& rig, const StereoPair& pair, std::vector<PicturePair> pictures, bool guessed,
                           const Workers& workers, bool quiet) {
  std::vector<PixelMatch> all;
  InspectedPair result;
  result.pair = pair;
  const int shots = static_cast<int>(pictures.size());
  Progress progress(quiet || shots == 1);
  for (int shot = 0; shot < shots; ++shot) {
    progress.show(shot, shots, fmt::format("shots of pair {}", pair.name));
    PicturePair& picture = pictures[static_cast<std::size_t>(shot)];
    std::vector<PixelMatch> matches;
    for (const ViewMatch& match : match_views(std::as_const(picture.left).view(), std::as_const(picture.right).view(),
                                              ViewMatchingOptions(), workers)) {
      matches.push_back({match.left, match.right});
    }
    all.insert(all.end(), matches.begin(), matches.end());
    // The shot that shows most is drawn.
    if (result.shot.empty() || matches.size() > result.matches.size()) {
      result.shot = picture.name;
      result.left = std::move(picture.left);
      result.right = std::move(picture.right);
      result.matches = std::move(matches);
    }
  }
  progress.show(shots, shots, fmt::format("shots of pair {} matched: judging", pair.name));
  result.check = guessed ? check_pictures(all, result.left.size()) : check_pair(rig, pair, all, result.left.size());
  return result;
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

// Of a guess (no calibration) nothing is said that the pictures did not.
Json to_json(const ReadRig& read, const std::vector<InspectedPair>& inspected, bool guessed) {
  const Rig& rig = read.rig;
  Json pairs = Json::object();
  for (const StereoPair& pair : rig.pairs) {
    const PairSummary summary = summarize_pair(rig, pair);
    const auto known = [&](double value) { return guessed ? Json(nullptr) : number(value); };
    pairs[pair.name] = {{"baseline_m", known(summary.baseline_m)},
                        {"focal_px", known(summary.focal_px)},
                        {"hfov_deg", known(summary.hfov_deg)},
                        {"vfov_deg", known(summary.vfov_deg)},
                        {"findings", findings_json(find_doubts(rig, pair))}};
  }
  for (const InspectedPair& one : inspected) {
    const PairCheck& check = one.check;
    Json& pair = pairs[one.pair.name];
    pair["findings"] = findings_json(check.findings);
    pair["verdict"] = name_of(check.verdict);
    pair["matches"] = check.matches;
    pair["inliers"] = check.inliers;
    pair["row_error_px"] = {{"before", rows_json(check.as_taken)},
                            {"after", rows_json(check.as_given)},
                            {"corrected", rows_json(check.as_corrected)}};
    pair["corrections"] = corrections_json(check.correction, check.correction.focal_ratio);
    pair["corrections"]["sigma"] = corrections_json(check.sigma, check.sigma.focal_ratio);
    pair["yaw_doubt_px"] = number(check.yaw_doubt_px);
    Json map = Json::array();
    for (const RowErrorCell& cell : check.map) {
      map.push_back({{"x_px", number(cell.centre_px.x())},
                     {"y_px", number(cell.centre_px.y())},
                     {"matches", cell.matches},
                     {"median_px", number(cell.median_px)}});
    }
    pair["row_error_map"] = std::move(map);
  }
  Json left_out = Json::array();
  for (const RigDifference& d : read.left_out) left_out.push_back({{"key", d.key}, {"text", d.text}});
  return {{"schema", 1},
          {"body", read.body.empty() ? Json(nullptr) : Json(read.body)},
          {"notes", read.notes},
          {"left_out", std::move(left_out)},
          {"pairs", std::move(pairs)}};
}

// Rounded to what is printed, so that there is no "-0.00".
double hundredths(double value) {
  return std::round(100 * value) / 100 + 0.0;
}

std::string turned(double radians, double sigma, const char* above, const char* below) {
  return fmt::format("{:.3f}° ± {:.3f}° {}", std::abs(radians) * kDegreesPerRadian, sigma * kDegreesPerRadian,
                     radians > 0 ? above : below);
}

std::string in_words(const InspectedPair& one, bool guessed) {
  const PairCheck& check = one.check;
  const std::string pair = fmt::format("pair {}: ", one.pair.name);
  std::string text = fmt::format("{}{} matches, {} of them agree\n", pair, check.matches, check.inliers);
  std::vector<std::string> rows;
  const auto add_rows = [&](const char* what, const RowErrors& e) {
    if (std::isfinite(e.mean_px))
      rows.push_back(fmt::format("{} {:.2f} px, 95 % below {:.2f} px", what, e.mean_px, e.p95_px));
  };
  add_rows("as taken by", check.as_taken);
  if (!guessed) add_rows("rectified as given by", check.as_given);
  add_rows("corrected by", check.as_corrected);
  if (!rows.empty()) text += fmt::format("{}rows differ {}\n", pair, fmt::join(rows, "; "));
  const PairCorrection &c = check.correction, &s = check.sigma;
  if (std::isfinite(c.pitch_rad)) {
    text += fmt::format("{}the pictures want the right eye turned {}, {}, {}; its focal length {:+.2f} % ± {:.2f} %\n",
                        pair, turned(c.pitch_rad, s.pitch_rad, "up", "down"),
                        turned(c.yaw_rad, s.yaw_rad, "to the right", "to the left"),
                        turned(c.roll_rad, s.roll_rad, "clockwise", "counter-clockwise"),
                        hundredths(100 * (c.focal_ratio - 1)), 100 * s.focal_ratio);
    text += fmt::format(
        "{}rows cannot tell a yaw from a lens to better than that ±: it is worth ±{:.1f} px of disparity, so they say "
        "little of far ranges\n",
        pair, check.yaw_doubt_px);
  }
  for (const RigFinding& f : check.findings) text += fmt::format("{}FOUND {}: {}\n", pair, f.id, f.text);
  return text + fmt::format("{}verdict: {}\n", pair, name_of(check.verdict));
}

// The pairs that are asked for, with the recording's pictures or else those given, which are of one pair.
Result<std::vector<InspectedPair>> inspect_pictures(const InspectArguments& a, const Rig& rig,
                                                    std::vector<PicturePair> given, const Workers& workers,
                                                    bool quiet) {
  std::vector<InspectedPair> inspected;
  const auto wanted = [&](const StereoPair& pair) { return a.pair.empty() || pair.name == a.pair; };
  if (!a.pair.empty() && !rig.find_pair(a.pair)) {
    return failure(ErrorCode::usage, fmt::format("the rig has no pair '{}'", a.pair), "--pair");
  }
  if (!a.recording.empty()) {
    auto source = open_recording(a.recording);
    if (!source) return failure(source);
    for (const StereoPair& pair : rig.pairs) {
      if (!wanted(pair) || !(*source)->info().rig.find_pair(pair.name)) continue;
      auto pictures = load_shots(**source, pair.name, a.shots, workers);
      if (!pictures) return failure(pictures);
      inspected.push_back(inspect_pair(rig, pair, std::move(*pictures), a.rig == "-", workers, quiet));
    }
    if (inspected.empty()) return failure(ErrorCode::input, "has none of the rig's pairs", a.recording);
    return inspected;
  }
  const auto pair = std::find_if(rig.pairs.begin(), rig.pairs.end(), wanted);
  const Camera &left = *rig.find_camera(pair->left), &right = *rig.find_camera(pair->right);
  if (left.pixel_format != PixelFormat() || right.pixel_format != PixelFormat()) {
    auto meant = load_pictures_of(left, right, a.left, a.right, a.shots, workers);
    if (!meant) return failure(meant);
    given = std::move(*meant);
  }
  inspected.push_back(inspect_pair(rig, *pair, std::move(given), a.rig == "-", workers, quiet));
  return inspected;
}

// The size of the pictures is what formats that leave it out, and a guess, have to go by.
Result<ReadRig> read_or_guess(const std::string& rig, ImageSize size) {
  if (rig != "-") return read_calibration(rig, size);
  ReadRig guess;
  guess.rig = guessed_rig(size);
  return guess;
}

Status check_usage(const InspectArguments& a) {
  const bool files = !a.left.empty(), recording = !a.recording.empty();
  if (files && a.right.empty())
    return failure(ErrorCode::usage, "RIGHT is missing: pictures come in pairs", "rig inspect");
  if (files && recording) return failure(ErrorCode::usage, "give LEFT and RIGHT, or --recording", "rig inspect");
  if (!files && a.rig == "-") {
    return failure(ErrorCode::usage, "without a calibration (-) give LEFT and RIGHT", "rig inspect");
  }
  if (!files && !recording && (!a.apply.empty() || !a.picture.empty())) {
    return failure(ErrorCode::usage, "--apply and --picture need pictures", "rig inspect");
  }
  if (!a.picture.empty() && std::filesystem::path(a.picture).extension() != ".png") {
    return failure(ErrorCode::usage, "the picture is a PNG: give it a name that ends in .png", "--picture");
  }
  return {};
}

Status write_picture(const std::string& path, const Rig& rig, const InspectedPair& one, const Workers& workers) {
  const auto picture = draw_pair_check(rig, one.pair, one.check, std::as_const(one.left).view(),
                                       std::as_const(one.right).view(), one.matches, workers);
  if (!picture) return failure(picture);
  return write_png(path, std::as_const(*picture).view());
}

std::string in_words(const InspectArguments& a, const ReadRig& read, const std::vector<InspectedPair>& inspected) {
  const bool guessed = a.rig == "-";
  std::string text;
  if (guessed) {
    text = fmt::format(
        "no calibration: two pinholes side by side are guessed, of {:.0f} px focal length; the length of the "
        "baseline is not known\n",
        summarize_pair(read.rig, read.rig.pairs.front()).focal_px);
  } else {
    for (const std::string& sentence : describe_rig(read.rig)) text += sentence + "\n";
    for (const StereoPair& pair : read.rig.pairs) {
      const bool judged = std::any_of(inspected.begin(), inspected.end(),
                                      [&](const InspectedPair& one) { return one.pair.name == pair.name; });
      if (judged) continue;  // the pictures say more
      for (const std::string& doubt : describe_doubts(read.rig, pair)) text += doubt + "\n";
    }
    for (const std::string& note : read.notes) text += note + "\n";
    for (const RigDifference& d : read.left_out) text += fmt::format("not used: {}: {}\n", d.key, d.text);
  }
  for (const InspectedPair& one : inspected) text += in_words(one, guessed);
  const bool mendable = std::any_of(inspected.begin(), inspected.end(), [&](const InspectedPair& one) {
    return one.judged() && one.check.corrected && *one.check.corrected != read.rig;
  });
  if (mendable && !guessed && a.apply.empty()) text += "--apply FILE writes the rig with that put right\n";
  return text;
}

Result<ExitCode> inspect(const Context& context, const InspectArguments& a) {
  if (Status usage = check_usage(a); !usage) return failure(usage);
  if (Status there = a.rig == "-" ? Status() : calibration_is_there(a.rig); !there) return failure(there);
  std::vector<PicturePair> pictures;
  if (!a.left.empty()) {
    auto loaded = load_pictures(a.left, a.right, a.shots);
    if (!loaded) return failure(loaded);
    pictures = std::move(*loaded);
  }
  const ImageSize size = pictures.empty() ? ImageSize() : pictures.front().left.size();
  const auto read = read_or_guess(a.rig, size);
  if (!read) return failure(read);
  const Workers workers(context.threads);
  std::vector<InspectedPair> inspected;
  if (!a.left.empty() || !a.recording.empty()) {
    auto result = inspect_pictures(a, read->rig, std::move(pictures), workers, context.quiet);
    if (!result) return failure(result);
    inspected = std::move(*result);
  }
  const std::string text =
      context.json ? to_json(*read, inspected, a.rig == "-").dump(2) + "\n" : in_words(a, *read, inspected);
  if (Status printed = print(text); !printed) return failure(printed);
  if (!a.picture.empty()) {
    if (Status drawn = write_picture(a.picture, read->rig, inspected.front(), workers); !drawn) return failure(drawn);
  }
  if (a.apply.empty()) return kDone;
  const auto sentences = write_corrected_rig(*read, inspected, a.apply);
  if (!sentences) return failure(sentences);
  if (context.json) {
    // The findings tell the first; the rest is to be known.
    for (std::size_t i = 1; i < sentences->size(); ++i) context.log.warning((*sentences)[i]);
    return kDone;
  }
  if (Status printed = print(fmt::format("{}\n", fmt::join(*sentences, "\n"))); !printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_rig_inspect(CLI::App& rig, Context& context) {
  const auto a = std::make_shared<InspectArguments>();
  CLI::App* verb =
      add_verb(rig, context, "inspect", "A calibration in words, and what pictures of the pair say about it",
               "rig inspect rig.yaml left.png right.png --picture rows.png --apply corrected.yaml",
               [&context, a] { return inspect(context, *a); });
  verb->add_option("rig", a->rig, "any calibration that is read (docs/formats.md), or - for none: the pictures alone")
      ->required()
      ->option_text("RIG");
  verb->add_option("left", a->left, "left picture, a folder of them, or a quoted pattern (\"left*.jpg\")")
      ->option_text("LEFT");
  verb->add_option("right", a->right, "the right ones")->option_text("RIGHT");
  verb->add_option("--recording", a->recording, "take the pictures from a recording, for every pair of the rig");
  verb->add_option("--pair", a->pair, "only this pair of the rig (with LEFT and RIGHT: the first one)");
  verb->add_option("--shots", a->shots, "at most so many shots of a pair, spread over all of them (default 12)")
      ->check(CLI::Range(1, 1000));
  verb->add_option("--apply", a->apply,
                   "write the rig with what was found put right and no more than is needed, as rig.yaml");
  verb->add_option("--picture", a->picture, "draw the rows of the first pair, PNG");
  add_threads_option(*verb, context);
  add_json_flag(*verb, context);
}

}  // namespace spartan::program
