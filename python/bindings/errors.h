// Errors of the library as exceptions of Python.
#pragma once

#include <exception>
#include <string>
#include <utility>

#include "spartan/core/result.h"

namespace spartan::python {

/// Carries an Error to Python, where it is raised as `spartan.Error`.
class RaisedError : public std::exception {
 public:
  explicit RaisedError(Error error) : error_(std::move(error)), message_(error_.message()) {}
  const Error& error() const { return error_; }
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  Error error_;
  std::string message_;
};

/// The value of a result; raises its error.
template <class T>
T value_of(Result<T>&& result) {
  if (!result) throw RaisedError(std::move(result).error());
  return *std::move(result);
}
inline void check(const Status& status) {
  if (!status) throw RaisedError(status.error());
}

/// The name of a code in Python: "input", "configuration" ….
const char* name_of(ErrorCode code);

}  // namespace spartan::python
