#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/operators.h>
#include <nanobind/stl/string.h>

#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "spartan/core/pose.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

Pose pose_from_matrix(const NumberArray& numbers) {
  const auto& a = numbers.array;
  if (a.ndim() != 2 || (a.shape(0) != 3 && a.shape(0) != 4) || a.shape(1) != 4)
    throw nb::value_error("matrix: must have the shape (4, 4) or (3, 4)");
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (std::size_t i = 0; i < 12; ++i) matrix(static_cast<int>(i / 4), static_cast<int>(i % 4)) = a.data()[i];
  const bool last_row =
      a.shape(0) == 3 || (a.data()[12] == 0 && a.data()[13] == 0 && a.data()[14] == 0 && a.data()[15] == 1);
  if (!matrix.allFinite() || !last_row || !is_rotation(matrix.topLeftCorner<3, 3>()))
    throw nb::value_error("matrix: is not a rigid transform");
  return Pose::from_matrix(matrix);
}

Pose pose_from_quaternion(const NumberArray& xyzw, const NumberArray& translation) {
  const Eigen::Vector4d q = vector_of<4>(xyzw, "quaternion_xyzw");
  if (!q.allFinite() || q.norm() < 1e-6) throw nb::value_error("quaternion_xyzw: has no direction");
  return {Eigen::Quaterniond(q(3), q(0), q(1), q(2)), vector_of<3>(translation, "translation")};
}

// Of one point an array (3,), of several one (n, 3).
nb::object transform(const Pose& pose, const NumberArray& points) {
  const Rows rows(points, 3, "points");
  std::vector<double> moved;
  moved.reserve(3 * rows.count());
  for (std::size_t i = 0; i < rows.count(); ++i) {
    const Eigen::Vector3d p = pose * rows.row<3>(i);
    moved.insert(moved.end(), p.data(), p.data() + 3);
  }
  if (rows.single()) return nb::cast(owned_array(std::move(moved)));
  return nb::cast(owned_rows<3>(std::move(moved)));
}

std::string repr(const Pose& pose) {
  const auto& t = pose.translation();
  const auto q = pose.rotation().coeffs();
  return fmt::format("Pose(translation=[{:.9g}, {:.9g}, {:.9g}], quaternion_xyzw=[{:.9g}, {:.9g}, {:.9g}, {:.9g}])",
                     t.x(), t.y(), t.z(), q(0), q(1), q(2), q(3));
}

void bind_pose(nb::module_& m) {
  nb::class_<Pose>(m, "Pose",
                   "A rigid transform. One that is named `a_from_b` turns coordinates of b into those of a: "
                   "`p_a = a_from_b @ p_b`.")
      .def(nb::init<>(), "The identity.")
      .def(
          "__init__", [](Pose* self, const NumberArray& matrix) { new (self) Pose(pose_from_matrix(matrix)); },
          "matrix"_a,
          "From a homogeneous matrix, shape (4, 4) or (3, 4); raises ValueError where it is no rigid transform.")
      .def_static("from_quaternion", pose_from_quaternion, "quaternion_xyzw"_a, "translation"_a,
                  "From a quaternion (x, y, z, w), which is normalized, and a translation in metres.")
      .def_static(
          "exp", [](const NumberArray& tangent) { return exp_se3(vector_of<6>(tangent, "tangent")); }, "tangent"_a,
          "The exponential of a tangent vector (translation in m, rotation in rad), shape (6,).")
      .def(
          "log", [](const Pose& p) { return matrix_array(log_se3(p)); },
          "The tangent vector (translation in m, rotation in rad) whose exponential this is.")
      .def("inverse", &Pose::inverse)
      .def(
          "matrix", [](const Pose& p) { return matrix_array(p.matrix()); }, "The homogeneous matrix, shape (4, 4).")
      .def_prop_ro(
          "translation", [](const Pose& p) { return matrix_array(p.translation()); }, "Metres, shape (3,).",
          nb::rv_policy::automatic)
      .def_prop_ro(
          "rotation", [](const Pose& p) { return matrix_array(p.rotation_matrix()); },
          "The rotation matrix, shape (3, 3).", nb::rv_policy::automatic)
      .def_prop_ro(
          "quaternion_xyzw", [](const Pose& p) { return matrix_array(Eigen::Vector4d(p.rotation().coeffs())); },
          "The unit quaternion (x, y, z, w).", nb::rv_policy::automatic)
      .def_prop_ro(
          "angle_rad", [](const Pose& p) { return rotation_angle(p); }, "The angle of the rotation, 0 to pi.")
      .def(
          "__matmul__", [](const Pose& a, const Pose& b) { return a * b; }, nb::is_operator(), "a_from_b @ b_from_c")
      .def("__matmul__", transform, nb::is_operator(), "Transforms points, shape (n, 3) or (3,), in metres.")
      .def("__getstate__", [](const Pose& p) { return nb::bytes(reinterpret_cast<const char*>(&p), sizeof p); })
      .def("__setstate__",
           [](Pose* self, const nb::bytes& state) {
             if (state.size() != sizeof(Pose)) throw nb::value_error("not the state of a Pose");
             new (self) Pose();
             std::memcpy(static_cast<void*>(self), state.c_str(), sizeof(Pose));
           })
      .def("__repr__", repr);
}

}  // namespace

void bind_poses(nb::module_& m) {
  bind_pose(m);
  nb::class_<UncertainPose>(m, "UncertainPose", "A pose with the covariance of its error.")
      .def(
          "__init__",
          [](UncertainPose* self, const Pose& pose, const NumberArray& covariance) {
            new (self) UncertainPose{pose, matrix_of<6, 6>(covariance, "covariance")};
          },
          "pose"_a, "covariance"_a)
      .def_ro("pose", &UncertainPose::pose)
      .def_prop_ro(
          "covariance", [](const UncertainPose& p) { return matrix_array(p.covariance); },
          "Shape (6, 6), order (translation, rotation), of the right perturbation pose @ Pose.exp(error); m and rad.",
          nb::rv_policy::automatic)
      .def_prop_ro(
          "sigma", [](const UncertainPose& p) { return matrix_array(Vector6d(p.covariance.diagonal().cwiseSqrt())); },
          "Standard deviations of translation (m) and rotation (rad) along the axes of the body, shape (6,).",
          nb::rv_policy::automatic)
      .def("inverse", [](const UncertainPose& p) { return invert(p); })
      .def(
          "__matmul__", [](const UncertainPose& a, const UncertainPose& b) { return compose(a, b); }, nb::is_operator(),
          "The composition of two poses with independent errors.")
      .def("__repr__", [](const UncertainPose& p) { return "Uncertain" + repr(p.pose); });
}

}  // namespace spartan::python
