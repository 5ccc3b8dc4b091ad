// A recording for Python, and samples of any type as objects of their own classes.
#pragma once

#include <nanobind/nanobind.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bindings/guarded.h"
#include "bindings/path_text.h"
#include "spartan/camera/recording.h"

namespace spartan::python {

/// An open recording that can be iterated several times. What `info` says does not change.
struct RecordingValue {
  explicit RecordingValue(std::unique_ptr<Recording> opened) : info(&opened->info()), stream(std::move(opened)) {}

  const RecordingInfo* info;
  Guarded<std::unique_ptr<Recording>> stream;
};

/// The sample as StereoFrame, ImuSample … or MissingFrame.
nanobind::object object_of(Sample sample);

}  // namespace spartan::python
