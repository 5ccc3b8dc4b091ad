#include "program/disparity_scores.h"

#include <fmt/format.h>

#include <array>

namespace spartan::program {
namespace {

struct Score {
  const char* key;
  const char* meaning;
  std::optional<double> DisparityScores::*value;
};
constexpr std::array<Score, 9> kScores{{{"bad_0_5", "bad over 0.5 px, %", &DisparityScores::bad_0_5},
                                        {"bad_1", "bad over 1 px, %", &DisparityScores::bad_1},
                                        {"bad_2", "bad over 2 px, %", &DisparityScores::bad_2},
                                        {"bad_3", "bad over 3 px, %", &DisparityScores::bad_3},
                                        {"matched_bad_1", "of matched, over 1 px, %", &DisparityScores::matched_bad_1},
                                        {"matched_bad_2", "of matched, over 2 px, %", &DisparityScores::matched_bad_2},
                                        {"density_percent", "density, %", &DisparityScores::density_percent},
                                        {"rms_in_1px", "rms up to 1 px, px", &DisparityScores::rms_in_1px},
                                        {"mean_abs_px", "mean error, px", &DisparityScores::mean_abs_px}}};

Json scores_to_json(const DisparityScores& scores) {
  Json json{{"truth_pixels", scores.truth_pixels}, {"matched_pixels", scores.matched_pixels}};
  for (const Score& score : kScores) json[score.key] = number(scores.*score.value);
  return json;
}

std::string cell(const std::optional<DisparityScores>& scores, const Score& score) {
  if (!scores || !(*scores.*score.value)) return fmt::format("{:>10}", "-");
  return fmt::format("{:>10.3f}", *(*scores.*score.value));
}

}  // namespace

Json to_json(const DisparityMetrics& metrics) {
  Json json{{"all", scores_to_json(metrics.all)}, {"nonocc", nullptr}};
  if (metrics.nonocc) {
    json["nonocc"] = scores_to_json(*metrics.nonocc);
  } else {
    json["reasons"] = {{"nonocc", "no mask that marks occluded pixels was given"}};
  }
  return json;
}

std::string table_of(const DisparityMetrics& metrics) {
  std::string text = fmt::format("{:<26}{:>10}{:>10}\n", "score", "all", "nonocc");
  for (const Score& score : kScores) {
    text += fmt::format("{:<26}{}{}\n", score.meaning, cell(metrics.all, score), cell(metrics.nonocc, score));
  }
  return text;
}

}  // namespace spartan::program
