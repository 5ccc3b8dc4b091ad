#include "viewer/run_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/odometry/odometer.h"
#include "spartan/report/report.h"

namespace spartan::viewer {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kJpegQuality = 85;
constexpr std::int64_t kMostCells = 400'000;

// Changes whenever the store is written: sizes and times of the database and of its log.
std::string version_of(const std::string& store) {
  std::string text;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code error;
    const auto size = fs::file_size(store + suffix, error);
    const auto time = fs::last_write_time(store + suffix, error);
    text += error ? "none;" : fmt::format("{} {};", size, time.time_since_epoch().count());
  }
  return text;
}

// As the summary of a run that has ended states it, else what a live run records.
std::string recording_of(const RunFolder& folder) {
  std::error_code error;
  if (fs::exists(folder.recording(1), error)) return folder.recording(1);
  const auto text = read_file(folder.summary());
  if (!text) return "";
  const Json summary = Json::parse(*text, nullptr, false);
  const std::string input = summary.is_object() ? summary.value("input", "") : "";
  return fs::exists(input, error) ? input : "";
}

tl::unexpected<Error> no_such(const char* what, std::size_t number, const std::string& path) {
  return failure(ErrorCode::input, fmt::format("has no {} {}", what, number), path);
}

}  // namespace

Result<std::unique_ptr<RunView>> RunView::open(const ViewRequest& request) {
  const RunFolder folder{request.run};
  const auto rig = read_rig_yaml(folder.rig());
  if (!rig) return failure(rig);
  auto options = load_options<RunOptions>(folder.config());
  if (!options) return failure(options);
  std::unique_ptr<RunView> view(new RunView(request, folder, *rig, *options));
  if (Status s = view->refresh(); !s) return failure(s);
  return view;
}

Status RunView::refresh() {
  const std::string version = version_of(folder_.store());
  if (version == version_) return {};
  auto store = RunStore::open_read_only(folder_.store());
  if (!store) return failure(store);
  auto frames = store->frames();
  if (!frames) return failure(frames);
  auto terrain = store->terrain();
  if (!terrain) return failure(terrain);
  auto maps = store->maps();
  if (!maps) return failure(maps);
  frames_ = std::move(*frames);
  terrain_ = std::move(*terrain);
  maps_ = std::move(*maps);
  version_ = version;
  return {};
}

Result<std::string> RunView::overview() {
  const std::lock_guard lock(mutex_);
  if (Status s = refresh(); !s) return failure(s);
  std::error_code error;
  Json terrain = Json::array();
  for (const TerrainRecord& view : terrain_) {
    const auto frame =
        std::find_if(frames_.begin(), frames_.end(), [&](const FrameRecord& f) { return f.stamp == view.stamp; });
    terrain.push_back(frame == frames_.end() ? -1 : frame - frames_.begin());
  }
  const std::string recording = request_.recording.empty() ? recording_of(folder_) : request_.recording;
  return Json{{"name", fs::path(folder_.path).lexically_normal().filename().string()},
              {"rig", rig_.name},
              {"frames", frames_.size()},
              {"terrain", terrain},
              {"maps", maps_.size()},
              {"has_images", !recording.empty()},
              {"ended", fs::exists(folder_.summary(), error)}}
      .dump();
}

Result<std::string> RunView::frames(std::size_t from) {
  const std::lock_guard lock(mutex_);
  if (Status s = refresh(); !s) return failure(s);
  return frame_columns(frames_, std::min(from, frames_.size()));
}

Result<std::string> RunView::map() {
  const std::lock_guard lock(mutex_);
  auto saved = SavedMap::open(folder_.path);
  if (!saved) return failure(saved);
  return map_layers(*saved, kMostCells);
}

Status RunView::open_recording_again() {
  const std::string path = request_.recording.empty() ? recording_of(folder_) : request_.recording;
  request_.open.unfinished = true;  // that of a live run
  if (path.empty())
    return failure(ErrorCode::input, "does not state its recording", folder_.path, "name it by --recording");
  auto opened = open_recording(path, request_.open);
  if (!opened) return failure(opened);
  recording_ = std::move(*opened);
  const std::string masks = fs::path(recording_->info().rig_source).parent_path().string();
  auto imager = Imager::create(rig_, options_.imaging, ThreadPool(1), masks);
  if (!imager) return failure(imager);
  imager_ = std::move(*imager);
  return {};
}

// A recording that is being made has more frames than when it was opened.
Result<StereoFrame> RunView::frame_at(std::size_t frame) {
  if (frame >= frames_.size()) return no_such("frame", frame, folder_.path);
  const FrameRecord& record = frames_[frame];
  if (recording_) {
    if (auto found = recording_->frame_at(record.pair, record.stamp)) return found;
  }
  if (Status s = open_recording_again(); !s) return failure(s);
  return recording_->frame_at(record.pair, record.stamp);
}

Result<std::string> RunView::image(std::size_t frame) {
  const std::lock_guard lock(mutex_);
  const auto read = frame_at(frame);
  if (!read) return failure(read);
  const auto pair = imager_->process(*read);
  if (!pair) return failure(pair);
  if (pair->left.empty()) return no_such("left image of frame", frame, folder_.path);
  return encode_jpeg(pair->left, kJpegQuality);
}

Result<std::string> RunView::landmarks(std::size_t frame) {
  const std::lock_guard lock(mutex_);
  auto odometer = Odometer::create(options_.odometry, ThreadPool(1));
  if (!odometer) return failure(odometer);
  for (const std::size_t number : {frame == 0 ? 0 : frame - 1, frame}) {
    const auto read = frame_at(number);
    if (!read) return failure(read);
    const auto pair = imager_->process(*read);
    if (!pair) return failure(pair);
    odometer->add(*pair);
  }
  Json tracks = Json::array();
  for (const LandmarkTrack& track : odometer->tracks()) {
    tracks.push_back({std::lround(10 * track.previous_px.x()), std::lround(10 * track.previous_px.y()),
                      std::lround(10 * track.current_px.x()), std::lround(10 * track.current_px.y()),
                      track.is_inlier ? 1 : 0});
  }
  return Json{{"unit_px", 0.1}, {"tracks", tracks}}.dump();
}

Result<std::string> RunView::disparity(std::size_t view) {
  const std::lock_guard lock(mutex_);
  if (view >= terrain_.size()) return no_such("terrain view", view, folder_.path);
  return read_file(fmt::format("{}/{}.png", folder_.terrain(), terrain_[view].stamp.ns));
}

}  // namespace spartan::viewer
