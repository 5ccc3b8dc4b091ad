#include "bindings/errors.h"

#include <nanobind/nanobind.h>

#include "bindings/bindings.h"

namespace nb = nanobind;

namespace spartan::python {

const char* name_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::internal:
      return "internal";
    case ErrorCode::usage:
      return "usage";
    case ErrorCode::input:
      return "input";
    case ErrorCode::frame_rejected:
      return "frame_rejected";
    case ErrorCode::store_damaged:
      return "store_damaged";
    case ErrorCode::configuration:
      return "configuration";
    case ErrorCode::output:
      return "output";
    case ErrorCode::read_error:
      return "read_error";
    case ErrorCode::resources:
      return "resources";
    case ErrorCode::interrupted:
      return "interrupted";
  }
  return "internal";
}

void bind_errors(nb::module_&) {
  nb::register_exception_translator(
      [](const std::exception_ptr& thrown, void*) {
        try {
          std::rethrow_exception(thrown);
        } catch (const RaisedError& raised) {
          const Error& error = raised.error();
          try {
            const nb::object type = nb::module_::import_("spartan._errors").attr("Error");
            const nb::object value = type(name_of(error.code), error.what, error.where, error.hint);
            PyErr_SetObject(type.ptr(), value.ptr());
          } catch (nb::python_error& failed) {
            failed.restore();
          }
        }
      },
      nullptr);
}

}  // namespace spartan::python
