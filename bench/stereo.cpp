// Compares stereo matching with OpenCV on real pairs with ground truth, in the light they were taken in and in others,
// and in time on a rendered pair. `make bench-stereo`.
//
//   stereo [--repeat N] [--set key=value]... [--images DIR] [--from FOLDER] [--no-rivals | --times]
//   stereo --first-call MATCHER DISPARITIES [--from FOLDER]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "spartan/eval/disparity_metrics.h"
#include "spartan/numerics/simd_target.h"
#include "standard_recordings.h"
#include "stereo_first_calls.h"
#include "stereo_speed.h"
#include "stereo_variants.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

// Percentages of pixels, and px.
struct Scores {
  double bad_05 = 0, bad_1 = 0, bad_2 = 0, matched_bad_1 = 0, matched_bad_2 = 0, density = 0, nonocc_bad_1 = 0, rms = 0;
  static constexpr int kCount = 8;
  std::array<double*, kCount> values() {
    return {&bad_05, &bad_1, &bad_2, &matched_bad_1, &matched_bad_2, &density, &nonocc_bad_1, &rms};
  }
};

Scores score(const Pair& pair, ImageView<const float> disparity) {
  const auto metrics = must(compare_disparities(disparity, pair.truth, pair.mask));
  const auto& all = metrics.all;
  return {all.bad_0_5.value_or(0),
          all.bad_1.value_or(0),
          all.bad_2.value_or(0),
          all.matched_bad_1.value_or(0),
          all.matched_bad_2.value_or(0),
          all.density_percent.value_or(0),
          metrics.nonocc ? metrics.nonocc->bad_1.value_or(0) : 0,
          all.rms_in_1px.value_or(0)};
}

void print_line(const std::string& pair, const std::string& method, const Scores& s) {
  fmt::print("{:<18} {:<17} {:7.2f} {:7.2f} {:7.2f} {:8.2f} {:8.2f} {:8.2f} {:9.2f} {:7.3f}\n", pair, method, s.bad_05,
             s.bad_1, s.bad_2, s.matched_bad_1, s.matched_bad_2, s.density, s.nonocc_bad_1, s.rms);
}

// Green: below 1 px, orange: over 1 px, red: over 2 px, blue: no match, black: no ground truth.
cv::Vec3b error_colour(float disparity, float truth) {
  if (!std::isfinite(truth)) return {0, 0, 0};
  if (!std::isfinite(disparity)) return {120, 60, 0};
  const float error = std::abs(disparity - truth);
  if (error > 2) return {0, 0, 255};
  return error > 1 ? cv::Vec3b(0, 160, 255) : cv::Vec3b(60, 120, 60);
}

void write_images(const std::string& folder, const Pair& pair, ImageView<const float> disparity) {
  cv::Mat image(pair.left.height() * 2, pair.left.width() * 2, CV_8UC3, cv::Scalar(0, 0, 0));
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const auto level = [&](float d) {
        return std::isfinite(d) ? cv::saturate_cast<std::uint8_t>(d * 255.0F / static_cast<float>(pair.disparities))
                                : std::uint8_t{0};
      };
      const float d = disparity(x, y), t = pair.truth(x, y);
      const std::uint8_t gray = pair.left(x, y), estimated = level(d), true_level = level(t);
      image.at<cv::Vec3b>(y, x) = {gray, gray, gray};
      image.at<cv::Vec3b>(y, x + disparity.width()) = {true_level, true_level, true_level};
      image.at<cv::Vec3b>(y + disparity.height(), x) = {estimated, estimated, estimated};
      const cv::Vec3b colour = error_colour(d, t);
      image.at<cv::Vec3b>(y + disparity.height(), x + disparity.width()) = colour;
    }
  }
  cv::imwrite(folder + "/" + pair.name + ".png", image);
}

struct Arguments {
  int repeat = 9;
  bool rivals = true, accuracy = true;
  std::string images, recordings;
  DisparityOptions options;
};

Arguments parse(const std::vector<std::string>& words) {
  Arguments arguments;
  const char* const home = std::getenv("HOME");
  arguments.recordings = std::string(home != nullptr ? home : "") + "/.cache/spartan/recordings";
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--no-rivals") arguments.rivals = false;
    if (word == "--times") arguments.accuracy = false;
    if (i + 1 >= words.size()) continue;
    const std::string& value = words[i + 1];
    if (word == "--repeat") arguments.repeat = std::max(1, std::atoi(value.c_str()));
    if (word == "--images") arguments.images = value;
    if (word == "--from") arguments.recordings = value;
    if (word == "--set") arguments.options = must(set_option(arguments.options, value));
  }
  return arguments;
}

