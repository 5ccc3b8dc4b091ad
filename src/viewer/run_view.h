// What the page of a run asks for, read from the run folder as it grows.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/imaging/imager.h"
#include "spartan/rig/rig.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"
#include "viewer/frame_images.h"
#include "viewer/view_server.h"

namespace spartan::viewer {

/// May be called by several threads.
class RunView {
 public:
  static Result<std::unique_ptr<RunView>> open(const ViewRequest& request);

  /// JSON: name, numbers of frames, terrain views and local maps, the version of the global map (0: there is none),
  /// the last frame whose images are on disk, whether the run has ended, and a number that changes where frames that
  /// were given before are others now.
  Result<std::string> overview();
  /// JSON of FrameColumns, from this number on.
  Result<std::string> frames(std::size_t from);
  /// map_layers(). Code `input`: there is no map.
  Result<std::string> map();
  /// The rectified left image of a frame as JPEG; empty where a live run has not recorded it yet. Code `input`: there
  /// is no recording, or not this image.
  Result<std::string> image(std::size_t frame);
  /// JSON: the landmarks by which the motion to this frame was measured, in the rectified left image; none where it was
  /// not measured. They are searched anew, from images_of_motion().
  Result<std::string> landmarks(std::size_t frame);
  /// The disparity image of a terrain view, in colour, as PNG.
  Result<std::string> disparity(std::size_t view);

 private:
  // What is kept of a frame; the other columns are read when they are asked for.
  struct Frame {
    std::string pair;
    Stamp stamp, motion_from;
    bool has_motion = false;
  };
  explicit RunView(const ViewRequest& request) : request_(request), folder_{request.run} {}
  Status refresh();
  Status read_settings();
  Result<bool> read_added(RunStore& store);
  bool has_ended() const;
  std::int64_t last_image();
  Status make_imager();
  Result<StereoFrame> images_of(std::size_t frame);
  std::optional<std::size_t> reference_of(std::size_t frame) const;
  Result<std::vector<StereoFrame>> images_of_motion(std::size_t frame);

  ViewRequest request_;
  RunFolder folder_;
  Rig rig_;
  RunOptions options_;
  std::mutex mutex_;
  std::string version_;  // of the store's files
  std::optional<RunIdentity> identity_;
  std::vector<Frame> frames_;
  std::vector<Stamp> terrain_;
  std::int64_t maps_ = 0;
  std::int64_t map_version_ = 0;
  std::int64_t generation_ = 0;  // how often other records have replaced those that were read
  std::int64_t last_image_ = -1;
  std::optional<FrameImages> images_;
  std::optional<Imager> imager_;
};

}  // namespace spartan::viewer
