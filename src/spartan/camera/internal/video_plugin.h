/* C interface of the plugin libspartan_video, which decodes video files through OpenCV's videoio. */
#pragma once

#include <cstddef>
#include <cstdint>

struct SpartanVideoInfo {
  std::int32_t width, height;
  double fps;           // 0: not stated
  std::int64_t frames;  // 0: not stated
};

extern "C" {
// A handle, or null where the file cannot be decoded.
void* spartan_video_open(const char* path, SpartanVideoInfo* info);
// Decodes the next frame into 8-bit gray; `gray` null skips it. 1: done, 0: the file has ended.
int spartan_video_next(void* opened, std::uint8_t* gray, std::ptrdiff_t stride);
void spartan_video_close(void* handle);
}
