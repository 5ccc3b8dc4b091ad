/* C interface of the plugins that deliver images of cameras: libspartan_aravis, libspartan_gstreamer. */
#pragma once

#include <cstddef>
#include <cstdint>

/// What the rig wants of a device. A text is valid during the call.
struct SpartanCameraSettings {
  const char* source;          // of the driver without its kind: "Vendor-Serial", "v4l2src ! …"
  std::int32_t cameras;        // 2: left and right behind one device
  std::int32_t width, height;  // of one image
  std::int32_t bits;           // significant bits of a sample, 8 to 16
  const char* layout;          // name_of(PixelLayout)
  const char* trigger;         // "free", "software", or an input of the camera
  double rate_hz;              // 0: as the camera is set
};

/// An image that the plugin keeps until spartan_camera_release().
struct SpartanCameraImage {
  const void* pixels;  // null: the image is not complete
  std::ptrdiff_t stride_bytes;
  std::int32_t width, height, bytes_per_sample, channels;
  std::int32_t side;         // 1: of the right camera of two
  std::int64_t frame_id;     // −1: none
  std::int64_t camera_ns;    // stamp of the camera's clock; −1: none
  std::int64_t received_ns;  // when the host received the beginning of it, of the steady clock
  double exposure_us, gain;  // 0: unknown
  void* token;               // for spartan_camera_release()
};

/// The settings that a camera takes. A gain is a factor.
struct SpartanExposureBounds {
  double shortest_us, longest_us;
  double smallest_gain, largest_gain;  // both 1: it has no gain
};

enum SpartanCameraState {
  SPARTAN_CAMERA_IMAGE = 0,
  SPARTAN_CAMERA_NONE_YET = 1,
  SPARTAN_CAMERA_END = 2,
  SPARTAN_CAMERA_LOST = 3
};

enum SpartanCameraProperty {
  SPARTAN_CAMERA_CONTROLS = 1,  // it can be triggered and its exposure set
  SPARTAN_CAMERA_WAITS = 2      // a file: images that are not read are not lost
};

extern "C" {
// A handle; null, with the reason in `message` (size bytes), where the device cannot be opened.
void* spartan_camera_open(const SpartanCameraSettings* settings, char* message, std::size_t size);
// One of SpartanCameraState; `message` of SPARTAN_CAMERA_LOST.
int spartan_camera_read(void* opened, std::int64_t timeout_ns, SpartanCameraImage* image, char* message,
                        std::size_t size);
// Gives the memory of an image back, from any thread, also after spartan_camera_close().
void spartan_camera_release(void* token);
// SpartanCameraProperty bits.
int spartan_camera_properties(void* opened);
// 1: done; 0, with the reason in `message`: not.
int spartan_camera_trigger(void* opened, char* message, std::size_t size);
int spartan_camera_set_exposure(void* opened, double exposure_us, double gain, char* message, std::size_t size);
// 1: `bounds` is filled; 0: the camera does not state them. They do not change while it is open.
int spartan_camera_exposure_bounds(void* opened, SpartanExposureBounds* bounds);
void spartan_camera_close(void* opened);
}
