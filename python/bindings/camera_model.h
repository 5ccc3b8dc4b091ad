// A camera model as a type of its own: nanobind would hand out what a plain std::variant holds.
#pragma once

#include "spartan/rig/models/camera_model.h"

namespace spartan::python {

struct CameraModelValue {
  CameraModel model;
};

}  // namespace spartan::python
