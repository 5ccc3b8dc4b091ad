#include "spartan/camera/internal/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <utility>

#include "spartan/camera/internal/plugin_library.h"
#include "spartan/camera/internal/video_plugin.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 12> kExtensions{".mp4", ".m4v", ".mov", ".avi",  ".mkv",  ".webm",
                                                       ".mpg", ".ts",  ".wmv", ".mpeg", ".h264", ".mjpeg"};

}  // namespace

bool is_video_name(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

struct Video::Plugin {
  decltype(&spartan_video_open) open = nullptr;
  decltype(&spartan_video_next) next = nullptr;
  decltype(&spartan_video_close) close = nullptr;

  static Result<std::shared_ptr<const Plugin>> load() {
    const auto library =
        PluginLibrary::load("libspartan_video.so", "SPARTAN_VIDEO", "videos need", "extract the images");
    if (!library) return failure(library);
    auto plugin = std::make_shared<Plugin>();
    for (const Status& found :
         {library->find("spartan_video_open", plugin->open), library->find("spartan_video_next", plugin->next),
          library->find("spartan_video_close", plugin->close)}) {
      if (!found) return failure(found);
    }
    return plugin;
  }
};

Result<Video> Video::open(const std::string& path) {
  auto plugin = Plugin::load();
  if (!plugin) return failure(plugin);
  Video video;
  video.path_ = path;
  video.plugin_ = std::move(*plugin);
  if (Status opened = video.reopen(); !opened) return failure(opened);
  return video;
}

Status Video::reopen() {
  SpartanVideoInfo info{};
  void* const handle = plugin_->open(path_.c_str(), &info);
  if (handle != nullptr) handle_.reset(handle, plugin_->close);
  if (handle == nullptr) {
    return failure(ErrorCode::input, "cannot be decoded as a video", path_,
                   "check it with ffprobe, or extract its images");
  }
  size_ = {info.width, info.height};
  fps_ = info.fps;
  announced_ = info.frames;
  next_ = 0;
  return {};
}

Result<Image<std::uint8_t>> Video::read(std::int64_t number) {
  if (number < next_) {
    if (Status opened = reopen(); !opened) return failure(opened);
  }
  const auto ended = [&] {
    return failure(ErrorCode::input, fmt::format("ends at frame {} or cannot be decoded there", next_), path_);
  };
  for (; next_ < number; ++next_) {
    if (plugin_->next(handle_.get(), nullptr, 0) == 0) return ended();
  }
  Image<std::uint8_t> image(size_.width, size_.height);
  if (plugin_->next(handle_.get(), image.data(), image.stride()) == 0) return ended();
  ++next_;
  return image;
}

Result<StereoVideo> StereoVideo::open(const std::string& left, const std::string& right) {
  auto first = Video::open(left);
  if (!first) return failure(first);
  if (right.empty()) {
    if (first->size().width % 2 == 0) return StereoVideo(std::move(*first), nullptr);
    return failure(ErrorCode::input, "has an odd width, so it cannot hold two images side by side", left,
                   "name two videos with --left and --right");
  }
  auto second = Video::open(right);
  if (!second) return failure(second);
  if (second->size() != first->size()) {
    return failure(ErrorCode::input,
                   fmt::format("has images of {} × {}, the left ones have {} × {}", second->size().width,
                               second->size().height, first->size().width, first->size().height),
                   right);
  }
  return StereoVideo(std::move(*first), std::make_unique<Video>(std::move(*second)));
}

ImageSize StereoVideo::size() const {
  const ImageSize whole = left_.size();
  return right_ ? whole : ImageSize{whole.width / 2, whole.height};
}

std::int64_t StereoVideo::announced_frames() const {
  return right_ ? std::min(left_.announced_frames(), right_->announced_frames()) : left_.announced_frames();
}

Result<StereoVideo::Images> StereoVideo::read(std::int64_t number) {
  auto left = left_.read(number);
  if (!left) return failure(left);
  if (right_) {
    auto right = right_->read(number);
    if (!right) return failure(right);
    return Images{FrameImage::own(std::move(*left), PixelFormat()), FrameImage::own(std::move(*right), PixelFormat())};
  }
  const ImageSize one = size();
  const auto half = [&](int from) {
    Image<std::uint8_t> part(one.width, one.height);
    for (int y = 0; y < one.height; ++y) std::copy_n(&(*left)(from, y), one.width, &part(0, y));
    return FrameImage::own(std::move(part), PixelFormat());
  };
  return Images{half(0), half(one.width)};
}

}  // namespace spartan::internal
