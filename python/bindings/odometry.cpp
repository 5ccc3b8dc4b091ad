#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>
#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/guarded.h"
#include "bindings/rectified_pair.h"
#include "bindings/threads.h"
#include "spartan/odometry/odometer.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {

void bind_odometry(nb::module_& m) {
  nb::class_<MotionEstimate>(m, "MotionEstimate",
                             "The motion between two stereo frames, in rectified left optical frames.")
      .def_prop_ro(
          "from_ns", [](const MotionEstimate& e) { return e.from.ns; },
          "Stamp of the frame whose landmarks were found, ns.")
      .def_prop_ro("to_ns", [](const MotionEstimate& e) { return e.to.ns; })
      .def_ro("keeps_reference", &MotionEstimate::keeps_reference, "The next motion begins at `from_ns`, too.")
      .def_ro("first", &MotionEstimate::first, "There was no frame before: the motion is the identity.")
      .def_ro("previous_from_current", &MotionEstimate::previous_from_current)
      .def_prop_ro(
          "covariance", [](const MotionEstimate& e) { return matrix_array(e.covariance); },
          "Shape (6, 6), order (translation, rotation), of the right perturbation; m and rad.",
          nb::rv_policy::automatic)
      .def_prop_ro(
          "status", [](const MotionEstimate& e) { return std::string(name_of(e.status)); },
          "`tracking`, `degraded`, `lost` (the motion is predicted) or `stationary`.")
      .def_ro("reason", &MotionEstimate::reason, "Why the status is not `tracking`; empty otherwise.")
      .def_ro("landmarks", &MotionEstimate::landmarks)
      .def_ro("matches", &MotionEstimate::matches)
      .def_ro("inliers", &MotionEstimate::inliers)
      .def_ro("rms_px", &MotionEstimate::rms_px, "RMS reprojection residual of the inliers, px.")
      .def_prop_ro(
          "milliseconds", [](const MotionEstimate& e) { return e.times.total; }, "Time of the computation.")
      .def("__repr__", [](const MotionEstimate& e) {
        return fmt::format("<MotionEstimate: {}, {} inliers, {:.4f} m>", name_of(e.status), e.inliers,
                           e.previous_from_current.translation().norm());
      });
  nb::class_<Guarded<Odometer>>(m, "Odometer", "Visual odometry: the motion from one stereo frame to the next.")
      .def(
          "__init__",
          [](Guarded<Odometer>* self, const OdometryOptions* options, std::optional<int> threads) {
            const OdometryOptions chosen = options == nullptr ? OdometryOptions() : *options;
            new (self) Guarded<Odometer>(value_of(Odometer::create(chosen, thread_pool(threads))));
          },
          "options"_a.none() = nb::none(), nb::kw_only(), "threads"_a = nb::none())
      .def(
          "add",
          [](Guarded<Odometer>& self, const RectifiedPairValue& pair, const std::optional<Pose>& predicted,
             const std::optional<AnyArray>& disparity) {
            const auto dense = disparity ? image_view<float>(*disparity, "disparity") : ImageView<const float>();
            if (disparity && dense.size() != pair.left.size())
              throw nb::value_error("disparity: must have the shape of the images");
            return self.use([&](Odometer& odometer) { return odometer.add(pair.pair, predicted, dense); });
          },
          "pair"_a, "predicted"_a = nb::none(), "disparity"_a = nb::none(),
          "Processes the next pair. `predicted`: previous_from_current, instead of a constant velocity. `disparity`: "
          "dense "
          "disparities (float32), read where the option reconstruction.source is `dense`. Never fails: a pair that "
          "cannot "
          "be used gives the status `lost` with a reason.");
}

}  // namespace spartan::python
