// Cameras behind a pipeline of GStreamer: V4L2 and UVC, RTSP, video files.
#include <gst/app/gstappsink.h>
#include <gst/base/gstbasesrc.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "spartan/camera/internal/cameras/camera_plugin.h"

namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

constexpr std::size_t kMostQueued = 16;  // samples that no call of read() has taken
constexpr GstClockTime kOpenTimeout = 10 * GST_SECOND;

struct UnrefGst {
  void operator()(gpointer object) const { gst_object_unref(object); }
};

// The pixels of a sample, mapped until the last image of them is released.
class MappedSample {
 public:
  explicit MappedSample(GstSample* sample);
  ~MappedSample();
  MappedSample(const MappedSample&) = delete;
  MappedSample& operator=(const MappedSample&) = delete;

  const std::uint8_t* pixels = nullptr;  // null: of a format that cannot be read
  std::ptrdiff_t stride_bytes = 0;
  int width = 0, height = 0, bytes_per_sample = 1, channels = 1;

 private:
  bool map_video(GstCaps* caps, GstBuffer* buffer);
  bool map_bayer(GstCaps* caps, GstBuffer* buffer);
  GstSample* sample_;
  std::optional<GstVideoFrame> frame_;
  std::optional<GstMapInfo> map_;
};

MappedSample::MappedSample(GstSample* sample) : sample_(sample) {
  GstCaps* const caps = gst_sample_get_caps(sample);
  GstBuffer* const buffer = gst_sample_get_buffer(sample);
  if (caps != nullptr && buffer != nullptr && !map_video(caps, buffer)) map_bayer(caps, buffer);
}

MappedSample::~MappedSample() {
  if (frame_) gst_video_frame_unmap(&*frame_);
  if (map_) gst_buffer_unmap(gst_sample_get_buffer(sample_), &*map_);
  gst_sample_unref(sample_);
}

bool MappedSample::map_video(GstCaps* caps, GstBuffer* buffer) {
  GstVideoInfo info{};
  GstVideoFrame frame{};
  // Bayer images have caps that are understood and a format that is not.
  const bool raw = gst_video_info_from_caps(&info, caps) && GST_VIDEO_INFO_FORMAT(&info) != GST_VIDEO_FORMAT_ENCODED &&
                   GST_VIDEO_INFO_FORMAT(&info) != GST_VIDEO_FORMAT_UNKNOWN;
  if (!raw || !gst_video_frame_map(&frame, &info, buffer, GST_MAP_READ)) return false;
  frame_ = frame;
  pixels = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&*frame_, 0));
  stride_bytes = GST_VIDEO_FRAME_PLANE_STRIDE(&*frame_, 0);
  width = GST_VIDEO_FRAME_WIDTH(&*frame_);
  height = GST_VIDEO_FRAME_HEIGHT(&*frame_);
  channels = GST_VIDEO_FRAME_N_COMPONENTS(&*frame_) == 3 ? 3 : 1;
  bytes_per_sample = GST_VIDEO_FRAME_COMP_PSTRIDE(&*frame_, 0) / channels;
  return true;
}

// Lines of Bayer images begin at multiples of four bytes.
bool MappedSample::map_bayer(GstCaps* caps, GstBuffer* buffer) {
  const GstStructure* const structure = gst_caps_get_structure(caps, 0);
  if (!gst_structure_get_int(structure, "width", &width) || !gst_structure_get_int(structure, "height", &height))
    return false;
  GstMapInfo map;
  if (!gst_buffer_map(buffer, &map, GST_MAP_READ)) return false;
  map_ = map;
  stride_bytes = GST_ROUND_UP_4(width);
  if (map.size >= static_cast<std::size_t>(stride_bytes) * static_cast<std::size_t>(height)) pixels = map.data;
  return true;
}

struct QueuedSample {
  GstSample* sample;
  int side;
  SteadyTime received;
};

struct CameraPipeline {
  ~CameraPipeline();
  std::unique_ptr<GstElement, UnrefGst> pipeline;
  std::unique_ptr<GstBus, UnrefGst> bus;
  int cameras = 1, sinks = 0;
  bool live = false;

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<QueuedSample> queue;
  bool closing = false;
  int ended = 0;  // sinks

