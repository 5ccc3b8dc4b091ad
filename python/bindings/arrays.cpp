#include "bindings/arrays.h"

namespace spartan::python {

Rows::Rows(const NumberArray& numbers, int columns, const char* name) : data_(numbers.data()) {
  const auto& a = numbers.array;
  const auto wanted = static_cast<std::size_t>(columns);
  // numpy.ascontiguousarray makes one dimension of none.
  single_ = a.ndim() == 1;
  if (a.ndim() < 1 || a.ndim() > 2 || a.shape(a.ndim() - 1) != wanted) {
    throw nb::value_error(fmt::format("{}: must have the shape (n, {}) or ({},)", name, columns, columns).c_str());
  }
  count_ = single_ ? 1 : a.shape(0);
}

std::string dtype_name(nb::dlpack::dtype type) {
  constexpr std::array kKinds{"int", "uint", "float"};
  if (type.code == static_cast<std::uint8_t>(nb::dlpack::dtype_code::Bool)) return "bool";
  if (type.code < kKinds.size()) return kKinds[type.code] + std::to_string(type.bits);
  return "another type";
}

void check_pixels(const AnyArray& array, nb::dlpack::dtype type, std::size_t channels, const char* name) {
  if (array.dtype() != type) {
    throw nb::type_error(
        fmt::format("{}: must have the dtype {}, not {}", name, dtype_name(type), dtype_name(array.dtype())).c_str());
  }
  const bool colour = channels == 3;
  if (array.ndim() != (colour ? 3 : 2) || (colour && array.shape(2) != 3)) {
    throw nb::value_error(fmt::format("{}: must have the shape (height, width{})", name, colour ? ", 3" : "").c_str());
  }
  constexpr std::size_t kMostPixels = 32767;  // of a side
  if (array.shape(0) > kMostPixels || array.shape(1) > kMostPixels)
    throw nb::value_error(fmt::format("{}: must have at most {} pixels a side", name, kMostPixels).c_str());
  const auto step = static_cast<std::int64_t>(channels);
  const std::int64_t row = array.stride(0);
  const bool packed = array.stride(1) == step && (!colour || array.stride(2) == 1);
  const bool whole_rows = row >= step * static_cast<std::int64_t>(array.shape(1)) && row % step == 0;
  if (array.size() > 0 && (!packed || (array.shape(0) > 1 && !whole_rows))) {
    throw nb::value_error(
        fmt::format("{}: the pixels of a row must lie side by side; use numpy.ascontiguousarray", name).c_str());
  }
}

ColourArray owned_array(Image<Rgb8> image) {
  const auto [kept, owner] = kept_by_python(std::move(image));
  const std::array<std::size_t, 3> shape{static_cast<std::size_t>(kept->height()),
                                         static_cast<std::size_t>(kept->width()), 3};
  const std::array<std::int64_t, 3> strides{kept->stride() * 3, 3, 1};
  return ColourArray(reinterpret_cast<std::uint8_t*>(kept->data()), 3, shape.data(), owner, strides.data());
}

}  // namespace spartan::python
