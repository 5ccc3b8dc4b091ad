#include "spartan/camera/samples.h"

namespace spartan {

std::string_view name_of(FrameFault fault) {
  switch (fault) {
    case FrameFault::left_missing:
      return "left_missing";
    case FrameFault::right_missing:
      return "right_missing";
    case FrameFault::unreadable:
      return "unreadable";
    case FrameFault::wrong_size:
      return "wrong_size";
    case FrameFault::stamp_reversed:
      return "stamp_reversed";
    case FrameFault::stamps_apart:
      return "stamps_apart";
    case FrameFault::frozen:
      return "frozen";
    case FrameFault::dropped:
      return "dropped";
  }
  return "unreadable";
}

Stamp stamp_of(const Sample& sample) {
  if (const auto* frame = std::get_if<StereoFrame>(&sample)) return frame->left_stamp;
  return std::visit(
      [](const auto& other) {
        if constexpr (requires { other.stamp; }) return other.stamp;
        return Stamp{};
      },
      sample);
}

std::string source_of(const Sample& sample) {
  if (const auto* frame = std::get_if<StereoFrame>(&sample)) return frame->pair;
  if (const auto* missing = std::get_if<MissingFrame>(&sample)) return missing->pair;
  if (std::holds_alternative<ImuSample>(sample)) return ":imu";
  if (std::holds_alternative<WheelSample>(sample)) return ":wheels";
  return std::holds_alternative<CompassSample>(sample) ? ":compass" : ":inclinometer";
}

std::size_t image_bytes(const Sample& sample) {
  const auto* frame = std::get_if<StereoFrame>(&sample);
  const auto* missing = std::get_if<MissingFrame>(&sample);
  if (missing != nullptr && missing->partial) frame = &*missing->partial;
  return frame != nullptr ? frame->left.bytes() + frame->right.bytes() : 0;
}

void move_stamps(Sample& sample, std::int64_t by_ns) {
  const auto move_frame = [&](StereoFrame& frame) {
    frame.left_stamp.ns += by_ns;
    frame.right_stamp.ns += by_ns;
  };
  if (auto* frame = std::get_if<StereoFrame>(&sample)) return move_frame(*frame);
  if (auto* missing = std::get_if<MissingFrame>(&sample); missing != nullptr && missing->partial)
    move_frame(*missing->partial);
  std::visit(
      [&](auto& other) {
        if constexpr (requires { other.stamp; }) other.stamp.ns += by_ns;
      },
      sample);
}

}  // namespace spartan
