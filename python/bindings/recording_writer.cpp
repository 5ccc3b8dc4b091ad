#include "spartan/camera/recording_writer.h"

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>

#include <memory>
#include <optional>
#include <string>

#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/guarded.h"
#include "bindings/option_classes.h"
#include "bindings/path_text.h"
#include "bindings/recordings.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

using WriterValue = Guarded<RecordingWriter>;

void start_recording(WriterValue* self, const PathText& folder, const Rig& rig, const std::string& name,
                     const std::string& description, double gravity, const SensorNoise* noise) {
  RecordingOptions options;
  options.name = name;
  options.description = description;
  options.gravity_m_s2 = gravity;
  if (noise != nullptr) options.noise = *noise;
  const nb::gil_scoped_release free;
  new (self) WriterValue(value_of(RecordingWriter::create_batched(folder, rig, options, ImageFiles::pnm)));
}

template <class AnySample>
void append(WriterValue& self, const AnySample& sample) {
  check(self.use([&](RecordingWriter& writer) { return writer.add(sample); }));
}

void finish_recording(WriterValue& self) {
  check(self.use([](RecordingWriter& writer) {
    Status synced = writer.sync();
    return synced ? writer.finish() : synced;
  }));
}

}  // namespace

void bind_recording_writer(nb::module_& m) {
  bind_option_class<ImuNoise>(m);
  bind_option_class<CompassNoise>(m);
  bind_option_class<InclinometerNoise>(m);
  nb::class_<SensorNoise>(m, "SensorNoise", "Specified noise of the sensors of a recording.")
      .def(nb::init<>())
      .def_rw("imu", &SensorNoise::imu)
      .def_rw("compass", &SensorNoise::compass)
      .def_rw("inclinometer", &SensorNoise::inclinometer);
  nb::class_<WriterValue>(m, "RecordingWriter",
                          "Writes a Spartan recording. Stamps must increase within each pair and each sensor.")
      .def("__init__", start_recording, "folder"_a, "rig"_a, nb::kw_only(), "name"_a = "", "description"_a = "",
           "gravity_m_s2"_a = 9.81, "noise"_a.none() = nb::none(),
           "Creates the folder; raises Error where it exists and is not empty.")
      .def("add", append<StereoFrame>, "sample"_a, "Appends a frame; raises Error where it does not fit the rig.")
      .def("add", append<ImuSample>, "sample"_a)
      .def("add", append<WheelSample>, "sample"_a)
      .def("add", append<CompassSample>, "sample"_a)
      .def("add", append<InclinometerSample>, "sample"_a)
      .def("finish", finish_recording, "Writes what is left; the recording is complete then.");
}

}  // namespace spartan::python
