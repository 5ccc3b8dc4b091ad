// Calibration files, and the check of a calibration by images.
#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/path_text.h"
#include "bindings/threads.h"
#include "spartan/calibration/pair_check.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/rig/describe.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

using Size = std::pair<int, int>;

ImageSize size_of(const std::optional<Size>& size) {
  return size ? ImageSize{size->first, size->second} : ImageSize{};
}

CalibrationFormat format_named(const std::string& name) {
  const auto format = calibration_format_named(name);
  if (format) return *format;
  std::string names;
  for (const auto each : calibration_format_names()) names += (names.empty() ? "" : ", ") + std::string(each);
  throw nb::value_error(fmt::format("format = '{}': must be one of {}", name, names).c_str());
}

LoadedRig read(const PathText& path, const std::optional<std::string>& format, const std::optional<Size>& size) {
  return value_of(format ? read_calibration_as(format_named(*format), path, size_of(size))
                         : read_calibration(path, size_of(size)));
}

// What the files do not represent, as they were read again before they were written.
std::vector<std::string> write(const Rig& rig, const PathText& path, const std::optional<std::string>& name) {
  const CalibrationFormat format = name ? format_named(*name) : value_of(calibration_format_for_path(path));
  const CalibrationFiles files = value_of(to_calibration_files(rig, format, path));
  const LoadedRig again = value_of(read_back(files, format, rig.cameras.empty() ? ImageSize{} : rig.cameras[0].size));
  check(write_calibration_files(files));
  std::vector<std::string> lost;
  for (const RigDifference& each : describe_differences(rig, again.rig)) lost.push_back(each.key + ": " + each.text);
  return lost;
}

using ImagePair = std::pair<AnyArray, AnyArray>;

PairInspection inspect(const Rig& rig, const std::vector<ImagePair>& frames, const std::optional<std::string>& name,
                       std::optional<int> threads) {
  const StereoPair* const pair = name ? rig.find_pair(*name) : rig.pairs.empty() ? nullptr : &rig.pairs.front();
  if (pair == nullptr) throw nb::key_error(name.value_or("the rig has no pair").c_str());
  std::vector<StereoViews> views;
  views.reserve(frames.size());
  for (const auto& [left, right] : frames)
    views.push_back({image_view<std::uint8_t>(left, "left"), image_view<std::uint8_t>(right, "right")});
  const ThreadPool workers = thread_pool(threads);
  const nb::gil_scoped_release free;
  return value_of(inspect_pair(rig, *pair, views, workers));
}

void bind_findings(nb::module_& m) {
  nb::class_<RigFinding>(m, "RigFinding", "A suspected error of a calibration.")
      .def_ro("id", &RigFinding::id, "`row_offset`, `yaw_offset`, `swapped_eyes` …: docs/reference/json.md.")
      .def_ro("text", &RigFinding::text, "What is suspicious, and what to check.")
      .def_ro("value", &RigFinding::value, "The quantity it is based on.")
      .def("__repr__", [](const RigFinding& f) { return fmt::format("<{}: {}>", f.id, f.text); });
  nb::class_<RowErrors>(m, "RowErrors", "Row errors (left - right) of matches, px.")
      .def_ro("mean_px", &RowErrors::mean_px, "Of the absolute values.")
      .def_ro("p95_px", &RowErrors::p95_px, "Of the absolute values.")
      .def_ro("median_px", &RowErrors::median_px, "Signed.")
      .def("__repr__",
           [](const RowErrors& e) { return fmt::format("<mean {:.3f}, p95 {:.3f} px>", e.mean_px, e.p95_px); });
  nb::class_<PairCorrection>(m, "PairCorrection", "A small correction of a stereo calibration.")
      .def_ro("pitch_rad", &PairCorrection::pitch_rad)
      .def_ro("yaw_rad", &PairCorrection::yaw_rad)
      .def_ro("roll_rad", &PairCorrection::roll_rad)
      .def_ro("focal_ratio", &PairCorrection::focal_ratio, "Factor on the focal length of the right camera.");
  nb::class_<PairInspection>(m, "CalibrationCheck", "What the images say about the calibration of a pair.")
      .def_prop_ro(
          "grade", [](const PairInspection& i) { return std::string(name_of(i.check.grade)); },
          "`good`, `usable` or `bad`.")
      .def_prop_ro("findings", [](const PairInspection& i) { return i.check.findings; })
      .def_prop_ro("matches", [](const PairInspection& i) { return i.check.matches; })
      .def_prop_ro("inliers", [](const PairInspection& i) { return i.check.inliers; })
      .def_prop_ro(
          "row_errors", [](const PairInspection& i) { return i.check.nominal_rows; }, "By the calibration as given.")
      .def_prop_ro("corrected_row_errors", [](const PairInspection& i) { return i.check.corrected_rows; })
      .def_prop_ro("correction", [](const PairInspection& i) { return i.check.correction; })
      .def_prop_ro(
          "sigma", [](const PairInspection& i) { return i.check.sigma; }, "Standard deviations of the correction.")
      .def_prop_ro(
          "corrected", [](const PairInspection& i) { return i.check.corrected; },
          "The rig with the findings corrected; None where nothing explains the images.")
      .def("__repr__", [](const PairInspection& i) {
        return fmt::format("<CalibrationCheck: {}, {} of {} matches, {} findings>", name_of(i.check.grade),
                           i.check.inliers, i.check.matches, i.check.findings.size());
      });
}

}  // namespace

