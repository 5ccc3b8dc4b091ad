#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/path_text.h"
#include "bindings/trajectory.h"
#include "spartan/core/files.h"
#include "spartan/core/trajectory.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

using StampArray = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

TrajectoryValue from_arrays(const StampArray& stamps, const NumberArray& positions, const NumberArray& quaternions) {
  const Rows p(positions, 3, "positions"), q(quaternions, 4, "quaternions_xyzw");
  if (p.count() != stamps.size() || q.count() != stamps.size())
    throw nb::value_error("stamps_ns, positions and quaternions_xyzw must have equal lengths");
  TrajectoryValue made;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const Stamp stamp{stamps.data()[i]};
    if (i > 0 && stamp <= made.poses.back().stamp)
      throw nb::value_error(fmt::format("stamps_ns: must increase, does not at {}", i).c_str());
    const Eigen::Vector4d c = q.row<4>(i);
    if (!c.allFinite() || c.norm() < 1e-6)
      throw nb::value_error(fmt::format("quaternions_xyzw: row {} has no direction", i).c_str());
    made.poses.push_back({stamp, Pose(Eigen::Quaterniond(c(3), c(0), c(1), c(2)), p.row<3>(i))});
  }
  return made;
}

VectorArray<std::int64_t> stamps_ns(const TrajectoryValue& t) {
  std::vector<std::int64_t> stamps;
  for (const StampedPose& p : t.poses) stamps.push_back(p.stamp.ns);
  return owned_array(std::move(stamps));
}

RowsArray<double, 3> positions(const TrajectoryValue& t) {
  std::vector<double> values;
  for (const StampedPose& p : t.poses) {
    values.insert(values.end(), p.pose.translation().data(), p.pose.translation().data() + 3);
  }
  return owned_rows<3>(std::move(values));
}

RowsArray<double, 4> quaternions(const TrajectoryValue& t) {
  std::vector<double> values;
  for (const StampedPose& p : t.poses) {
    values.insert(values.end(), p.pose.rotation().coeffs().data(), p.pose.rotation().coeffs().data() + 4);
  }
  return owned_rows<4>(std::move(values));
}

const StampedPose& at(const TrajectoryValue& t, std::int64_t index) {
  const auto count = static_cast<std::int64_t>(t.poses.size());
  if (index < 0) index += count;
  if (index < 0 || index >= count) throw nb::index_error("there is no such pose");
  return t.poses[static_cast<std::size_t>(index)];
}

void save(const TrajectoryValue& t, const PathText& path, const std::string& format) {
  const auto text = format == "tum"     ? std::optional(to_tum(t.poses))
                    : format == "kitti" ? std::optional(to_kitti(t.poses))
                    : format == "euroc" ? std::optional(to_euroc(t.poses))
                                        : std::nullopt;
  if (!text) throw nb::value_error("format: must be 'tum', 'kitti' or 'euroc'");
  check(write_file_atomically(path, *text));
}

}  // namespace

void bind_trajectories(nb::module_& m) {
  nb::class_<StampedPose>(m, "StampedPose", "A pose with its time.")
      .def_prop_ro(
          "stamp_ns", [](const StampedPose& p) { return p.stamp.ns; }, "Nanoseconds.")
      .def_ro("pose", &StampedPose::pose, "world_from_body")
      .def("__repr__", [](const StampedPose& p) { return "<pose at " + to_decimal_seconds(p.stamp) + " s>"; });
  nb::class_<TrajectoryValue>(m, "Trajectory",
                              "Poses with increasing stamps: `world_from_body`, a sequence of StampedPose.")
      .def(
          "__init__",
          [](TrajectoryValue* self, const StampArray& stamps, const NumberArray& p, const NumberArray& q) {
            new (self) TrajectoryValue(from_arrays(stamps, p, q));
          },
          "stamps_ns"_a, "positions"_a, "quaternions_xyzw"_a,
          "Stamps in nanoseconds, int64, shape (n,); positions in metres, shape (n, 3); quaternions, shape (n, 4).")
      .def_static(
          "load", [](const PathText& path) { return TrajectoryValue{value_of(load_trajectory(path)).poses}; }, "path"_a,
          "Reads a trajectory in the format of TUM, KITTI (with `times.txt` beside it) or EuRoC, told by the content.")
      .def("save", save, "path"_a, "format"_a = "tum", "Writes it in the format `tum`, `kitti` or `euroc`.")
      .def_prop_ro("stamps_ns", stamps_ns, "Nanoseconds, int64, shape (n,).", nb::rv_policy::automatic)
      .def_prop_ro("positions", positions, "Metres, shape (n, 3).", nb::rv_policy::automatic)
      .def_prop_ro("quaternions_xyzw", quaternions, "Unit quaternions, shape (n, 4).", nb::rv_policy::automatic)
      .def_prop_ro(
          "length_m", [](const TrajectoryValue& t) { return path_length(t.poses); },
          "Length of the line through the positions, m.")
      .def("__len__", [](const TrajectoryValue& t) { return t.poses.size(); })
      .def("__getitem__", at, "index"_a, nb::rv_policy::copy)
      .def("__repr__", [](const TrajectoryValue& t) {
        return fmt::format("<Trajectory of {} poses, {:.3f} m>", t.poses.size(), path_length(t.poses));
      });
}

}  // namespace spartan::python
