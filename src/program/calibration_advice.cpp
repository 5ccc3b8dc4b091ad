#include "program/calibration_advice.h"

#include <fmt/format.h>

#include <vector>

#include "program/inspection_images.h"
#include "spartan/calibration/pair_check.h"
#include "spartan/system/run_options.h"

namespace spartan::program {
namespace {

constexpr int kFrames = 4;

}  // namespace

std::string calibration_advice(const std::string& recording, const OpenOptions& open, const std::string& odometry_pair,
                               const ThreadPool& workers) {
  auto source = open_recording(recording, open);
  if (!source) return {};
  const RecordingInfo& info = (*source)->info();
  RunOptions options;
  options.odometry_pair = odometry_pair;
  const StereoPair* const pair = odometry_pair_of(info.rig, options);
  if (pair == nullptr) return {};
  const auto images = load_frames(**source, pair->name, kFrames, workers);
  if (!images) return {};
  std::vector<StereoViews> views;
  views.reserve(images->size());
  for (const ImagePair& image : *images) views.push_back({image.left.view(), image.right.view()});
  const auto inspection = inspect_pair(info.rig, *pair, views, workers);
  if (!inspection || inspection->check.grade != PairGrade::bad) return {};
  std::string text;
  for (const RigFinding& finding : inspection->check.findings)
    text += fmt::format("pair {}: {}: {}\n", pair->name, finding.id, finding.text);
  return text + fmt::format("check the calibration: spartan rig inspect {} --recording {}", info.rig_source, recording);
}

}  // namespace spartan::program
