// Objects that several threads of Python may use.
#pragma once

#include <nanobind/nanobind.h>

#include <mutex>
#include <utility>

namespace spartan::python {

/// An object that computes without the lock of the interpreter (GIL). Calls of several threads wait for each other.
template <class T>
class Guarded {
 public:
  explicit Guarded(T value) : value_(std::move(value)) {}

  /// The result of `function(value)`, if any; the function must not touch Python.
  template <class Function>
  auto use(Function&& function) {
    const nanobind::gil_scoped_release free;
    const std::scoped_lock lock(mutex_);
    return function(value_);
  }

 private:
  std::mutex mutex_;
  T value_;
};

}  // namespace spartan::python
