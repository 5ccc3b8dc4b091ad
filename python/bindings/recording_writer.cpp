#include "spartan/camera/recording_writer.h"

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

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

constexpr std::chrono::seconds kSyncEvery{1};

// Lists what was added every second, so that a program that ends without finish() leaves an unfinished recording.
class SyncingWriter {
 public:
  explicit SyncingWriter(RecordingWriter writer) : writer_(std::move(writer)) {}

  template <class AnySample>
  Status add(const AnySample& sample) {
    if (Status added = writer_.add(sample); !added) return added;
    return std::chrono::steady_clock::now() < next_sync_ ? Status() : sync();
  }
  Status sync() {
    Status synced = writer_.sync();
    next_sync_ = std::chrono::steady_clock::now() + kSyncEvery;
    return synced;
  }
  Status finish() { return writer_.finish(); }

 private:
  RecordingWriter writer_;
  std::chrono::steady_clock::time_point next_sync_ = std::chrono::steady_clock::now() + kSyncEvery;
};

using WriterValue = Guarded<SyncingWriter>;

void start_recording(WriterValue* self, const PathText& folder, const Rig& rig, const std::string& name,
                     const std::string& description, double gravity, const SensorNoise* noise) {
  RecordingOptions options;
  options.name = name;
  options.description = description;
  options.gravity_m_s2 = gravity;
  if (noise != nullptr) options.noise = *noise;
  const nb::gil_scoped_release free;
  new (self)
      WriterValue(SyncingWriter(value_of(RecordingWriter::create_batched(folder, rig, options, ImageFiles::pnm))));
}

template <class AnySample>
void append(WriterValue& self, const AnySample& sample) {
  check(self.use([&](SyncingWriter& writer) { return writer.add(sample); }));
}

void sync_recording(WriterValue& self) {
  check(self.use([](SyncingWriter& writer) { return writer.sync(); }));
}

void finish_recording(WriterValue& self) {
  check(self.use([](SyncingWriter& writer) { return writer.finish(); }));
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
      .def("sync", sync_recording,
           "Flushes what was added to the disk; done every second. A program that ends without finish() leaves an "
           "unfinished recording with the samples up to here.")
      .def("finish", finish_recording, "Writes what is left; the recording is complete then.");
}

}  // namespace spartan::python
