// What the page of a run asks for, read from the run folder as it grows.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/core/result.h"
#include "spartan/imaging/imager.h"
#include "spartan/rig/rig.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"
#include "viewer/view_server.h"

namespace spartan::viewer {

/// May be called by several threads.
class RunView {
 public:
  static Result<std::unique_ptr<RunView>> open(const ViewRequest& request);

  /// JSON: name, numbers of frames, terrain views and local maps, the version of the global map (0: there is none),
  /// whether the run has ended.
  Result<std::string> overview();
  /// frame_columns().
  Result<std::string> frames(std::size_t from);
  /// map_layers(). Code `input`: there is no map.
  Result<std::string> map();
  /// The rectified left image of a frame as JPEG; empty where a live run has not recorded it yet. Code `input`: there
  /// is no recording, or not this frame.
  Result<std::string> image(std::size_t frame);
  /// JSON: the landmarks by which the motion to this frame was measured, in the rectified left image. They are searched
  /// anew, from this frame and the one before.
  Result<std::string> landmarks(std::size_t frame);
  /// The disparity image of a terrain view, in colour, as PNG.
  Result<std::string> disparity(std::size_t view);

 private:
  RunView(const ViewRequest& request, RunFolder folder, Rig rig, RunOptions options)
      : request_(request), folder_(std::move(folder)), rig_(std::move(rig)), options_(std::move(options)) {}
  Status refresh();
  bool has_ended() const;
  std::vector<std::string> recording_folders() const;
  Status open_recordings();
  Result<StereoFrame> frame_at(std::size_t frame);

  ViewRequest request_;
  RunFolder folder_;
  Rig rig_;
  RunOptions options_;
  std::mutex mutex_;
  std::string version_;  // of the store's files
  std::vector<FrameRecord> frames_;
  std::vector<TerrainRecord> terrain_;
  std::vector<MapRecord> maps_;
  std::int64_t map_version_ = 0;
  std::vector<std::unique_ptr<Recording>> recordings_;  // a live run that was resumed has several
  bool recordings_are_complete_ = false;                // opened after the run had ended
  std::optional<Imager> imager_;
};

}  // namespace spartan::viewer
