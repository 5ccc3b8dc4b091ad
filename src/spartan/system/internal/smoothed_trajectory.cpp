#include "spartan/system/internal/smoothed_trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "spartan/localization/localizer.h"

namespace spartan::internal {

Status write_smoothed_trajectory(RunStore& store, const LocalizationOptions& options, const Log& log) {
  const auto begin = std::chrono::steady_clock::now();
  auto smoother = Smoother::create(options);
  if (!smoother) return failure(smoother);
  auto inputs = store.localization_inputs();
  if (!inputs) return failure(inputs);
  for (Bytes& bytes : *inputs) {
    if (Status s = smoother->add(bytes); !s) return s;
    bytes = {};
  }
  const std::vector<SmoothedPose> smoothed = smoother->smooth();
  if (smoothed.empty()) return {};
  const auto frames = store.frames();
  if (!frames) return failure(frames);
  std::vector<std::optional<UncertainPose>> by_frame(frames->size());
  for (std::size_t i = 0; i < frames->size(); ++i) {
    const FrameRecord& frame = (*frames)[i];
    if (!frame.localization) continue;
    const auto at = std::lower_bound(smoothed.begin(), smoothed.end(), frame.stamp,
                                     [](const SmoothedPose& p, Stamp stamp) { return p.stamp < stamp; });
    if (at != smoothed.end() && at->stamp == frame.stamp) by_frame[i] = at->world_from_body;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  log.info(fmt::format("trajectory smoothed in {:.1f} s", took.count()));
  return store.commit_smoothed(by_frame);
}

}  // namespace spartan::internal
