// Video files of a stereo camera, decoded by the plugin libspartan_video.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"

namespace spartan::internal {

/// Whether a file name has the extension of a video (mp4, avi, mkv, mov, webm …).
bool is_video_name(const std::string& path);

/// Frames of one video file as 8-bit gray images. Reading them in order is fast; going back decodes from the start.
class Video {
 public:
  /// Loads the plugin at the first call: $SPARTAN_VIDEO, else libspartan_video.so beside the program or in its library
  /// path. It is a library of its own, so that a program that reads no video needs neither OpenCV's videoio nor FFmpeg.
  /// Codes: `configuration` (no plugin), `input` (the file cannot be decoded).
  static Result<Video> open(const std::string& path);

  ImageSize size() const { return size_; }
  double fps() const { return fps_; }                           ///< as the file states, 0 where it does not
  std::int64_t announced_frames() const { return announced_; }  ///< as the file states; some files state too many
  /// Code `input` where the file ends before, or the frame cannot be decoded.
  Result<Image<std::uint8_t>> read(std::int64_t number);

 private:
  struct Plugin;
  Status reopen();
  std::string path_;
  std::shared_ptr<const Plugin> plugin_;
  std::shared_ptr<void> handle_;
  ImageSize size_;
  double fps_ = 0;
  std::int64_t announced_ = 0, next_ = 0;
};

/// Left and right images out of one video with the images side by side, or out of two.
class StereoVideo {
 public:
  /// `right` empty: side by side. Codes as Video::open(); `input` where the halves or sizes do not fit.
  static Result<StereoVideo> open(const std::string& left, const std::string& right);

  ImageSize size() const;  ///< of one image
  double fps() const { return left_.fps(); }
  std::int64_t announced_frames() const;

  struct Images {
    FrameImage left, right;
  };
  /// Codes as Video::read().
  Result<Images> read(std::int64_t number);

 private:
  StereoVideo(Video left, std::unique_ptr<Video> right) : left_(std::move(left)), right_(std::move(right)) {}
  Video left_;
  std::unique_ptr<Video> right_;  // null: side by side
};

}  // namespace spartan::internal
