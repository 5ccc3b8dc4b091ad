// Callbacks of Python, and Ctrl-C, in long calls that do not hold the lock of the interpreter.
#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <chrono>
#include <exception>

namespace spartan::python {

/// Keeps the first exception of a callback or of a signal handler; the call should then stop, and rethrow() ends it.
class PythonHooks {
 public:
  /// Calls with the lock held; not after an exception. May be called by any thread.
  template <class Function>
  void call(Function&& function) {
    const nanobind::gil_scoped_acquire held;
    if (has_raised_) return;
    try {
      function();
    } catch (...) {  // of any type: nothing is dropped, rethrow() throws it where Python waits
      raised_ = std::current_exception();
      has_raised_ = true;
    }
  }

  /// Whether something was raised. Lets Python handle signals, at most twenty times a second.
  bool should_stop() {
    const auto now = std::chrono::steady_clock::now();
    if (!has_raised_ && now >= next_) {
      next_ = now + std::chrono::milliseconds(50);
      call([] {
        if (PyErr_CheckSignals() != 0) throw nanobind::python_error();
      });
    }
    return has_raised_;
  }

  /// Throws what was raised.
  void rethrow() const {
    if (has_raised_) std::rethrow_exception(raised_);
  }

 private:
  std::exception_ptr raised_;  // before has_raised_ is set
  std::atomic<bool> has_raised_ = false;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace spartan::python