  std::optional<SpartanCameraImage> right;  // the other half of the image before
};

struct Token {
  std::shared_ptr<const MappedSample> sample;
};

CameraPipeline::~CameraPipeline() {
  {
    const std::lock_guard lock(mutex);
    closing = true;
  }
  changed.notify_all();
  if (pipeline) gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  for (const QueuedSample& waiting : queue) gst_sample_unref(waiting.sample);
  if (right) spartan_camera_release(right->token);
}

void report(const std::string& text, char* message, std::size_t size) {
  std::snprintf(message, size, "%s", text.c_str());
}

// Samples of a file wait, those of a camera push the oldest one out.
GstFlowReturn take_sample(GstAppSink* sink, CameraPipeline& opened, int side) {
  GstSample* const sample = gst_app_sink_pull_sample(sink);
  if (sample == nullptr) return GST_FLOW_EOS;
  const auto now = std::chrono::steady_clock::now();
  std::unique_lock lock(opened.mutex);
  if (!opened.live) {
    opened.changed.wait(lock, [&] { return opened.queue.size() < kMostQueued || opened.closing; });
  } else if (opened.queue.size() >= kMostQueued) {
    gst_sample_unref(opened.queue.front().sample);
    opened.queue.pop_front();
  }
  opened.queue.push_back({sample, side, now});
  opened.changed.notify_all();
  return GST_FLOW_OK;
}

template <int side>
GstFlowReturn new_sample(GstAppSink* sink, gpointer data) {
  return take_sample(sink, *static_cast<CameraPipeline*>(data), side);
}

void end_of_stream(GstAppSink*, gpointer data) {
  auto& opened = *static_cast<CameraPipeline*>(data);
  const std::lock_guard lock(opened.mutex);
  ++opened.ended;
  opened.changed.notify_all();
}

// What the sinks take: 8 or 16 bits of gray, RGB, or the Bayer layout of the rig.
std::string caps_of(const SpartanCameraSettings& settings) {
  const std::string layout = settings.layout;
  if (layout == "rgb") return "video/x-raw,format=RGB";
  if (layout != "gray") return "video/x-bayer,format=" + layout.substr(layout.find('_') + 1);
  return settings.bits > 8 ? "video/x-raw,format=GRAY16_LE" : "video/x-raw,format=GRAY8";
}

void connect(CameraPipeline& opened, GstElement* sink, int side, const std::string& caps_text) {
  std::unique_ptr<GstCaps, void (*)(GstCaps*)> caps(gst_caps_from_string(caps_text.c_str()),
                                                    [](GstCaps* c) { gst_caps_unref(c); });
  gst_app_sink_set_caps(GST_APP_SINK(sink), caps.get());
  GstAppSinkCallbacks callbacks{};
  callbacks.new_sample = side == 0 ? new_sample<0> : new_sample<1>;
  callbacks.eos = end_of_stream;
  gst_app_sink_set_callbacks(GST_APP_SINK(sink), &callbacks, &opened, nullptr);
  ++opened.sinks;
}

// The sinks `left` and `right`, or the only one.
bool connect_sinks(CameraPipeline& opened, const SpartanCameraSettings& settings, std::string& why) {
  GstBin* const bin = GST_BIN(opened.pipeline.get());
  const std::string caps = caps_of(settings);
  const std::unique_ptr<GstElement, UnrefGst> left(gst_bin_get_by_name(bin, "left"));
  const std::unique_ptr<GstElement, UnrefGst> right(gst_bin_get_by_name(bin, "right"));
  const auto is_sink = [](const auto& element) { return element && GST_IS_APP_SINK(element.get()); };
  if (!is_sink(left) || (right && !is_sink(right))) {
    why = "has no appsink named left";
    return false;
  }
  if (right && settings.cameras == 1) {
    why = "has two sinks, but only one camera names it";
    return false;
  }
  connect(opened, left.get(), 0, caps);
  if (right) connect(opened, right.get(), 1, caps);
  return true;
}

