#include "viewer/run_view.h"

#include <fmt/format.h>

#include <algorithm>
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

// An empty object before a run has written one.
Json summary_of(const RunFolder& folder) {
  const auto text = read_file(folder.summary());
  Json summary = text ? Json::parse(*text, nullptr, false) : Json::object();
  return summary.is_object() ? summary : Json::object();
}

// What the summary of a run states; empty where it is not there.
std::string input_of(const RunFolder& folder) {
  const Json summary = summary_of(folder);
  const std::string input =
      summary.contains("input") && summary["input"].is_string() ? summary["input"].get<std::string>() : "";
  std::error_code error;
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
  const auto tiles = store->tiles().index();
  if (!tiles) return failure(tiles);
  map_version_ = 0;
  for (const auto& tile : *tiles) map_version_ = std::max(map_version_, tile.revision);
  frames_ = std::move(*frames);
  terrain_ = std::move(*terrain);
  maps_ = std::move(*maps);
  version_ = version;
  return {};
}

// Where a run was resumed the store has more frames than the summary, which is of its first part; where it is just
// ending the frames that were read here may be fewer.
bool RunView::has_ended() const {
  const Json summary = summary_of(folder_);
  if (!summary.contains("frames") || !summary["frames"].is_number_unsigned()) return false;
  auto frames = summary["frames"].get<std::size_t>();
  if (summary.contains("skipped") && summary["skipped"].is_object()) {
    for (const auto& [reason, count] : summary["skipped"].items())
      frames += count.is_number_unsigned() ? count.get<std::size_t>() : 0;
  }
  return frames_.size() == frames;
}

Result<std::string> RunView::overview() {
  const std::lock_guard lock(mutex_);
  if (Status s = refresh(); !s) return failure(s);
  const bool ended = has_ended();
  Json terrain = Json::array();
  for (const TerrainRecord& view : terrain_) {
    const auto frame = std::lower_bound(frames_.begin(), frames_.end(), view.stamp,
                                        [](const FrameRecord& f, const Stamp& stamp) { return f.stamp < stamp; });
    const bool found = frame != frames_.end() && frame->stamp == view.stamp;
    terrain.push_back(found ? frame - frames_.begin() : -1);
  }
  return Json{{"name", fs::path(folder_.path).lexically_normal().filename().string()},
              {"rig", rig_.name},
              {"frames", frames_.size()},
              {"terrain", terrain},
              {"maps", maps_.size()},
              {"map_version", map_version_},
              {"has_images", !recording_folders().empty()},
              {"ended", ended}}
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

// The one that was named, else those that a live run has recorded, else that of the summary.
std::vector<std::string> RunView::recording_folders() const {
  if (!request_.recording.empty()) return {request_.recording};
  std::vector<std::string> folders;
  std::error_code error;
  for (int number = 1; fs::exists(folder_.recording(number), error); ++number)
    folders.push_back(folder_.recording(number));
  if (const std::string input = input_of(folder_); folders.empty() && !input.empty()) folders.push_back(input);
  return folders;
}

Status RunView::open_recordings() {
  const std::vector<std::string> folders = recording_folders();
  if (folders.empty())
    return failure(ErrorCode::input, "does not state its recording", folder_.path, "name it by --recording");
  request_.open.unfinished = true;  // the last one of a live run
  recordings_are_complete_ = has_ended();
  recordings_.clear();
  for (const std::string& folder : folders) {
    auto opened = open_recording(folder, request_.open);
    if (!opened) return failure(opened);
    recordings_.push_back(std::move(*opened));
  }
  if (imager_) return {};
  auto imager = Imager::create(rig_, options_.imaging, ThreadPool(1), folder_.path);
  if (!imager) return failure(imager);
  imager_ = std::move(*imager);
  return {};
}

// A recording that is being made has more frames than when it was opened.
Result<StereoFrame> RunView::frame_at(std::size_t frame) {
  if (frame >= frames_.size()) return no_such("frame", frame, folder_.path);
  const FrameRecord& record = frames_[frame];
  const auto find = [&]() -> Result<StereoFrame> {
    Result<StereoFrame> found = no_such("image of frame", frame, folder_.path);
    for (auto recording = recordings_.rbegin(); recording != recordings_.rend() && !found; ++recording)
      found = (*recording)->frame_at(record.pair, record.stamp);
    return found;
  };
  auto found = find();
  if (found || recordings_are_complete_) return found;
  if (Status s = open_recordings(); !s) return failure(s);
  return find();
}

Result<std::string> RunView::image(std::size_t frame) {
  const std::lock_guard lock(mutex_);
  const auto read = frame_at(frame);
  if (!read && frame < frames_.size() && !recordings_are_complete_) return std::string();  // not on disk yet
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
  for (std::size_t number = frame == 0 ? 0 : frame - 1; number <= frame; ++number) {
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
