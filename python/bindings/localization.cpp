#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>
#include <string>
#include <utility>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/guarded.h"
#include "spartan/localization/localizer.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

nb::dict health_of(const LocalizationEstimate& e) {
  nb::dict sensors;
  for (int i = 0; i < kLocalizationSensors; ++i) {
    const auto sensor = static_cast<LocalizationSensor>(i);
    sensors[std::string(name_of(sensor)).c_str()] = nb::cast(e.health_of(sensor));
  }
  return sensors;
}

void bind_estimate(nb::module_& m) {
  nb::class_<InnovationTest>(
      m, "InnovationTest",
      "Chi-square test of an innovation: the measurement may be used where `nis` is at most `gate`.")
      .def_prop_ro("stamp_ns", [](const InnovationTest& t) { return t.stamp.ns; })
      .def_ro("nis", &InnovationTest::nis,
              "Normalized innovation squared, rᵀ S⁻¹ r; the largest float where S is singular.")
      .def_ro("gate", &InnovationTest::gate)
      .def("__repr__", [](const InnovationTest& t) { return fmt::format("<NIS {:.3g}, gate {:.3g}>", t.nis, t.gate); });
  nb::class_<SensorHealth>(m, "SensorHealth", "Whether a sensor is used, and why not.")
      .def_prop_ro(
          "state", [](const SensorHealth& h) { return std::string(name_of(h.state)); },
          "`ok`, `suspect`, `excluded` or `missing`.")
      .def_ro("reason", &SensorHealth::reason)
      .def_ro("used", &SensorHealth::used, "Samples used by the filter.")
      .def_ro("rejected", &SensorHealth::rejected, "Samples rejected by the filter.")
      .def_ro(
          "test", &SensorHealth::test,
          "The last test of an innovation. Of vision: against the prediction by the IMU; None where there is no such "
          "prediction.")
      .def("__repr__", [](const SensorHealth& h) {
        return fmt::format("<{}{}{}>", name_of(h.state), h.reason.empty() ? "" : ": ", h.reason);
      });
  nb::class_<LocalizationEstimate>(m, "LocalizationEstimate", "The pose by all sensors, with what they state about it.")
      .def_prop_ro(
          "stamp_ns", [](const LocalizationEstimate& e) { return e.stamp.ns; }, "Of the newest sample.")
      .def_ro("world_from_body", &LocalizationEstimate::world_from_body,
              "UncertainPose: the best estimate; jumps where map, compass or inclinometer correct it.")
      .def_ro("odom_from_body", &LocalizationEstimate::odom_from_body, "UncertainPose that never jumps.")
      .def_prop_ro(
          "velocity_m_s", [](const LocalizationEstimate& e) { return matrix_array(e.velocity_m_s); },
          "Of the body in the world, m/s.", nb::rv_policy::automatic)
      .def_prop_ro(
          "velocity_covariance", [](const LocalizationEstimate& e) { return matrix_array(e.velocity_covariance); },
          "Shape (3, 3), m²/s².", nb::rv_policy::automatic)
      .def_ro("imu_aligned", &LocalizationEstimate::imu_aligned)
      .def_prop_ro(
          "gyro_bias_rad_s", [](const LocalizationEstimate& e) { return matrix_array(e.biases.gyro_rad_s); },
          nb::rv_policy::automatic)
      .def_prop_ro(
          "accel_bias_m_s2", [](const LocalizationEstimate& e) { return matrix_array(e.biases.accel_m_s2); },
          nb::rv_policy::automatic)
      .def_ro("gravity_measured", &LocalizationEstimate::gravity_measured,
              "The z axis of the world was aligned with measured gravity.")
      .def_prop_ro(
          "up_in_world", [](const LocalizationEstimate& e) { return matrix_array(e.up_in_world); },
          "Current estimate of the vertical, unit vector.", nb::rv_policy::automatic)
      .def_prop_ro(
          "wheel_slip",
          [](const LocalizationEstimate& e) { return e.slip ? std::optional(e.slip->slip) : std::nullopt; },
          "1 - travelled / counted at the last wheel step; None where it is not known.")
      .def_prop_ro("health", health_of, nb::sig("def health(self) -> dict[str, SensorHealth]"),
                   "SensorHealth of `vision`, `imu`, `wheels`, `compass`, `inclinometer` and `map`.")
      .def("__repr__", [](const LocalizationEstimate& e) {
        const auto& t = e.world_from_body.pose.translation();
        return fmt::format("<LocalizationEstimate at {} s: {:.3f}, {:.3f}, {:.3f} m>", to_decimal_seconds(e.stamp),
                           t.x(), t.y(), t.z());
      });
}