// The error on the bus; empty: none.
std::string error_on_bus(CameraPipeline& opened) {
  const std::unique_ptr<GstMessage, void (*)(GstMessage*)> found(
      gst_bus_pop_filtered(opened.bus.get(), GST_MESSAGE_ERROR), [](GstMessage* m) {
        if (m != nullptr) gst_message_unref(m);
      });
  if (!found) return "";
  GError* error = nullptr;
  gst_message_parse_error(found.get(), &error, nullptr);
  std::string text = error->message;
  g_error_free(error);
  return text;
}

// Whether images come from a camera or over a network. A file at the pace of its stamps makes a pipeline live, too.
bool has_live_source(const CameraPipeline& opened) {
  const auto note = [](const GValue* element, gpointer found) {
    GObject* const object = G_OBJECT(g_value_get_object(element));
    if (GST_IS_BASE_SRC(object) && gst_base_src_is_live(GST_BASE_SRC(object))) *static_cast<bool*>(found) = true;
  };
  bool found = false;
  GstIterator* const elements = gst_bin_iterate_recurse(GST_BIN(opened.pipeline.get()));
  while (gst_iterator_foreach(elements, note, &found) == GST_ITERATOR_RESYNC) gst_iterator_resync(elements);
  gst_iterator_free(elements);
  return found;
}

// Why a live pipeline no longer has the images of both cameras; empty: it has. The end of one stream is a loss, too: a
// camera has no last image, and its pipeline can be opened again. Images that wait are lost with it.
std::string loss_of(CameraPipeline& opened) {
  std::string why = error_on_bus(opened);
  if (!why.empty()) return why;
  {
    const std::lock_guard lock(opened.mutex);
    if (opened.ended == 0) return "";
  }
  return has_live_source(opened) ? "its stream has ended" : "";
}

bool start(CameraPipeline& opened, std::string& why) {
  GstElement* const pipeline = opened.pipeline.get();
  GstStateChangeReturn change = gst_element_set_state(pipeline, GST_STATE_PAUSED);
  if (change == GST_STATE_CHANGE_ASYNC) change = gst_element_get_state(pipeline, nullptr, nullptr, kOpenTimeout);
  opened.live = change == GST_STATE_CHANGE_NO_PREROLL;
  if (change == GST_STATE_CHANGE_SUCCESS || opened.live) {
    // What a camera delivers need not wait for its time.
    for (const char* name : {"left", "right"}) {
      const std::unique_ptr<GstElement, UnrefGst> sink(gst_bin_get_by_name(GST_BIN(pipeline), name));
      if (sink && opened.live) g_object_set(sink.get(), "sync", FALSE, nullptr);
    }
    if (gst_element_set_state(pipeline, GST_STATE_PLAYING) != GST_STATE_CHANGE_FAILURE) return true;
  }
  why = error_on_bus(opened);
  if (why.empty()) why = change == GST_STATE_CHANGE_ASYNC ? "delivers no image within 10 s" : "cannot be started";
  return false;
}

int deliver(CameraPipeline& opened, const QueuedSample& taken, SpartanCameraImage& image) {
  const GstBuffer* const buffer = gst_sample_get_buffer(taken.sample);
  image = {};
  image.side = taken.side;
  image.frame_id = GST_BUFFER_OFFSET_IS_VALID(buffer) ? static_cast<std::int64_t>(GST_BUFFER_OFFSET(buffer)) : -1;
  image.camera_ns = GST_BUFFER_PTS_IS_VALID(buffer) ? static_cast<std::int64_t>(GST_BUFFER_PTS(buffer)) : -1;
  image.received_ns = taken.received.time_since_epoch() / std::chrono::nanoseconds(1);
  const auto sample = std::make_shared<const MappedSample>(taken.sample);
  image.pixels = sample->pixels;
  image.stride_bytes = sample->stride_bytes;
  image.width = sample->width;
  image.height = sample->height;
  image.bytes_per_sample = sample->bytes_per_sample;
  image.channels = sample->channels;
  image.token = new Token{sample};
  if (opened.cameras == 2 && opened.sinks == 1) {
    image.width /= 2;
    SpartanCameraImage right = image;
    right.side = 1;
    const auto half = static_cast<std::ptrdiff_t>(image.width) * image.bytes_per_sample * image.channels;
    if (sample->pixels != nullptr) right.pixels = sample->pixels + half;
    right.token = new Token{sample};
    opened.right = right;
  }
  return SPARTAN_CAMERA_IMAGE;
}

}  // namespace

