#include "spartan/system/internal/row_alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "spartan/calibration/pair_check.h"
#include "spartan/imaging/imager.h"

namespace spartan::internal {
namespace {

constexpr std::size_t kFirstFrames = 40, kUsedFrames = 5;

// The images of one stereo frame, 8-bit gray, unrectified.
struct GrayFrame {
  Image<std::uint8_t> left, right;
};

Result<std::vector<GrayFrame>> first_frames(SampleStream& source, Imager& imager, const std::string& pair) {
  const std::size_t count = std::min(source.previews(pair), kFirstFrames), used = std::min(count, kUsedFrames);
  std::vector<GrayFrame> frames;
  for (std::size_t i = 0; i < used; ++i) {
    const auto frame = source.preview(pair, i * count / used);
    if (!frame && frame.error().code != ErrorCode::input) return failure(frame);
    if (!frame) continue;
    const auto gray = imager.process(*frame);
    if (gray) frames.push_back({Image<std::uint8_t>::copy_of(gray->left), Image<std::uint8_t>::copy_of(gray->right)});
  }
  return frames;
}

std::string to_text(const std::string& pair, const RowAlignment& alignment) {
  const auto angle = [](double rad, const char* positive, const char* negative) {
    return fmt::format("{:.3f} deg {}", std::abs(rad) / kRadiansPerDegree, rad > 0 ? positive : negative);
  };
  return fmt::format(
      "pair {}: rows differ by {:.2f} px on the mean; its right camera is rotated by {} and {}, and they differ by "
      "{:.2f} px ({} matches; align_rows=false keeps the calibration)",
      pair, alignment.given.mean_px, angle(alignment.pitch_rad, "up", "down"),
      angle(alignment.roll_rad, "clockwise", "counter-clockwise"), alignment.aligned.mean_px, alignment.inliers);
}

}  // namespace

Result<AlignedRig> align_rows_of(SampleStream& source, const ThreadPool& workers) {
  AlignedRig result{source.info().rig, {}};
  ImagingOptions options;
  options.rectify = false;
  auto imager = Imager::create(result.rig, options, workers, source.info().mask_folder());
  if (!imager) return failure(imager);
  std::vector<CorrectedPair> corrected;
  std::map<std::string, std::string> sentences;  // by pair
  for (const StereoPair& pair : source.info().rig.pairs) {
    const auto frames = first_frames(source, *imager, pair.name);
    if (!frames) return failure(frames);
    std::vector<StereoViews> views;
    views.reserve(frames->size());
    for (const GrayFrame& frame : *frames) views.push_back({frame.left.view(), frame.right.view()});
    if (views.empty()) continue;
    const auto alignment = align_rows(source.info().rig, pair, views, workers);
    if (!alignment) return failure(alignment);
    if (!alignment->rig) continue;
    corrected.push_back({pair.name, *alignment->rig});
    sentences[pair.name] = to_text(pair.name, *alignment);
  }
  // Pairs that share cameras may contradict each other.
  const MergedRig merged = merge_corrections(source.info().rig, corrected);
  for (const std::string& pair : merged.discarded) sentences.erase(pair);
  for (const auto& [pair, sentence] : sentences) result.sentences.push_back(sentence);
  result.rig = merged.rig;
  return result;
}

}  // namespace spartan::internal
