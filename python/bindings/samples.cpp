#include "spartan/camera/samples.h"

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>
#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/frame_images.h"
#include "bindings/pixel_format.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

// Where and when a frame was taken, beside its images.
struct FrameDetails {
  std::int64_t frame_id, position_id;
  double pan_rad, tilt_rad, exposure_us, gain;
};

StereoFrame make_frame(const AnyArray& left, const AnyArray& right, std::int64_t left_stamp,
                       const std::optional<std::int64_t>& right_stamp, const std::string& pair,
                       const std::string& layout, std::optional<int> bits, const std::string& alignment,
                       const FrameDetails& details) {
  StereoFrame frame;
  frame.frame_id = details.frame_id;
  frame.position_id = details.position_id;
  frame.pair = pair;
  frame.left_stamp = {left_stamp};
  frame.right_stamp = {right_stamp.value_or(left_stamp)};
  frame.left = image_of_array(left, layout, bits, alignment, "left");
  frame.right = image_of_array(right, layout, bits, alignment, "right");
  frame.pan_rad = details.pan_rad;
  frame.tilt_rad = details.tilt_rad;
  frame.exposure_us = details.exposure_us;
  frame.gain = details.gain;
  return frame;
}

// Of both images; one of them may be missing.
const PixelFormat& format_of(const StereoFrame& frame) {
  return (frame.left.empty() ? frame.right : frame.left).format();
}

void bind_frames(nb::module_& m) {
  nb::class_<StereoFrame>(m, "StereoFrame", "One synchronous capture of a stereo pair.")
      .def(
          "__init__",
          [](StereoFrame* self, const AnyArray& left, const AnyArray& right, std::int64_t stamp,
             const std::optional<std::int64_t>& right_stamp, const std::string& pair, const std::string& layout,
             std::optional<int> bits, const std::string& alignment, std::int64_t frame_id, std::int64_t position_id,
             double pan, double tilt, double exposure, double gain) {
            new (self) StereoFrame(make_frame(left, right, stamp, right_stamp, pair, layout, bits, alignment,
                                              {frame_id, position_id, pan, tilt, exposure, gain}));
          },
          "left"_a, "right"_a, "stamp_ns"_a, "right_stamp_ns"_a = nb::none(), nb::kw_only(), "pair"_a,
          "layout"_a = "gray", "bits"_a = nb::none(), "alignment"_a = "low", "frame_id"_a = 0, "position_id"_a = -1,
          "pan_rad"_a = 0.0, "tilt_rad"_a = 0.0, "exposure_us"_a = 0.0, "gain"_a = 0.0,
          "Images of shape (height, width) for the layout `gray` and Bayer patterns (`bayer_rggb` …), (height, width, "
          "3) for "
          "`rgb`; uint8 or uint16, of which `bits` are significant: the least significant ones of a sample, or the "
          "most significant ones with the `alignment` `high`. They are not copied: they must not be changed while the "
          "frame is in use. Stamps: nanoseconds, middle of the exposure. `position_id`: of the stop, shared by its "
          "frames.")
      .def_ro("frame_id", &StereoFrame::frame_id)
      .def_ro("position_id", &StereoFrame::position_id, "Id of the stop, shared by its frames; -1: unknown.")
      .def_ro("pair", &StereoFrame::pair, "Name of the stereo pair in the rig.")
      .def_prop_ro(
          "stamp_ns", [](const StereoFrame& f) { return f.left_stamp.ns; }, "Of the left image.")
      .def_prop_ro("right_stamp_ns", [](const StereoFrame& f) { return f.right_stamp.ns; })
      .def_prop_ro(
          "left", [](const StereoFrame& f) { return array_of_image(f.left); },
          nb::sig("def left(self) -> numpy.typing.NDArray[typing.Any]"), "The image, not copied; read-only.")
      .def_prop_ro(
          "right", [](const StereoFrame& f) { return array_of_image(f.right); },
          nb::sig("def right(self) -> numpy.typing.NDArray[typing.Any]"), "The image, not copied; read-only.")
      .def_prop_ro("layout", [](const StereoFrame& f) { return std::string(name_of(format_of(f).layout)); })
      .def_prop_ro(
          "bits", [](const StereoFrame& f) { return format_of(f).bits; }, "Significant bits of a sample.")
      .def_prop_ro(
          "alignment", [](const StereoFrame& f) { return alignment_name(format_of(f)); }, kAlignmentMeaning)
      .def_ro("pan_rad", &StereoFrame::pan_rad)
      .def_ro("tilt_rad", &StereoFrame::tilt_rad)
      .def_ro("exposure_us", &StereoFrame::exposure_us, "0: unknown.")
      .def_ro("gain", &StereoFrame::gain, "0: unknown.")
      .def("__repr__", [](const StereoFrame& f) {
        return fmt::format("<StereoFrame {} of '{}' at {} s>", f.frame_id, f.pair, to_decimal_seconds(f.left_stamp));
      });
  nb::class_<MissingFrame>(m, "MissingFrame", "A frame that a recording lists and that cannot be delivered.")
      .def_ro("frame_id", &MissingFrame::frame_id)
      .def_ro("pair", &MissingFrame::pair)
      .def_prop_ro("stamp_ns", [](const MissingFrame& f) { return f.stamp.ns; })
      .def_prop_ro(
          "fault", [](const MissingFrame& f) { return std::string(name_of(f.fault)); }, "`unreadable` …")
      .def_ro("message", &MissingFrame::message, "File and cause.")
      .def_prop_ro(
          "partial", [](const MissingFrame& f) { return f.partial; },
          "The frame with its other image, where one alone is at fault.")
      .def("__repr__", [](const MissingFrame& f) { return "<MissingFrame: " + f.message + ">"; });
}