using LocalizerValue = Guarded<Localizer>;

bool add(LocalizerValue& self, const Measurement& measurement) {
  return self.use([&](Localizer& localizer) { return localizer.add(measurement); });
}

bool add_motion(LocalizerValue& self, std::int64_t from, std::int64_t to, const Pose& motion,
                const NumberArray& covariance, bool measured, bool keeps_reference) {
  RelativeMotion added;
  added.from = {from};
  added.to = {to};
  added.previous_from_current = motion;
  added.covariance = matrix_of<6, 6>(covariance, "covariance");
  added.measured = measured;
  added.keeps_reference = keeps_reference;
  return add(self, added);
}

}  // namespace

void bind_localization(nb::module_& m) {
  bind_estimate(m);
  nb::class_<LocalizerValue>(
      m, "Localizer",
      "Localization: fuses visual motions with IMU, wheels, compass and inclinometer. Samples may arrive "
      "late and in any order within the option `buffer_s`.")
      .def(
          "__init__",
          [](LocalizerValue* self, const LocalizationOptions* options) {
            const LocalizationOptions chosen = options == nullptr ? LocalizationOptions() : *options;
            new (self) LocalizerValue(value_of(Localizer::create(chosen)));
          },
          "options"_a.none() = nb::none())
      .def(
          "start",
          [](LocalizerValue& self, std::int64_t stamp, const NumberArray& ahead) {
            const Eigen::Vector3d axis = vector_of<3>(ahead, "ahead_in_body");
            if (!axis.allFinite() || axis.norm() < 1e-6) throw nb::value_error("ahead_in_body: has no direction");
            self.use([&](Localizer& localizer) { localizer.start(Stamp{stamp}, axis.normalized()); });
          },
          "stamp_ns"_a, "ahead_in_body"_a,
          "Call once, at the first frame, with the optical axis in the body frame. Samples of the last 10 s that were "
          "added "
          "before give the vertical.")
      .def(
          "add", [](LocalizerValue& self, const ImuSample& s) { return add(self, s); }, "sample"_a,
          "Returns whether the sample was accepted.")
      .def(
          "add", [](LocalizerValue& self, const WheelSample& s) { return add(self, s); }, "sample"_a)
      .def(
          "add", [](LocalizerValue& self, const CompassSample& s) { return add(self, s); }, "sample"_a)
      .def(
          "add", [](LocalizerValue& self, const InclinometerSample& s) { return add(self, s); }, "sample"_a)
      .def("add_motion", add_motion, "from_ns"_a, "to_ns"_a, "previous_from_current"_a, "covariance"_a, nb::kw_only(),
           "measured"_a = true, "keeps_reference"_a = false,
           "A visual motion of the body between two frames, with its covariance (6, 6) of the right perturbation. To "
           "be added "
           "for every frame after the first, measured or not. Returns whether it was accepted.")
      .def(
          "estimate", [](LocalizerValue& self) { return self.use([](Localizer& l) { return l.estimate(); }); },
          "The estimate at the newest sample.")
      .def(
          "estimate_at",
          [](LocalizerValue& self, std::int64_t stamp) {
            return self.use([&](Localizer& l) { return l.estimate_at(Stamp{stamp}); });
          },
          "stamp_ns"_a, "The estimate at a time of the buffer, or predicted for a later one; None before the buffer.");
}

}  // namespace spartan::python
