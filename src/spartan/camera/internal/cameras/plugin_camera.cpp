#include "spartan/camera/internal/cameras/plugin_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "spartan/camera/internal/cameras/camera_plugin.h"
#include "spartan/camera/internal/plugin_library.h"
#include "spartan/camera/recording.h"

namespace spartan::internal {
namespace {

using Message = std::array<char, 512>;

struct CameraPlugin {
  decltype(&spartan_camera_open) open = nullptr;
  decltype(&spartan_camera_read) read = nullptr;
  decltype(&spartan_camera_release) release = nullptr;
  decltype(&spartan_camera_properties) properties = nullptr;
  decltype(&spartan_camera_trigger) trigger = nullptr;
  decltype(&spartan_camera_set_exposure) set_exposure = nullptr;
  decltype(&spartan_camera_exposure_bounds) exposure_bounds = nullptr;
  decltype(&spartan_camera_close) close = nullptr;
};

Result<CameraPlugin> load_camera_plugin(bool aravis) {
  const auto library =
      aravis ? PluginLibrary::load("libspartan_aravis.so", "SPARTAN_ARAVIS", "GenICam cameras need",
                                   "install spartan-cameras (a plugin from another place needs libaravis-0.8-0)")
             : PluginLibrary::load(
                   "libspartan_gstreamer.so", "SPARTAN_GSTREAMER", "pipelines of GStreamer need",
                   "install spartan-cameras (a plugin from another place needs libgstreamer-plugins-base1.0-0)");
  if (!library) return failure(library);
  CameraPlugin plugin;
  for (const Status& found :
       {library->find("spartan_camera_open", plugin.open), library->find("spartan_camera_read", plugin.read),
        library->find("spartan_camera_release", plugin.release),
        library->find("spartan_camera_properties", plugin.properties),
        library->find("spartan_camera_trigger", plugin.trigger),
        library->find("spartan_camera_set_exposure", plugin.set_exposure),
        library->find("spartan_camera_exposure_bounds", plugin.exposure_bounds),
        library->find("spartan_camera_close", plugin.close)}) {
    if (!found) return failure(found);
  }
  return plugin;
}

// The pixels of an image, which go back to the plugin with the last copy. Rows that begin between two pixels of a row
// before, as those of RGB that are padded to four bytes, are copied.
template <class Pixel>
FrameImage frame_image(const SpartanCameraImage& image, std::shared_ptr<const void> owner, const PixelFormat& camera) {
  constexpr bool colour = std::is_same_v<Pixel, Rgb8> || std::is_same_v<Pixel, Rgb16>;
  PixelFormat format;
  format.layout = colour ? PixelLayout::rgb : PixelLayout::gray;
  format.bits = image.bytes_per_sample == 2 ? 16 : 8;
  constexpr auto pixel_bytes = static_cast<std::ptrdiff_t>(sizeof(Pixel));
  if (image.stride_bytes % pixel_bytes != 0) {
    Image<Pixel> pixels(image.width, image.height);
    for (int y = 0; y < image.height; ++y) {
      std::memcpy(pixels.row(y), static_cast<const char*>(image.pixels) + y * image.stride_bytes,
                  static_cast<std::size_t>(image.width * pixel_bytes));
    }
    return interpret(FrameImage::own(std::move(pixels), format), camera);
  }
  const ImageView<const Pixel> view(static_cast<const Pixel*>(image.pixels), image.width, image.height,
                                    image.stride_bytes / pixel_bytes);
  return interpret(FrameImage::share(view, format, std::move(owner)), camera);
}

class PluginCamera : public CameraDevice {
 public:
  PluginCamera(const CameraPlugin& plugin, void* handle, const DeviceRequest& request)
      : plugin_(plugin), handle_(handle), names_(request.names()) {
    for (const Camera* camera : request.cameras) formats_.push_back(camera->pixel_format);
  }
  ~PluginCamera() override { plugin_.close(handle_); }
  PluginCamera(const PluginCamera&) = delete;
  PluginCamera& operator=(const PluginCamera&) = delete;