void bind_sensors(nb::module_& m) {
  nb::class_<ImuSample>(m, "ImuSample", "Angular rate and specific force in the body frame.")
      .def(
          "__init__",
          [](ImuSample* self, std::int64_t stamp, const NumberArray& gyro, const NumberArray& accel) {
            new (self) ImuSample{{stamp}, vector_of<3>(gyro, "gyro_rad_s"), vector_of<3>(accel, "accel_m_s2")};
          },
          "stamp_ns"_a, "gyro_rad_s"_a, "accel_m_s2"_a)
      .def_prop_ro("stamp_ns", [](const ImuSample& s) { return s.stamp.ns; })
      .def_prop_ro(
          "gyro_rad_s", [](const ImuSample& s) { return matrix_array(s.gyro_rad_s); }, "rad/s, shape (3,).",
          nb::rv_policy::automatic)
      .def_prop_ro(
          "accel_m_s2", [](const ImuSample& s) { return matrix_array(s.accel_m_s2); },
          "Specific force, m/s², shape (3,); points up at rest.", nb::rv_policy::automatic);
  nb::class_<WheelSample>(m, "WheelSample", "Rolled distance of the left and right wheels since the start.")
      .def(
          "__init__",
          [](WheelSample* self, std::int64_t stamp, double left, double right) {
            new (self) WheelSample{{stamp}, left, right};
          },
          "stamp_ns"_a, "left_m"_a, "right_m"_a)
      .def_prop_ro("stamp_ns", [](const WheelSample& s) { return s.stamp.ns; })
      .def_ro("left_m", &WheelSample::left_m)
      .def_ro("right_m", &WheelSample::right_m);
  nb::class_<CompassSample>(m, "CompassSample", "Heading of the body x axis, counter-clockwise from east.")
      .def(
          "__init__",
          [](CompassSample* self, std::int64_t stamp, double heading, double sigma) {
            new (self) CompassSample{{stamp}, heading, sigma};
          },
          "stamp_ns"_a, "heading_rad"_a, "sigma_rad"_a)
      .def_prop_ro("stamp_ns", [](const CompassSample& s) { return s.stamp.ns; })
      .def_ro("heading_rad", &CompassSample::heading_rad)
      .def_ro("sigma_rad", &CompassSample::sigma_rad);
  nb::class_<InclinometerSample>(m, "InclinometerSample", "Roll and pitch of the body.")
      .def(
          "__init__",
          [](InclinometerSample* self, std::int64_t stamp, double roll, double pitch, double sigma) {
            new (self) InclinometerSample{{stamp}, roll, pitch, sigma};
          },
          "stamp_ns"_a, "roll_rad"_a, "pitch_rad"_a, "sigma_rad"_a)
      .def_prop_ro("stamp_ns", [](const InclinometerSample& s) { return s.stamp.ns; })
      .def_ro("roll_rad", &InclinometerSample::roll_rad)
      .def_ro("pitch_rad", &InclinometerSample::pitch_rad)
      .def_ro("sigma_rad", &InclinometerSample::sigma_rad);
}

}  // namespace

void bind_samples(nb::module_& m) {
  bind_frames(m);
  bind_sensors(m);
}

}  // namespace spartan::python
