// GenICam cameras over GigE Vision and USB3 Vision, through Aravis.
#include <arv.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "spartan/camera/internal/cameras/camera_plugin.h"

namespace {

constexpr int kFirstBuffers = 8, kFewestFree = 3;
constexpr unsigned kPacketWait_us = 60'000;
constexpr std::size_t kMostSettings = 16;

// An error of Aravis, freed at the end of its scope.
class CameraError {
 public:
  ~CameraError() { g_clear_error(&error_); }
  CameraError() = default;
  CameraError(const CameraError&) = delete;
  CameraError& operator=(const CameraError&) = delete;
  GError** out() {
    g_clear_error(&error_);
    return &error_;
  }
  bool is_set() const { return error_ != nullptr; }
  const char* text() const { return error_ == nullptr ? "failed" : error_->message; }

 private:
  GError* error_ = nullptr;
};

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};

// A buffer outside of its stream.
struct Token {
  ArvStream* stream;
  ArvBuffer* buffer;
};

// What the camera takes images with, from some time on.
struct Settings {
  std::int64_t since_ns = 0;
  double exposure_us = 0, gain = 1;
};

struct GenicamCamera {
  ~GenicamCamera();
  std::mutex mutex;  // of the camera's features, which Aravis does not guard
  std::unique_ptr<ArvCamera, Unref> camera;
  std::unique_ptr<ArvStream, Unref> stream;
  std::size_t payload = 0;
  std::atomic<bool> lost = false;
  std::mutex settings_mutex;                     // not held while the camera is waited for
  std::deque<Settings> settings = {Settings()};  // the newest one last
  SpartanExposureBounds bounds{};
  bool has_bounds = false;
};

GenicamCamera::~GenicamCamera() {
  if (stream) {
    g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera.get()), this);
    if (!lost) arv_camera_stop_acquisition(camera.get(), nullptr);
  }
}

void report(const std::string& text, char* message, std::size_t size) {
  std::snprintf(message, size, "%s", text.c_str());
}

void control_lost(ArvDevice*, gpointer data) {
  static_cast<GenicamCamera*>(data)->lost = true;
}

// The name of a pixel format whose samples lie at the low end of a byte or a 16-bit word.
std::string pixel_format_of(const SpartanCameraSettings& settings) {
  const std::string layout = settings.layout, bits = std::to_string(settings.bits);
  if (layout == "rgb") return "RGB" + bits;
  if (layout == "gray") return "Mono" + bits;
  std::string pattern = layout.substr(layout.find('_') + 1, 2);  // "rggb": RG
  std::transform(pattern.begin(), pattern.end(), pattern.begin(),
                 [](char c) { return static_cast<char>(c - 'a' + 'A'); });
  return "Bayer" + pattern + bits;
}

// An error of a step, with what was attempted.
bool failed(const CameraError& error, const std::string& what, std::string& why) {
  if (!error.is_set()) return false;
  why = what + ": " + error.text();
  return true;
}

bool set_image(ArvCamera* camera, const SpartanCameraSettings& settings, std::string& why) {
  CameraError error;
  const std::string format = pixel_format_of(settings);
  arv_camera_set_pixel_format_from_string(camera, format.c_str(), error.out());
  if (failed(error, "pixel format " + format + " (pixel_layout and bits of the rig)", why)) return false;
  arv_camera_set_region(camera, 0, 0, settings.width, settings.height, error.out());
  if (failed(error, "image size", why)) return false;
  gint x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera, &x, &y, &width, &height, error.out());
  if (failed(error, "image size", why)) return false;
  if (width != settings.width || height != settings.height) {
    why = "takes images of " + std::to_string(width) + " × " + std::to_string(height) + ", the rig has " +
          std::to_string(settings.width) + " × " + std::to_string(settings.height);
    return false;
  }
  return true;
}

bool set_trigger(ArvCamera* camera, const SpartanCameraSettings& settings, std::string& why) {
  CameraError error;
  const std::string trigger = settings.trigger;
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, error.out());
  if (failed(error, "continuous acquisition", why)) return false;
  if (trigger == "free") {
    arv_camera_clear_triggers(camera, error.out());
    if (failed(error, "no trigger", why)) return false;
    if (settings.rate_hz > 0) arv_camera_set_frame_rate(camera, settings.rate_hz, error.out());
    return !failed(error, "frame rate", why);
  }
  arv_camera_set_trigger(camera, trigger == "software" ? "Software" : trigger.c_str(), error.out());
  return !failed(error, "trigger " + trigger, why);
}

// GenICam states gains in decibel.
double factor_of(double gain_db) {
  return std::pow(10, gain_db / 20);
}