void bind_calibrations(nb::module_& m) {
  bind_findings(m);
  nb::class_<LoadedRig>(m, "Calibration", "A rig as it was read from calibration files.")
      .def_ro("rig", &LoadedRig::rig)
      .def_prop_ro("format", [](const LoadedRig& r) { return std::string(name_of(r.format)); })
      .def_ro("files", &LoadedRig::files)
      .def_ro("notes", &LoadedRig::notes, "Decisions of the reader.")
      .def_prop_ro(
          "ignored",
          [](const LoadedRig& r) {
            std::vector<std::string> lines;
            lines.reserve(r.ignored.size());
            for (const RigDifference& each : r.ignored) lines.push_back(each.key + ": " + each.text);
            return lines;
          },
          "Content that a rig cannot represent.");
  m.def(
      "read_calibration", read, "path"_a, "format"_a = nb::none(), "size"_a = nb::none(),
      "Reads a calibration of any format (rig.yaml, KITTI, EuRoC, Kalibr, OpenCV, ROS, mrcal, CAHVOR …), detected from "
      "its "
      "name and content. `path`: a file, a folder, or \"LEFT,RIGHT\". `size`: (width, height) for formats without it.");
  m.def(
      "read_rig",
      [](const PathText& path, const std::optional<Size>& size) { return value_of(read_rig(path, size_of(size))); },
      "path"_a, "size"_a = nb::none(), "The rig of read_calibration().");
  m.def("write_calibration", write, "rig"_a, "path"_a, "format"_a = nb::none(),
        "Writes a rig in a format, chosen by the name of the file or given. Returns what the format does not "
        "represent, a line "
        "each.");
  m.def(
      "calibration_formats",
      [] {
        std::vector<std::string> names;
        for (const auto each : calibration_format_names()) names.emplace_back(each);
        return names;
      },
      "The names of all formats.");
  m.def("check_calibration", inspect, "rig"_a, "frames"_a, "pair"_a = nb::none(), nb::kw_only(),
        "threads"_a = nb::none(),
        nb::sig(
            "def check_calibration(rig: Rig, frames: collections.abc.Sequence[tuple[numpy.typing.NDArray[numpy.uint8], "
            "numpy.typing.NDArray[numpy.uint8]]], pair: str | None = None, *, threads: int | None = None) -> "
            "CalibrationCheck"),
        "Checks the calibration of a pair (the first one without a name) by its images, unrectified uint8 (left, "
        "right); 12 "
        "frames of different scenes are plenty.");
  m.def(
      "plausibility_findings",
      [](const Rig& rig, const std::string& name) {
        const StereoPair* const pair = rig.find_pair(name);
        if (pair == nullptr) throw nb::key_error(name.c_str());
        return plausibility_findings(rig, *pair);
      },
      "rig"_a, "pair"_a, "What is implausible about a pair by its numbers alone.");
}

}  // namespace spartan::python
