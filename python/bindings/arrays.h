// Images and lists of vectors as arrays of numpy, without copies where their memory lives long enough.
#pragma once

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "spartan/core/image.h"

namespace spartan::python {

namespace nb = nanobind;

/// An array of any type and shape; its values are only read.
struct AnyArray : nb::ndarray<nb::ro, nb::device::cpu> {};
/// Pixels of one channel (height, width); of three (height, width, 3).
template <class T>
using ImageArray = nb::ndarray<nb::numpy, T, nb::ndim<2>>;
using ColourArray = nb::ndarray<nb::numpy, std::uint8_t, nb::shape<-1, -1, 3>>;
/// A list of `columns` numbers for each row.
template <class T, int columns>
using RowsArray = nb::ndarray<nb::numpy, T, nb::shape<-1, columns>>;
template <class T>
using VectorArray = nb::ndarray<nb::numpy, T, nb::ndim<1>>;

/// Numbers that numpy converts to an array of float64: arrays, lists, tuples.
struct NumberArray {
  nb::ndarray<const double, nb::c_contig, nb::device::cpu> array;

  std::size_t dimensions() const { return array.ndim(); }
  std::size_t size() const { return array.size(); }
  const double* data() const { return array.data(); }
};

/// Rows of `columns` numbers, of an array of shape (n, columns) or (columns,).
class Rows {
 public:
  /// Raises ValueError, with `name`, for other shapes.
  Rows(const NumberArray& numbers, int columns, const char* name);

  std::size_t count() const { return count_; }
  bool single() const { return single_; }  ///< the array has one dimension
  template <int columns>
  Eigen::Matrix<double, columns, 1> row(std::size_t i) const {
    return Eigen::Map<const Eigen::Matrix<double, columns, 1>>(data_ + i * columns);
  }

 private:
  const double* data_;
  std::size_t count_;
  bool single_;
};

/// A vector of `size` numbers. Raises ValueError, with `name`, for other shapes.
template <int size>
Eigen::Matrix<double, size, 1> vector_of(const NumberArray& numbers, const char* name) {
  const Rows rows(numbers, size, name);
  if (!rows.single()) throw nb::value_error(fmt::format("{}: must have the shape ({},)", name, size).c_str());
  return rows.row<size>(0);
}

/// A matrix, of an array of shape (rows, columns).
template <int rows, int columns>
Eigen::Matrix<double, rows, columns> matrix_of(const NumberArray& numbers, const char* name) {
  const auto& a = numbers.array;
  if (a.ndim() != 2 || a.shape(0) != rows || a.shape(1) != columns)
    throw nb::value_error(fmt::format("{}: must have the shape ({}, {})", name, rows, columns).c_str());
  return Eigen::Map<const Eigen::Matrix<double, rows, columns, Eigen::RowMajor>>(a.data());
}

/// "uint8", "float32", "bool" ….
std::string dtype_name(nb::dlpack::dtype type);

/// Raises TypeError for another type of pixels, ValueError for another shape, or where pixels of a row are apart.
void check_pixels(const AnyArray& array, nb::dlpack::dtype type, std::size_t channels, const char* name);

/// The pixels of an array of shape (height, width), or (height, width, 3) of Rgb8 and Rgb16. Rows may be apart, as in a
/// part of an image. Raises as check_pixels().
template <class T>
ImageView<const T> image_view(const AnyArray& array, const char* name) {
  constexpr bool colour = std::is_same_v<T, Rgb8> || std::is_same_v<T, Rgb16>;
  using Channel = std::conditional_t<colour, std::conditional_t<sizeof(T) == 3, std::uint8_t, std::uint16_t>, T>;
  check_pixels(array, nb::dtype<Channel>(), colour ? 3 : 1, name);
  const std::int64_t stride = array.stride(0) / (colour ? 3 : 1);
  return {static_cast<const T*>(array.data()), static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)),
          static_cast<std::ptrdiff_t>(stride)};
}

