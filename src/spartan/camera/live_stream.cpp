// The kinds of live streams.
#include <fmt/format.h>

#include "spartan/camera/internal/replay_stream.h"
#include "spartan/camera/recording.h"
#include "spartan/camera/sample_stream.h"

namespace spartan {
namespace {

constexpr std::string_view kReplay = "replay:";

}  // namespace

bool is_live_address(std::string_view input) {
  return input.starts_with(kReplay);
}

Result<std::unique_ptr<SampleStream>> open_live_stream(const std::string& address, const OpenOptions& open,
                                                       const LiveOptions& options) {
  if (!is_live_address(address)) {
    return failure(ErrorCode::usage, "is not the address of a live stream", address, "use replay:FOLDER");
  }
  if (!(options.speed > 0) || options.passes < 1) {
    return failure(ErrorCode::usage,
                   fmt::format("speed {} and {} passes must be positive", options.speed, options.passes), address);
  }
  auto recording = open_recording(address.substr(kReplay.size()), open);
  if (!recording) return failure(recording);
  return std::make_unique<internal::ReplayStream>(std::move(*recording), options.speed, options.passes);
}

}  // namespace spartan