// Of a camera that counts its gain in whole numbers, the conversion to a factor and back must not give the one below.
double decibel_of(double gain) {
  constexpr double kResolution_db = 1e-6;
  return std::round(20 * std::log10(gain) / kResolution_db) * kResolution_db;
}

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

// What the camera does not tell stays as it was.
void read_exposure(GenicamCamera& device) {
  CameraError error;
  Settings settings = device.settings.back();
  ArvCamera* const camera = device.camera.get();
  if (arv_camera_is_exposure_time_available(camera, nullptr)) {
    const double exposure_us = arv_camera_get_exposure_time(camera, error.out());
    if (!error.is_set()) settings.exposure_us = exposure_us;
  }
  if (arv_camera_is_gain_available(camera, nullptr)) {
    const double gain_db = arv_camera_get_gain(camera, error.out());
    if (!error.is_set()) settings.gain = factor_of(gain_db);
  }
  const std::lock_guard lock(device.settings_mutex);
  settings.since_ns = now_ns();
  device.settings.push_back(settings);
  if (device.settings.size() > kMostSettings) device.settings.pop_front();
}

// Of an image whose first packet was here at this time, so that its exposure had ended: those that were set before its
// exposure began.
Settings settings_at(GenicamCamera& device, std::int64_t received_ns) {
  const std::lock_guard lock(device.settings_mutex);
  const auto found = std::find_if(device.settings.rbegin(), device.settings.rend(), [&](const Settings& settings) {
    return settings.since_ns <= received_ns - std::llround(1e3 * settings.exposure_us);
  });
  return found == device.settings.rend() ? device.settings.front() : *found;
}

void read_bounds(GenicamCamera& device) {
  CameraError error;
  ArvCamera* const camera = device.camera.get();
  SpartanExposureBounds& bounds = device.bounds;
  arv_camera_get_exposure_time_bounds(camera, &bounds.shortest_us, &bounds.longest_us, error.out());
  if (error.is_set()) return;
  bounds.smallest_gain = bounds.largest_gain = 1;
  if (arv_camera_is_gain_available(camera, nullptr)) {
    double least_db = 0, most_db = 0;
    arv_camera_get_gain_bounds(camera, &least_db, &most_db, error.out());
    if (error.is_set()) return;
    bounds.smallest_gain = factor_of(least_db);
    bounds.largest_gain = factor_of(most_db);
  }
  device.has_bounds = true;
}

bool start(GenicamCamera& device, const SpartanCameraSettings& settings, std::string& why) {
  CameraError error;
  ArvCamera* const camera = device.camera.get();
  if (!set_image(camera, settings, why) || !set_trigger(camera, settings, why)) return false;
  read_exposure(device);
  read_bounds(device);
  // The largest packets that the network takes: fewer of them, and fewer that can be lost.
  if (arv_camera_is_gv_device(camera)) arv_camera_gv_auto_packet_size(camera, nullptr);
  device.payload = arv_camera_get_payload(camera, error.out());
  if (failed(error, "payload", why)) return false;
  device.stream.reset(arv_camera_create_stream(camera, nullptr, nullptr, error.out()));
  if (failed(error, "stream", why) || !device.stream) return false;
  // What has not come by then was lost; an image that waits for it longer would come after the next one.
  if (ARV_IS_GV_STREAM(device.stream.get()))
    g_object_set(device.stream.get(), "frame-retention", kPacketWait_us, nullptr);
  for (int i = 0; i < kFirstBuffers; ++i)
    arv_stream_push_buffer(device.stream.get(), arv_buffer_new_allocate(device.payload));
  g_signal_connect(arv_camera_get_device(camera), "control-lost", G_CALLBACK(control_lost), &device);
  arv_camera_start_acquisition(camera, error.out());
  return !failed(error, "start", why);
}

// When the first packet of an image was here.
std::int64_t received_ns(ArvBuffer* buffer) {
  const auto received = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
  const std::int64_t age_ns = std::max<std::int64_t>(0, g_get_real_time() * 1000 - received);
  return now_ns() - age_ns;
}

