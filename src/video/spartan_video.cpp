#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "spartan/camera/internal/video_plugin.h"

namespace {

struct Handle {
  cv::VideoCapture capture;
  int width = 0, height = 0;
};

}  // namespace

void* spartan_video_open(const char* path, SpartanVideoInfo* info) {
  try {
    auto handle = std::make_unique<Handle>();
    if (!handle->capture.open(path)) return nullptr;
    const auto property = [&](int id) {
      const double value = handle->capture.get(id);
      return std::isfinite(value) && value > 0 ? value : 0;
    };
    handle->width = static_cast<int>(property(cv::CAP_PROP_FRAME_WIDTH));
    handle->height = static_cast<int>(property(cv::CAP_PROP_FRAME_HEIGHT));
    if (handle->width < 1 || handle->height < 1) return nullptr;
    *info = {handle->width, handle->height, property(cv::CAP_PROP_FPS),
             static_cast<std::int64_t>(property(cv::CAP_PROP_FRAME_COUNT))};
    return handle.release();
  } catch (const std::exception&) {
    return nullptr;
  }
}

int spartan_video_next(void* opened, std::uint8_t* gray, std::ptrdiff_t stride) {
  auto& handle = *static_cast<Handle*>(opened);
  try {
    if (gray == nullptr) return handle.capture.grab() ? 1 : 0;
    cv::Mat frame;
    if (!handle.capture.read(frame) || frame.cols != handle.width || frame.rows != handle.height) return 0;
    cv::Mat out(handle.height, handle.width, CV_8U, gray, static_cast<std::size_t>(stride));
    if (frame.channels() == 1) {
      frame.convertTo(out, CV_8U);
    } else {
      cv::cvtColor(frame, out, frame.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
    }
    return 1;
  } catch (const std::exception&) {
    return 0;
  }
}

void spartan_video_close(void* handle) {
  delete static_cast<Handle*>(handle);
}