struct Method {
  std::string name;
  std::function<Image<float>(const Pair&)> disparity;
};

// Spartan first, and MODE_HH, of which the ratios are, second and third.
std::vector<Method> methods(const Arguments& arguments) {
  const auto spartan = [](const DisparityOptions& options) {
    return [options](const Pair& pair) {
      auto computer = must(DisparityComputer::create(options, ThreadPool(1)));
      return Image<float>::copy_of(must(computer.compute(pair.left, pair.right, {0, pair.disparities - 1})).disparity);
    };
  };
  const auto opencv = [](const OpenCvMatcher& rival) {
    return [rival](const Pair& pair) { return opencv_disparity(pair.left, pair.right, pair.disparities, rival); };
  };
  DisparityOptions all = arguments.options;
  all.max_outlier_percent = 100;
  all.speckle_size_px = 0;
  DisparityOptions block = arguments.options;
  block.method = MatchingMethod::block;
  std::vector<Method> list{{"Spartan", spartan(arguments.options)}, {"Spartan, all kept", spartan(all)}};
  if (!arguments.rivals) {
    list.push_back({"Spartan, block", spartan(block)});
    return list;
  }
  list.push_back({"HH uniqueness 10", opencv({"", cv::StereoSGBM::MODE_HH, 10})});
  list.push_back({"HH uniqueness 0", opencv({"", cv::StereoSGBM::MODE_HH, 0})});
  list.push_back({"SGBM", opencv({"", cv::StereoSGBM::MODE_SGBM, 10})});
  list.push_back({"Spartan, block", spartan(block)});
  return list;
}

// Scores of all methods (inner index) on some pairs.
using Table = std::vector<std::vector<Scores>>;

void print_means(const std::string& title, const std::vector<Method>& list, const Table& table) {
  for (std::size_t m = 0; m < list.size(); ++m) {
    Scores mean;
    for (std::vector<Scores> row : table) {
      for (int i = 0; i < Scores::kCount; ++i) {
        *mean.values()[static_cast<std::size_t>(i)] +=
            *row[m].values()[static_cast<std::size_t>(i)] / static_cast<double>(table.size());
      }
    }
    print_line(title, list[m].name, mean);
  }
}

void compare_accuracy(const std::vector<Pair>& pairs, const std::vector<Method>& list, const Arguments& arguments) {
  std::map<std::string, Table> tables;
  double worst = 0;
  std::string worst_pair;
  for (const Pair& pair : pairs) {
    std::vector<Scores> row;
    for (const Method& method : list) {
      const Image<float> disparity = method.disparity(pair);
      row.push_back(score(pair, disparity));
      print_line(pair.name, method.name, row.back());
      if (!arguments.images.empty() && row.size() == 1) write_images(arguments.images, pair, disparity);
    }
    tables[pair.folder.parent_path().filename().string()].push_back(row);
    tables["all"].push_back(row);
    if (row.size() > 2 && row[0].nonocc_bad_1 / row[2].nonocc_bad_1 > worst) {
      worst = row[0].nonocc_bad_1 / row[2].nonocc_bad_1;
      worst_pair = pair.name;
    }
  }
  for (const auto& [set, table] : tables) print_means("mean, " + set, list, table);
  if (worst > 0) fmt::print("largest bad-1 (non-occluded) over that of HH: {:.2f} ({})\n", worst, worst_pair);
}

