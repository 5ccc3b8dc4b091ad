#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>

#include <optional>
#include <utility>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/guarded.h"
#include "bindings/rectified_pair.h"
#include "bindings/threads.h"
#include "spartan/image_io/image_io.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/rendering.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

// A disparity image that owns its pixels.
struct DisparityValue {
  Image<float> disparity, sigma;
  Image<std::uint8_t> outlier_percent;
  double milliseconds = 0;
};

using Computer = Guarded<DisparityComputer>;

DisparityValue compute(Computer& computer, ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                       DisparityRange range, ImageView<const std::uint8_t> left_mask,
                       ImageView<const std::uint8_t> right_mask) {
  return computer.use([&](DisparityComputer& c) {
    const DisparityImage d = value_of(c.compute(left, right, range, left_mask, right_mask));
    return DisparityValue{Image<float>::copy_of(d.disparity), Image<float>::copy_of(d.sigma),
                          Image<std::uint8_t>::copy_of(d.outlier_percent), d.times.total};
  });
}

ImageView<const std::uint8_t> mask_view(const std::optional<AnyArray>& mask, const char* name) {
  return mask ? image_view<std::uint8_t>(*mask, name) : ImageView<const std::uint8_t>();
}

DisparityValue compute_arrays(Computer& computer, const AnyArray& left, const AnyArray& right, int most, int least,
                              const std::optional<AnyArray>& left_mask, const std::optional<AnyArray>& right_mask) {
  return compute(computer, image_view<std::uint8_t>(left, "left"), image_view<std::uint8_t>(right, "right"),
                 {least, most}, mask_view(left_mask, "left_mask"), mask_view(right_mask, "right_mask"));
}

DisparityValue compute_pair(Computer& computer, const RectifiedPairValue& pair, double nearest_m) {
  const RectifiedPair& p = pair.pair;
  return compute(computer, p.left, p.right, disparity_range(p.geometry, nearest_m), p.left_mask, p.right_mask);
}

void bind_disparity(nb::module_& m) {
  nb::class_<DisparityValue>(m, "DisparityImage", "Disparities of the rectified left image with their uncertainty.")
      .def_prop_ro(
          "disparity", [](const nb::handle& self) { return member_array(self, &DisparityValue::disparity); },
          nb::sig("def disparity(self) -> numpy.typing.NDArray[numpy.float32]"),
          "x_left - x_right in pixels, float32, shape (height, width); NaN where unknown.")
      .def_prop_ro(
          "sigma", [](const nb::handle& self) { return member_array(self, &DisparityValue::sigma); },
          nb::sig("def sigma(self) -> numpy.typing.NDArray[numpy.float32]"),
          "Standard deviation of each disparity in pixels; NaN where it is unknown or filled.")
      .def_prop_ro(
          "outlier_percent",
          [](const nb::handle& self) { return member_array(self, &DisparityValue::outlier_percent); },
          nb::sig("def outlier_percent(self) -> numpy.typing.NDArray[numpy.uint8]"),
          "Probability of an error above 1 px in percent; 100 where unknown.")
      .def_ro("milliseconds", &DisparityValue::milliseconds, "Time of the computation.");
  nb::class_<Computer>(m, "DisparityComputer",
                       "Dense stereo matching: semi-global matching from coarse to fine, with sub-pixel refinement and "
                       "a standard deviation for each pixel. Results are the same bit for bit for any number of "
                       "threads.")
      .def(
          "__init__",
          [](Computer* self, const DisparityOptions* options, std::optional<int> threads) {
            const DisparityOptions chosen = options == nullptr ? DisparityOptions() : *options;
            new (self) Computer(value_of(DisparityComputer::create(chosen, thread_pool(threads))));
          },
          "options"_a.none() = nb::none(), nb::kw_only(), "threads"_a = nb::none())
      .def("compute", compute_pair, "pair"_a, "nearest_m"_a = 0.0,
           "Matches a rectified pair. The search range follows from the nearest depth in metres; 0: a quarter of the "
           "width.")
      .def("compute", compute_arrays, "left"_a, "right"_a, "max_disparity"_a, "min_disparity"_a = 0, nb::kw_only(),
           "left_mask"_a = nb::none(), "right_mask"_a = nb::none(),
           "Matches two rectified images, uint8, of one shape; disparities from min to max (px, both included). Masks: "
           "0 "
           "excludes a pixel. Raises Error where the sizes differ or the range does not fit.")
      .def_static(
          "memory_bytes",
          [](std::pair<int, int> size, int most, int least, int threads) {
            return DisparityComputer::memory_bytes({size.first, size.second}, {least, most}, threads);
          },
          "size"_a, "max_disparity"_a, "min_disparity"_a = 0, "threads"_a = 1,
          "Upper bound of the memory that compute() needs; `size`: (width, height).");
}

}  // namespace

void bind_stereo(nb::module_& m) {
  bind_disparity(m);
  m.def(
      "colour_disparity",
      [](const AnyArray& disparity) {
        return owned_array(colour_disparity(image_view<float>(disparity, "disparity")));
      },
      "disparity"_a,
      "Disparities in colours, uint8, shape (height, width, 3): near is red, far is blue, unknown pixels are black.");
}

}  // namespace spartan::python