void describe(GenicamCamera& device, ArvBuffer* buffer, SpartanCameraImage& image) {
  image = {};
  image.frame_id = static_cast<std::int64_t>(arv_buffer_get_frame_id(buffer));
  image.camera_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
  image.received_ns = received_ns(buffer);
  const Settings settings = settings_at(device, image.received_ns);
  image.exposure_us = settings.exposure_us;
  image.gain = settings.gain;
  if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS) {
    // What is known of an image without its first packet is not of this image.
    if (image.camera_ns <= 0) image.camera_ns = -1;
    return;
  }
  std::size_t size = 0;
  image.pixels = arv_buffer_get_image_data(buffer, &size);
  image.width = arv_buffer_get_image_width(buffer);
  image.height = arv_buffer_get_image_height(buffer);
  const auto bits = static_cast<int>(ARV_PIXEL_FORMAT_BIT_PER_PIXEL(arv_buffer_get_image_pixel_format(buffer)));
  image.channels = bits % 24 == 0 ? 3 : 1;
  image.bytes_per_sample = bits / 8 / image.channels;
  image.stride_bytes = static_cast<std::ptrdiff_t>(image.width) * bits / 8;
  if (size < static_cast<std::size_t>(image.stride_bytes) * static_cast<std::size_t>(image.height))
    image.pixels = nullptr;
}

}  // namespace

void* spartan_camera_open(const SpartanCameraSettings* settings, char* message, std::size_t size) {
  auto device = std::make_unique<GenicamCamera>();
  CameraError error;
  if (settings->cameras != 1) {
    report("is one camera, but both of a pair name it", message, size);
    return nullptr;
  }
  arv_update_device_list();
  device->camera.reset(arv_camera_new(settings->source, error.out()));
  std::string why;
  if (!device->camera) {
    report(std::string(error.text()) + "; `arv-tool-0.8` lists the cameras that answer", message, size);
    return nullptr;
  }
  if (!start(*device, *settings, why)) {
    report(why, message, size);
    return nullptr;
  }
  return device.release();
}

int spartan_camera_read(void* opened, std::int64_t timeout_ns, SpartanCameraImage* image, char* message,
                        std::size_t size) {
  auto& device = *static_cast<GenicamCamera*>(opened);
  ArvStream* const stream = device.stream.get();
  ArvBuffer* const buffer =
      arv_stream_timeout_pop_buffer(stream, static_cast<guint64>(std::max<std::int64_t>(timeout_ns, 0) / 1000));
  if (buffer == nullptr) {
    if (!device.lost) return SPARTAN_CAMERA_NONE_YET;
    report("no longer answers", message, size);
    return SPARTAN_CAMERA_LOST;
  }
  // Whoever keeps images long gets more of them, instead of gaps.
  gint free = 0, filled = 0;
  arv_stream_get_n_buffers(stream, &free, &filled);
  for (; free < kFewestFree; ++free) arv_stream_push_buffer(stream, arv_buffer_new_allocate(device.payload));
  describe(device, buffer, *image);
  image->token = new Token{ARV_STREAM(g_object_ref(stream)), buffer};
  return SPARTAN_CAMERA_IMAGE;
}

void spartan_camera_release(void* token) {
  const std::unique_ptr<Token> used(static_cast<Token*>(token));
  if (!used) return;
  arv_stream_push_buffer(used->stream, used->buffer);
  g_object_unref(used->stream);
}

int spartan_camera_properties(void*) {
  return SPARTAN_CAMERA_CONTROLS;
}

int spartan_camera_trigger(void* opened, char* message, std::size_t size) {
  auto& device = *static_cast<GenicamCamera*>(opened);
  CameraError error;
  const std::lock_guard lock(device.mutex);
  arv_camera_software_trigger(device.camera.get(), error.out());
  if (error.is_set()) report(std::string("trigger: ") + error.text(), message, size);
  return error.is_set() ? 0 : 1;
}

int spartan_camera_set_exposure(void* opened, double exposure_us, double gain, char* message, std::size_t size) {
  auto& device = *static_cast<GenicamCamera*>(opened);
  CameraError error;
  const std::lock_guard lock(device.mutex);
  ArvCamera* const camera = device.camera.get();
  if (arv_camera_is_exposure_auto_available(camera, nullptr))
    arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, nullptr);
  if (arv_camera_is_gain_auto_available(camera, nullptr)) arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, nullptr);
  std::string why;
  arv_camera_set_exposure_time(camera, exposure_us, error.out());
  failed(error, "exposure time", why);
  if (arv_camera_is_gain_available(camera, nullptr)) {
    arv_camera_set_gain(camera, decibel_of(gain), error.out());
    failed(error, "gain", why);
  }
  // Also where it refuses one of them, so that images state what they are taken with.
  read_exposure(device);
  report(why, message, size);
  return why.empty() ? 1 : 0;
}

int spartan_camera_exposure_bounds(void* opened, SpartanExposureBounds* bounds) {
  const auto& device = *static_cast<const GenicamCamera*>(opened);
  *bounds = device.bounds;
  return device.has_bounds ? 1 : 0;
}

void spartan_camera_close(void* opened) {
  delete static_cast<GenicamCamera*>(opened);
}