// The penalties that are best on one set of pairs, on the other set. HH has its own penalties on both.
void cross_validate(const std::vector<Pair>& pairs) {
  struct Candidate {
    DisparityOptions options;
    std::map<std::string, Scores> means;
  };
  const auto set_of = [](const Pair& pair) { return pair.folder.parent_path().filename().string(); };
  std::map<std::string, double> counts;
  for (const Pair& pair : pairs) counts[set_of(pair)] += 1;
  const auto means_of = [&](const Method& method) {
    std::map<std::string, Scores> means;
    for (const Pair& pair : pairs) {
      Scores scores = score(pair, method.disparity(pair));
      for (std::size_t i = 0; i < Scores::kCount; ++i)
        *means[set_of(pair)].values()[i] += *scores.values()[i] / counts[set_of(pair)];
    }
    return means;
  };
  std::vector<Candidate> candidates;
  for (const int p1 : {12, 18, 24}) {
    for (const int p2_flat : {60, 75, 90}) {
      for (const int p2_edge : {15, 25, 35}) {
        for (const int out_of_view : {8, 11, 14}) {
          Arguments arguments;
          arguments.rivals = false;
          arguments.options.p1 = p1;
          arguments.options.p2_flat = p2_flat;
          arguments.options.p2_edge = p2_edge;
          arguments.options.out_of_view_cost = out_of_view;
          candidates.push_back({arguments.options, means_of(methods(arguments).front())});
        }
      }
    }
  }
  const std::vector<Method> all = methods({});
  const auto ten = means_of(all[2]), none = means_of(all[3]);
  fmt::print("\nCross-validation: penalties of least bad-1 (non-occluded) on one set of pairs, on the other\n");
  for (const auto& [chosen_on, reported_on] : {std::pair{"middlebury", "eth3d"}, std::pair{"eth3d", "middlebury"}}) {
    const auto best = std::min_element(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
      return a.means.at(chosen_on).nonocc_bad_1 < b.means.at(chosen_on).nonocc_bad_1;
    });
    const DisparityOptions& o = best->options;
    fmt::print("chosen on {}: p1 {}, p2_flat {}, p2_edge {}, out_of_view_cost {}\n", chosen_on, o.p1, o.p2_flat,
               o.p2_edge, o.out_of_view_cost);
    const auto line = [&](const std::string& name, const Scores& s) {
      fmt::print("  {:<11} {:<17} bad-1 non-occluded {:5.2f}, bad-2 of all {:5.2f}\n", reported_on, name,
                 s.nonocc_bad_1, s.bad_2);
    };
    line("Spartan", best->means.at(reported_on));
    line("HH uniqueness 10", ten.at(reported_on));
    line("HH uniqueness 0", none.at(reported_on));
  }
}

void time_targets(const SpeedPair& pair, int disparities, const Arguments& arguments) {
  for (const SimdTarget simd : available_simd_targets()) {
    DisparityOptions options = arguments.options;
    options.simd = simd;
    fmt::print("{:<5} ", name_of(simd));
    time_spartan(pair, disparities, 1, arguments.repeat, options);
  }
}

void compare_times(const Arguments& arguments) {
  const SpeedPair pair = rendered_pair(arguments.recordings + "/rocky_20pct");
  if (pair.left.empty()) {
    fmt::print("\nno times: scripts/recordings makes the recording rocky_20pct\n");
    return;
  }
  compare_first_calls(arguments.recordings, 256, arguments.repeat);
  compare_speed(pair, 256, arguments.repeat, arguments.options);
  compare_speed(pair, 384, arguments.repeat, arguments.options);
  compare_speed(resized(pair, {640, 480}), 192, 3 * arguments.repeat, arguments.options);
  fmt::print("\nBlock matching, 256 disparities, 1 and 2 threads\n");
  DisparityOptions block = arguments.options;
  block.method = MatchingMethod::block;
  for (const int threads : {1, 2}) time_spartan(pair, 256, threads, arguments.repeat, block);
  fmt::print("\nInstruction sets, 256 disparities\n");
  time_targets(pair, 256, arguments);
}

void run(const std::vector<std::string>& words) {
  const Arguments arguments = parse(words);
  if (words.size() >= 3 && words[0] == kFirstCall)
    return print_first_call(rendered_pair(arguments.recordings + "/rocky_20pct"), words[1], std::stoi(words[2]));
  if (!arguments.accuracy) return compare_times(arguments);
  const char* const data = std::getenv("SPARTAN_DATA");
  const fs::path folder = data != nullptr ? data : "../shared/data";
  if (!fs::exists(folder / "middlebury")) {
    fmt::print("no stereo pairs: set SPARTAN_DATA to the data folder\n");
    return;
  }
  const std::vector<Pair> pairs = load_stereo_pairs(folder);
  const std::vector<Method> list = methods(arguments);
  fmt::print("{:<18} {:<17} {:>7} {:>7} {:>7} {:>8} {:>8} {:>8} {:>9} {:>7}\n", "pair", "method", "bad-0.5", "bad-1",
             "bad-2", "m.bad-1", "m.bad-2", "density", "no.bad-1", "rms<1");
  compare_accuracy(pairs, list, arguments);
  fmt::print("\nUnder other light\n");
  std::vector<Pair> variants;
  for (std::size_t i = 0; i < pairs.size(); i += 4) {
    for (const Light light : kLights) variants.push_back(under(light, pairs[i]));
  }
  compare_accuracy(variants, list, arguments);
  if (!arguments.rivals) return;
  cross_validate(pairs);
  compare_times(arguments);
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
