#include "viewer/run_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <ranges>
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

// Number of the last one of so many; 0 where there is none.
std::int64_t last_of(std::size_t count) {
  return count == 0 ? 0 : static_cast<std::int64_t>(count) - 1;
}

tl::unexpected<Error> no_such(const char* what, std::size_t number, const std::string& path) {
  return failure(ErrorCode::input, fmt::format("has no {} {}", what, number), path);
}

}  // namespace

Result<std::unique_ptr<RunView>> RunView::open(const ViewRequest& request) {
  std::unique_ptr<RunView> view(new RunView(request));
  if (Status s = view->read_settings(); !s) return failure(s);
  if (Status s = view->refresh(); !s) return failure(s);
  return view;
}

Status RunView::read_settings() {
  auto rig = read_rig_yaml(folder_.rig());
  if (!rig) return failure(rig);
  auto options = load_options<RunOptions>(folder_.config());
  if (!options) return failure(options);
  rig_ = std::move(*rig);
  options_ = std::move(*options);
  imager_.reset();
  images_.emplace(folder_, RunInput{request_.recording, request_.open});
  return {};
}

Status RunView::refresh() {
  const std::string version = version_of(folder_.store());
  if (version == version_) return {};
  auto store = RunStore::open_read_only(folder_.store());
  if (!store) return failure(store);
  auto identity = store->identity();
  if (!identity) return failure(identity);
  const bool is_other_run = identity_ && *identity != identity_;
  if (is_other_run) {
    if (Status s = read_settings(); !s) return s;
  }
  auto is_continued = is_other_run ? Result<bool>(false) : read_added(*store);
  if (!is_continued) return failure(is_continued);
  if (!*is_continued) {
    ++generation_;
    frames_.clear();
    terrain_.clear();
    maps_ = 0;
    last_image_ = -1;
    is_continued = read_added(*store);
    if (!is_continued) return failure(is_continued);
  }
  const auto tiles = store->tiles().index();
  if (!tiles) return failure(tiles);
  map_version_ = 0;
  for (const auto& tile : *tiles) map_version_ = std::max(map_version_, tile.revision);
  identity_ = std::move(*identity);
  version_ = version;
  return {};
}

// The last record of each kind is read again: false where it is another one, so that the run has gone back to a
// checkpoint. Then nothing is changed.
Result<bool> RunView::read_added(RunStore& store) {
  std::vector<Frame> frames;
  const Status read = store.read_frames(last_of(frames_.size()), [&](const FrameRecord& frame) {
    const bool has_motion = frame.status != "missing" && frame.status != name_of(TrackingStatus::lost);
    frames.push_back({frame.pair, frame.stamp, frame.motion.from, has_motion && !frame.motion.first});
  });
  if (!read) return failure(read);
  const auto terrain = store.terrain(last_of(terrain_.size()));
  if (!terrain) return failure(terrain);
  const auto maps = store.maps(last_of(static_cast<std::size_t>(maps_)));
  if (!maps) return failure(maps);
  if (!frames_.empty() && (frames.empty() || frames.front().stamp != frames_.back().stamp)) return false;
  if (!terrain_.empty() && (terrain->empty() || terrain->front().stamp != terrain_.back())) return false;
  if (maps_ > 0 && maps->empty()) return false;
  if (!frames_.empty()) frames_.pop_back();
  std::move(frames.begin(), frames.end(), std::back_inserter(frames_));
  if (!terrain_.empty()) terrain_.pop_back();
  for (const TerrainRecord& view : *terrain) terrain_.push_back(view.stamp);
  maps_ = last_of(static_cast<std::size_t>(maps_)) + static_cast<std::int64_t>(maps->size());
  return true;
}

// A process that works on the run owns its folder.
bool RunView::has_ended() const {
  return FolderLock::expect_free(folder_.path).has_value();
}

// The last frame whose images are on disk: those of a live run are written beside its results. -1: none.
std::int64_t RunView::last_image() {
  constexpr std::size_t kMost = 300;
  const std::size_t known = last_image_ < 0 ? 0 : static_cast<std::size_t>(last_image_) + 1;
  for (std::size_t n = frames_.size(), tried = 0; n > known && tried < kMost; --n, ++tried) {
    const Frame& frame = frames_[n - 1];
    if (!images_->has_both(frame.pair, frame.stamp)) continue;
    last_image_ = static_cast<std::int64_t>(n) - 1;
    break;
  }
  return last_image_;
}