/// Pixels of other memory, which `owner` keeps alive and unchanged.
template <class T>
ImageArray<const T> shared_array(ImageView<const T> view, nb::handle owner) {
  const std::array<std::size_t, 2> shape{static_cast<std::size_t>(view.height()),
                                         static_cast<std::size_t>(view.width())};
  const std::array<std::int64_t, 2> strides{view.stride(), 1};
  return ImageArray<const T>(view.data(), 2, shape.data(), owner, strides.data());
}

/// The pixels of an image in an object of Python, which the array keeps.
template <class Owner, class T>
nb::object member_array(const nb::handle& self, const Image<T> Owner::*member) {
  return nb::cast(shared_array<T>((nb::inst_ptr<Owner>(self)->*member).view(), self));
}

/// A value that lives as long as the object that is returned with it.
template <class T>
std::pair<T*, nb::capsule> kept_by_python(T value) {
  auto* const kept = new T(std::move(value));
  return {kept, nb::capsule(kept, [](void* p) noexcept { delete static_cast<T*>(p); })};
}

/// The same of an image that is moved into the array.
template <class T>
ImageArray<T> owned_array(Image<T> image) {
  const auto [kept, owner] = kept_by_python(std::move(image));
  const std::array<std::size_t, 2> shape{static_cast<std::size_t>(kept->height()),
                                         static_cast<std::size_t>(kept->width())};
  const std::array<std::int64_t, 2> strides{kept->stride(), 1};
  return ImageArray<T>(kept->data(), 2, shape.data(), owner, strides.data());
}
ColourArray owned_array(Image<Rgb8> image);

/// Memory that the array owns.
template <class T>
VectorArray<T> owned_array(std::vector<T> values) {
  const auto [kept, owner] = kept_by_python(std::move(values));
  return VectorArray<T>(kept->data(), {kept->size()}, owner);
}
template <int columns, class T>
RowsArray<T, columns> owned_rows(std::vector<T> values) {
  const auto [kept, owner] = kept_by_python(std::move(values));
  return RowsArray<T, columns>(kept->data(), {kept->size() / columns, static_cast<std::size_t>(columns)}, owner);
}

/// A small matrix or vector, copied.
template <class Matrix>
auto matrix_array(const Matrix& matrix) {
  constexpr int rows = Matrix::RowsAtCompileTime, columns = Matrix::ColsAtCompileTime;
  std::vector<double> values(static_cast<std::size_t>(rows * columns));
  Eigen::Map<Eigen::Matrix<double, rows, columns, columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>>(values.data()) =
      matrix;
  const auto [kept, owner] = kept_by_python(std::move(values));
  if constexpr (columns == 1) {
    return nb::ndarray<nb::numpy, double, nb::shape<rows>>(kept->data(), {static_cast<std::size_t>(rows)}, owner);
  } else {
    return nb::ndarray<nb::numpy, double, nb::shape<rows, columns>>(
        kept->data(), {static_cast<std::size_t>(rows), static_cast<std::size_t>(columns)}, owner);
  }
}

}  // namespace spartan::python

namespace nanobind::detail {

template <>
struct type_caster<spartan::python::AnyArray> {
  NB_TYPE_CASTER(spartan::python::AnyArray, const_name("numpy.typing.NDArray[typing.Any]"))

  bool from_python(handle source, std::uint8_t, cleanup_list*) noexcept {
    return try_cast(source, static_cast<ndarray<ro, device::cpu>&>(value), false);
  }
};

template <>
struct type_caster<spartan::python::NumberArray> {
  NB_TYPE_CASTER(spartan::python::NumberArray, const_name("numpy.typing.ArrayLike"))

  bool from_python(handle source, std::uint8_t, cleanup_list*) noexcept {
    try {
      const object array =
          module_::import_("numpy").attr("ascontiguousarray")(source, module_::import_("numpy").attr("float64"));
      return try_cast(array, value.array);
    } catch (python_error&) {  // numpy says why; nanobind raises TypeError with the signature
      return false;
    }
  }
};

}  // namespace nanobind::detail
