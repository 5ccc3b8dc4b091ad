// What a stream has delivered and discarded, as text.
#include <fmt/format.h>

#include <array>
#include <utility>

#include "spartan/camera/sample_stream.h"

namespace spartan {
namespace {

using Counts = std::initializer_list<std::pair<std::int64_t, const char*>>;

// ", 3 incomplete images" for each count that is not zero.
std::string counts_text(Counts counts) {
  std::string text;
  for (const auto& [count, what] : counts) {
    if (count > 0) text += fmt::format(", {} {}", count, what);
  }
  return text;
}

}  // namespace

std::vector<std::string> describe(const DiscardedSamples& discarded) {
  std::vector<std::string> lines;
  if (discarded.reversed > 0) {
    lines.push_back(
        fmt::format("{} sensor samples discarded: their time stamps are not in increasing order", discarded.reversed));
  }
  if (discarded.unreadable > 0) {
    lines.push_back(fmt::format("{} rows of sensor tables discarded: they cannot be parsed; the first: {}",
                                discarded.unreadable, discarded.first_unreadable));
  }
  return lines;
}

std::string describe(const CameraPairReport& report) {
  std::string text = fmt::format("pair {}: {} frames, skew {:.3f} ms on average, {:.3f} ms at most", report.pair,
                                 report.pairs, report.mean_skew_ms, report.largest_skew_ms);
  text += counts_text({{report.left_alone, "left images alone"},
                       {report.right_alone, "right images alone"},
                       {report.incomplete, "with an incomplete image"},
                       {report.apart, "with images apart in time"},
                       {report.wrong_size, "with an image of another size"},
                       {report.stamps_reversed, "with reversed stamps"},
                       {report.not_taken, "images not taken in time"}});
  for (const CameraReport& camera : report.cameras) {
    text += fmt::format("; camera {}: {} images", camera.camera, camera.images);
    text += counts_text({{camera.incomplete, "incomplete"},
                         {camera.not_received, "not received"},
                         {camera.duplicates, "duplicates"},
                         {camera.reversed, "reversed"},
                         {camera.wrong_stamps, "with a wrong stamp"},
                         {camera.triggers, "triggers"},
                         {camera.unanswered, "of them unanswered"},
                         {camera.untriggered, "without a trigger"},
                         {camera.losses, "times lost"}});
    text += fmt::format(", clock {:+.1f} ppm, sigma {:.3f} ms", camera.clock_rate_ppm, camera.clock_sigma_ms);
  }
  return text;
}

}  // namespace spartan