Result<std::string> RunView::overview() {
  const std::lock_guard lock(mutex_);
  const bool ended = has_ended();  // before its last results are read
  if (Status s = refresh(); !s) return failure(s);
  Json terrain = Json::array();
  for (const Stamp view : terrain_) {
    const auto frame = std::lower_bound(frames_.begin(), frames_.end(), view,
                                        [](const Frame& f, const Stamp& stamp) { return f.stamp < stamp; });
    const bool found = frame != frames_.end() && frame->stamp == view;
    terrain.push_back(found ? frame - frames_.begin() : -1);
  }
  return Json{{"name", fs::path(folder_.path).lexically_normal().filename().string()},
              {"rig", rig_.name},
              {"frames", frames_.size()},
              {"terrain", terrain},
              {"maps", maps_},
              {"map_version", map_version_},
              {"has_images", images_->exist()},
              {"last_image", last_image()},
              {"ended", ended},
              {"generation", generation_}}
      .dump();
}

Result<std::string> RunView::frames(std::size_t from) {
  const std::lock_guard lock(mutex_);
  if (Status s = refresh(); !s) return failure(s);
  auto store = RunStore::open_read_only(folder_.store());
  if (!store) return failure(store);
  from = std::min(from, frames_.size());
  FrameColumns columns(from, frames_.empty() ? Stamp() : frames_.front().stamp);
  const Status read =
      store->read_frames(static_cast<std::int64_t>(from), [&](const FrameRecord& frame) { columns.add(frame); });
  if (!read) return failure(read);
  return columns.json();
}

Result<std::string> RunView::map() {
  const std::lock_guard lock(mutex_);
  auto saved = SavedMap::open(folder_.path);
  if (!saved) return failure(saved);
  return map_layers(*saved, kMostCells);
}

Result<StereoFrame> RunView::images_of(std::size_t frame) {
  if (frame >= frames_.size()) return no_such("frame", frame, folder_.path);
  return images_->read(frames_[frame].pair, frames_[frame].stamp, rig_);
}

Status RunView::make_imager() {
  if (imager_) return {};
  auto imager = Imager::create(rig_, options_.imaging, ThreadPool(1), folder_.path);
  if (!imager) return failure(imager);
  imager_ = std::move(*imager);
  return {};
}

// The frame at which the motion to a frame begins; none where no motion was measured.
std::optional<std::size_t> RunView::reference_of(std::size_t frame) const {
  const Frame& current = frames_[frame];
  for (std::size_t before = current.has_motion ? frame : 0; before-- > 0;) {
    if (frames_[before].stamp == current.motion_from && frames_[before].pair == current.pair) return before;
  }
  return std::nullopt;
}

// From the newest one: a frame, that at which the motion to it begins, and, where that has one image alone and thus no
// depths of its own, those whose landmarks it has kept. Empty where no motion was measured.
Result<std::vector<StereoFrame>> RunView::images_of_motion(std::size_t frame) {
  constexpr std::size_t kMost = 10;
  std::vector<StereoFrame> all;
  std::optional<std::size_t> number = reference_of(frame) ? std::optional(frame) : std::nullopt;
  while (number && all.size() < kMost) {
    auto images = images_of(*number);
    if (!images) return failure(images);
    const bool has_depths = !images->left.empty() && !images->right.empty();
    all.push_back(std::move(*images));
    if (has_depths && all.size() > 1) break;
    number = reference_of(*number);
  }
  return all;
}

Result<std::string> RunView::image(std::size_t frame) {
  const std::lock_guard lock(mutex_);
  if (Status s = make_imager(); !s) return failure(s);
  const auto read = images_of(frame);
  const bool may_follow = frame < frames_.size() && static_cast<std::int64_t>(frame) >= last_image() && !has_ended();
  if (!read && read.error().code == ErrorCode::input && may_follow) return std::string();  // not on disk yet
  if (!read) return failure(read);
  if (read->left.empty()) return no_such("left image of frame", frame, folder_.path);
  const auto pair = imager_->process(*read);
  if (!pair) return failure(pair);
  return encode_jpeg(pair->left, kJpegQuality);
}

Result<std::string> RunView::landmarks(std::size_t frame) {
  const std::lock_guard lock(mutex_);
  if (frame >= frames_.size()) return no_such("frame", frame, folder_.path);
  if (Status s = make_imager(); !s) return failure(s);
  auto odometer = Odometer::create(options_.odometry, ThreadPool(1));
  if (!odometer) return failure(odometer);
  const auto images = images_of_motion(frame);
  if (!images) return failure(images);
  for (const StereoFrame& image : std::ranges::reverse_view(*images)) {
    const auto pair = imager_->process(image);
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
  return read_file(fmt::format("{}/{}.png", folder_.terrain(), terrain_[view].ns));
}

}  // namespace spartan::viewer
