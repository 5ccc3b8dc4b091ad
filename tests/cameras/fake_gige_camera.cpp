// A GigE Vision camera without a camera: Aravis' own, with the images of a recording instead of its ramp.
//
//   fake_gige_camera INTERFACE SERIAL LOST_PACKETS [FOLDER EPOCH_NS RATE_HZ]
//
// LOST_PACKETS: share of the packets of images that are not sent. FOLDER: images that are shown one after the other and
// back again, RATE_HZ a second from EPOCH_NS of the steady clock on, so that several cameras show the same moment.
#include <arv.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "spartan/image_io/image_io.h"

namespace {

struct Scene {
  std::vector<std::string> files;
  std::int64_t epoch_ns = 0;
  double rate_hz = 10;
};

Scene scene_of(int count, char** arguments) {
  Scene scene;
  if (count < 7) return scene;
  for (const auto& entry : std::filesystem::directory_iterator(arguments[4])) scene.files.push_back(entry.path());
  std::sort(scene.files.begin(), scene.files.end());
  scene.epoch_ns = std::stoll(arguments[5]);
  scene.rate_hz = std::stod(arguments[6]);
  return scene;
}

// There and back again, so that no step is larger than one image.
std::size_t index_now(const Scene& scene) {
  const std::int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  const double step = static_cast<double>(now_ns - scene.epoch_ns) * 1e-9 * scene.rate_hz;
  const auto count = static_cast<std::int64_t>(scene.files.size());
  const std::int64_t period = std::max<std::int64_t>(1, 2 * (count - 1));
  const std::int64_t place = static_cast<std::int64_t>(std::max(0.0, step)) % period;
  return static_cast<std::size_t>(place < count ? place : period - place);
}

void fill(ArvBuffer* buffer, void* data, guint32, guint32, ArvPixelFormat) {
  const auto& scene = *static_cast<const Scene*>(data);
  const auto image = spartan::read_gray8(scene.files[index_now(scene)]);
  if (!image) {
    std::fprintf(stderr, "%s\n", image.error().message().c_str());
    std::abort();
  }
  auto* const out = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, nullptr)));
  const int width = std::min(image->width(), arv_buffer_get_image_width(buffer));
  const int height = std::min(image->height(), arv_buffer_get_image_height(buffer));
  for (int y = 0; y < height; ++y) {
    std::memcpy(out + static_cast<std::ptrdiff_t>(y) * arv_buffer_get_image_width(buffer), &(*image)(0, y),
                static_cast<std::size_t>(width));
  }
  // No two images of a sensor are equal.
  out[0] = static_cast<std::uint8_t>(arv_buffer_get_frame_id(buffer));
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 4) return 2;
  Scene scene = scene_of(count, arguments);
  auto* const camera = static_cast<ArvGvFakeCamera*>(g_object_new(ARV_TYPE_GV_FAKE_CAMERA, "interface-name",
                                                                  arguments[1], "serial-number", arguments[2],
                                                                  "gvsp-lost-ratio", std::atof(arguments[3]), nullptr));
  if (!arv_gv_fake_camera_is_running(camera)) {
    std::fprintf(stderr, "cannot listen at %s\n", arguments[1]);
    return 1;
  }
  if (!scene.files.empty()) arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera), fill, &scene);
  std::puts("ready");
  std::fflush(stdout);
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}