  DeviceRead read(std::chrono::nanoseconds timeout) override;
  bool has_controls() const override { return (plugin_.properties(handle_) & SPARTAN_CAMERA_CONTROLS) != 0; }
  bool waits() const override { return (plugin_.properties(handle_) & SPARTAN_CAMERA_WAITS) != 0; }
  Status trigger() override {
    Message message{};
    return plugin_.trigger(handle_, message.data(), message.size()) != 0 ? Status() : refused(message);
  }
  Status set_exposure(const ExposureSettings& settings) override {
    Message message{};
    return plugin_.set_exposure(handle_, settings.exposure_us, settings.gain, message.data(), message.size()) != 0
               ? Status()
               : refused(message);
  }
  ExposureBounds exposure_bounds() const override;

 private:
  Status refused(const Message& message) const {
    return failure(ErrorCode::read_error, fmt::format("camera {}: {}", names_, message.data()));
  }
  CameraImage image_of(const SpartanCameraImage& image) const;

  CameraPlugin plugin_;
  void* handle_;
  std::string names_;
  std::vector<PixelFormat> formats_;
};

ExposureBounds PluginCamera::exposure_bounds() const {
  SpartanExposureBounds bounds{};
  if (plugin_.exposure_bounds(handle_, &bounds) == 0) return {};
  return {bounds.shortest_us, bounds.longest_us, bounds.smallest_gain, bounds.largest_gain};
}

DeviceRead PluginCamera::read(std::chrono::nanoseconds timeout) {
  SpartanCameraImage image{};
  Message message{};
  DeviceRead read;
  switch (plugin_.read(handle_, timeout.count(), &image, message.data(), message.size())) {
    case SPARTAN_CAMERA_IMAGE:
      read.state = DeviceRead::State::image;
      read.image = image_of(image);
      break;
    case SPARTAN_CAMERA_NONE_YET:
      read.state = DeviceRead::State::none_yet;
      break;
    case SPARTAN_CAMERA_END:
      read.state = DeviceRead::State::end;
      break;
    default:
      read.state = DeviceRead::State::lost;
      read.reason = message.data();
  }
  return read;
}

CameraImage PluginCamera::image_of(const SpartanCameraImage& image) const {
  CameraImage out;
  out.side = image.side;
  out.frame_id = image.frame_id;
  out.camera_ns = image.camera_ns;
  out.complete = std::chrono::steady_clock::now();
  out.began = std::chrono::steady_clock::time_point(std::chrono::nanoseconds(image.received_ns));
  out.exposure_us = image.exposure_us;
  out.gain = image.gain;
  std::shared_ptr<const void> owner(image.token, plugin_.release);
  if (image.pixels == nullptr) return out;
  const PixelFormat& format =
      formats_[std::min<std::size_t>(static_cast<std::size_t>(image.side), formats_.size() - 1)];
  const bool colour = image.channels == 3, wide = image.bytes_per_sample == 2;
  if (colour && wide) {
    out.image = frame_image<Rgb16>(image, std::move(owner), format);
  } else if (colour) {
    out.image = frame_image<Rgb8>(image, std::move(owner), format);
  } else if (wide) {
    out.image = frame_image<std::uint16_t>(image, std::move(owner), format);
  } else {
    out.image = frame_image<std::uint8_t>(image, std::move(owner), format);
  }
  return out;
}

}  // namespace

Result<std::unique_ptr<CameraDevice>> open_plugin_camera(const DeviceRequest& request) {
  const std::string& source = request.driver().source;
  const bool aravis = source.starts_with(kAravis);
  if (!aravis && !source.starts_with(kGStreamer)) {
    return failure(ErrorCode::configuration,
                   fmt::format("source '{}' of camera {} is of no known kind", source, request.names()), "",
                   "use aravis:ID or gst:PIPELINE");
  }
  const auto plugin = load_camera_plugin(aravis);
  if (!plugin) return failure(plugin);
  const std::string address = source.substr((aravis ? kAravis : kGStreamer).size());
  const Camera& camera = *request.cameras.front();
  const std::string layout(name_of(camera.pixel_format.layout));
  const SpartanCameraSettings settings{address.c_str(),
                                       static_cast<std::int32_t>(request.cameras.size()),
                                       camera.size.width,
                                       camera.size.height,
                                       camera.pixel_format.bits,
                                       layout.c_str(),
                                       camera.driver->trigger.c_str(),
                                       camera.driver->rate_hz};
  Message message{};
  void* const handle = plugin->open(&settings, message.data(), message.size());
  if (handle == nullptr) {
    return failure(ErrorCode::read_error, fmt::format("camera {} ({}): {}", request.names(), source, message.data()));
  }
  return std::make_unique<PluginCamera>(*plugin, handle, request);
}

}  // namespace spartan::internal