void* spartan_camera_open(const SpartanCameraSettings* settings, char* message, std::size_t size) {
  GError* error = nullptr;
  if (!gst_init_check(nullptr, nullptr, &error)) {
    report(error->message, message, size);
    g_error_free(error);
    return nullptr;
  }
  auto opened = std::make_unique<CameraPipeline>();
  opened->cameras = settings->cameras;
  std::string description = settings->source;
  if (description.find("appsink") == std::string::npos) description += " ! videoconvert ! appsink name=left";
  opened->pipeline.reset(gst_parse_launch_full(description.c_str(), nullptr, GST_PARSE_FLAG_FATAL_ERRORS, &error));
  if (error != nullptr || !GST_IS_PIPELINE(opened->pipeline.get())) {
    report(error != nullptr ? error->message : "is not a pipeline", message, size);
    g_clear_error(&error);
    return nullptr;
  }
  opened->bus.reset(gst_element_get_bus(opened->pipeline.get()));
  std::string why;
  if (connect_sinks(*opened, *settings, why) && start(*opened, why)) return opened.release();
  report(why, message, size);
  return nullptr;
}

int spartan_camera_read(void* opened, std::int64_t timeout_ns, SpartanCameraImage* image, char* message,
                        std::size_t size) {
  auto& pipeline = *static_cast<CameraPipeline*>(opened);
  if (pipeline.right) {
    *image = *pipeline.right;
    pipeline.right.reset();
    return SPARTAN_CAMERA_IMAGE;
  }
  // At each call: where one of two cameras is lost, the other one goes on and always has an image.
  if (pipeline.live) {
    const std::string why = loss_of(pipeline);
    if (!why.empty()) {
      report(why, message, size);
      return SPARTAN_CAMERA_LOST;
    }
  }
  std::unique_lock lock(pipeline.mutex);
  pipeline.changed.wait_for(lock, std::chrono::nanoseconds(timeout_ns),
                            [&] { return !pipeline.queue.empty() || pipeline.ended == pipeline.sinks; });
  if (!pipeline.queue.empty()) {
    const QueuedSample taken = pipeline.queue.front();
    pipeline.queue.pop_front();
    pipeline.changed.notify_all();
    lock.unlock();
    return deliver(pipeline, taken, *image);
  }
  const bool ended = pipeline.ended == pipeline.sinks;
  lock.unlock();
  // That of a camera is a loss, which the next call reports.
  if (ended) return has_live_source(pipeline) ? SPARTAN_CAMERA_NONE_YET : SPARTAN_CAMERA_END;
  const std::string why = error_on_bus(pipeline);
  if (why.empty()) return SPARTAN_CAMERA_NONE_YET;
  report(why, message, size);
  return SPARTAN_CAMERA_LOST;
}

void spartan_camera_release(void* token) {
  delete static_cast<Token*>(token);
}

int spartan_camera_properties(void* opened) {
  return static_cast<CameraPipeline*>(opened)->live ? 0 : SPARTAN_CAMERA_WAITS;
}

int spartan_camera_trigger(void*, char* message, std::size_t size) {
  report("a pipeline cannot be triggered", message, size);
  return 0;
}

int spartan_camera_set_exposure(void*, double, double, char* message, std::size_t size) {
  report("the exposure of a pipeline cannot be set", message, size);
  return 0;
}

int spartan_camera_exposure_bounds(void*, SpartanExposureBounds*) {
  return 0;
}

void spartan_camera_close(void* opened) {
  delete static_cast<CameraPipeline*>(opened);
}
