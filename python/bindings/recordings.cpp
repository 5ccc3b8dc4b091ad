#include "bindings/recordings.h"

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/path_text.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {

nb::object object_of(Sample sample) {
  return std::visit([](auto&& each) { return nb::cast(std::forward<decltype(each)>(each)); }, std::move(sample));
}

namespace {

// Raises ValueError for a value out of bounds, and for NaN. 0 is allowed where it means that nothing is stated.
void check_range(const char* name, double value, double least, double most, bool or_zero) {
  if ((value >= least && value <= most) || (or_zero && value == 0)) return;
  const std::string text =
      fmt::format("{} = {}: must be {} to {}{}", name, value, least, most, or_zero ? ", or 0" : "");
  throw nb::value_error(text.c_str());
}

OpenOptions open_options(const std::optional<PathText>& rig, const std::optional<std::string>& format,
                         const std::optional<std::string>& left, const std::optional<std::string>& right,
                         const std::optional<PathText>& times, double fps, int bits, double pair_tolerance_s) {
  OpenOptions open;
  if (rig) open.rig_file = *rig;
  if (format) open.format = value_of(parse_recording_format(*format));
  open.left_images = left.value_or("");
  open.right_images = right.value_or("");
  if (times) open.times_file = *times;
  check_range("fps", fps, OpenOptions::kLeastFps, OpenOptions::kMostFps, true);
  check_range("bits", bits, OpenOptions::kLeastBits, OpenOptions::kMostBits, true);
  check_range("pair_tolerance_s", pair_tolerance_s, 0, OpenOptions::kMostPairTolerance_s, false);
  open.fps = fps;
  open.bits = bits;
  open.pair_tolerance_s = pair_tolerance_s;
  return open;
}

// Reads on from the position of the recording; one iterator at a time.
struct SampleIterator {
  RecordingValue* recording;
};

nb::object next_sample(SampleIterator& it) {
  auto sample = it.recording->stream.use([](auto& stream) { return value_of(stream->next()); });
  if (!sample) throw nb::stop_iteration();
  return object_of(std::move(*sample));
}

std::vector<std::string> remarks(const SequenceReport& sequence) {
  std::vector<std::string> all = sequence.warnings;
  all.insert(all.end(), sequence.remarks.begin(), sequence.remarks.end());
  return all;
}

}  // namespace

void bind_recordings(nb::module_& m) {
  nb::class_<SampleIterator>(m, "SampleIterator", "Samples of a recording in order of time.")
      .def("__iter__", [](const nb::handle& self) { return nb::borrow(self); })
      .def("__next__", next_sample,
           nb::sig("def __next__(self) -> StereoFrame | ImuSample | WheelSample | CompassSample | InclinometerSample | "
                   "MissingFrame"));
  nb::class_<RecordingValue>(
      m, "Recording",
      "Stereo frames and sensor samples of a recording in order of time, whatever its layout. Each "
      "iteration begins at the start; only the latest iterator may be used.")
      .def_prop_ro("rig", [](const RecordingValue& r) { return r.info->rig; })
      .def_prop_ro(
          "rig_source", [](const RecordingValue& r) { return r.info->rig_source; },
          "The file that the rig was read from; self-masks are relative to its folder.")
      .def_prop_ro("name", [](const RecordingValue& r) { return r.info->name; })
      .def_prop_ro("format", [](const RecordingValue& r) { return std::string(name_of(r.info->format)); })
      .def_prop_ro(
          "truth_file",
          [](const RecordingValue& r) -> std::optional<std::string> {
            const std::string& file = r.info->truth_file;
            return file.empty() ? std::nullopt : std::optional(file);
          },
          "Path of the true trajectory; None without one.")
      .def_prop_ro(
          "remarks", [](const RecordingValue& r) { return remarks(r.info->sequence); },
          "What is irregular or was assumed.")
      .def_prop_ro("description", [](const RecordingValue& r) { return r.info->description; })
      .def_prop_ro(
          "gravity_m_s2", [](const RecordingValue& r) { return r.info->gravity_m_s2; },
          "As the recording states it; None where it does not.")
      .def_prop_ro(
          "noise", [](const RecordingValue& r) { return r.info->noise; }, "Specified noise of the sensors.")
      .def(
          "stamps_ns",
          [](RecordingValue& r, const std::string& pair) {
            std::vector<std::int64_t> stamps;
            for (const Stamp& s : r.stream.use([&](auto& stream) { return stream->listed_stamps(pair); }))
              stamps.push_back(s.ns);
            return owned_array(std::move(stamps));
          },
          "pair"_a, "Stamps of the listed frames of a pair, int64, shape (n,).")
      .def(
          "frame_at",
          [](RecordingValue& r, const std::string& pair, std::int64_t stamp) {
            return r.stream.use([&](auto& stream) { return value_of(stream->frame_at(pair, Stamp{stamp})); });
          },
          "pair"_a, "stamp_ns"_a, "One frame, wherever the iteration is. Raises Error where there is none.")
      .def(
          "__iter__",
          [](RecordingValue& r) {
            check(r.stream.use([](auto& stream) { return stream->seek(0); }));
            return SampleIterator{&r};
          },
          nb::keep_alive<0, 1>())
      .def("__repr__", [](const RecordingValue& r) {
        const RecordingInfo& info = *r.info;
        return fmt::format("<Recording '{}' ({}): {} frames>", info.name, name_of(info.format),
                           info.sequence.announced);
      });
  nb::class_<OpenOptions>(m, "OpenOptions", "How to read a recording, see open_recording().")
      .def(
          "__init__",
          [](OpenOptions* self, const std::optional<PathText>& rig, const std::optional<std::string>& format,
             const std::optional<std::string>& left, const std::optional<std::string>& right,
             const std::optional<PathText>& times, double fps, int bits, double pair_tolerance_s) {
            new (self) OpenOptions(open_options(rig, format, left, right, times, fps, bits, pair_tolerance_s));
          },
          nb::kw_only(), "rig"_a = nb::none(), "format"_a = nb::none(), "left"_a = nb::none(), "right"_a = nb::none(),
          "times"_a = nb::none(), "fps"_a = 0.0, "bits"_a = 0, "pair_tolerance_s"_a = OpenOptions().pair_tolerance_s);
  m.def(
      "open_recording",
      [](const PathText& path, const std::optional<PathText>& rig, const std::optional<std::string>& format,
         const std::optional<std::string>& left, const std::optional<std::string>& right,
         const std::optional<PathText>& times, double fps, int bits, double pair_tolerance_s) {
        OpenOptions options = open_options(rig, format, left, right, times, fps, bits, pair_tolerance_s);
        options.unfinished = true;  // what a live run that was killed has recorded
        const nb::gil_scoped_release free;
        return std::make_unique<RecordingValue>(value_of(open_recording(path, options)));
      },
      "path"_a, nb::kw_only(), "rig"_a = nb::none(), "format"_a = nb::none(), "left"_a = nb::none(),
      "right"_a = nb::none(), "times"_a = nb::none(), "fps"_a = 0.0, "bits"_a = 0,
      "pair_tolerance_s"_a = OpenOptions().pair_tolerance_s,
      "Opens a folder or a video file; the layout (Spartan, KITTI, EuRoC, image folders …) is detected. `rig`: a "
      "calibration file to use instead of the recording's own. `left`, `right`: folders or patterns of file names of "
      "the images. `times`: file with the times of the frames, instead of the recording's own; `fps`: frames per "
      "second where there are none, 0.001 to 10000. `bits`: significant bits of a sample of 16-bit images, 9 to 16; 0: "
      "by the calibration or the images. `pair_tolerance_s`: largest difference of the stamps of left and right, 0 to "
      "1. A recording that is not finished has the frames that it has now.");
}

}  // namespace spartan::python
