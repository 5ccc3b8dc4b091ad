// Paths in arguments: str, or objects with __fspath__ such as pathlib.Path.
#pragma once

#include <nanobind/nanobind.h>

#include <string>

namespace spartan::python {

struct PathText : std::string {};

}  // namespace spartan::python

namespace nanobind::detail {

template <>
struct type_caster<spartan::python::PathText> {
  NB_TYPE_CASTER(spartan::python::PathText, const_name("str | os.PathLike[str]"))

  bool from_python(handle source, std::uint8_t, cleanup_list*) noexcept {
    const object text = steal(PyOS_FSPath(source.ptr()));
    if (!text.is_valid() || !PyUnicode_Check(text.ptr())) {
      PyErr_Clear();
      return false;
    }
    Py_ssize_t size = 0;
    const char* const bytes = PyUnicode_AsUTF8AndSize(text.ptr(), &size);
    if (bytes == nullptr) {
      PyErr_Clear();
      return false;
    }
    value.assign(bytes, static_cast<std::size_t>(size));
    return true;
  }
};

}  // namespace nanobind::detail
