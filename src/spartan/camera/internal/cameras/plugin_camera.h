// Cameras behind plugins: `aravis:` and `gst:`.
#pragma once

#include <memory>
#include <string_view>

#include "spartan/camera/internal/cameras/camera_device.h"
#include "spartan/camera/internal/cameras/image_source.h"
#include "spartan/core/result.h"

namespace spartan::internal {

constexpr std::string_view kAravis = "aravis:", kGStreamer = "gst:";

/// Opens the source of a driver, see docs/reference/rig.md. Codes: `configuration` (no such kind of source, or no
/// plugin for it), `read_error` (the device cannot be opened).
Result<std::unique_ptr<CameraDevice>> open_plugin_camera(const DeviceRequest& request);

}  // namespace spartan::internal
