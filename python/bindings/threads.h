// Worker threads of the bound classes.
#pragma once

#include <nanobind/nanobind.h>

#include <optional>

#include "spartan/core/threads.h"

namespace spartan::python {

/// None: all cores of this process. Raises ValueError where the number is not positive.
inline int thread_count(std::optional<int> threads) {
  if (threads && *threads < 1) throw nanobind::value_error("threads: must be at least 1");
  return threads.value_or(available_cores());
}
inline ThreadPool thread_pool(std::optional<int> threads) {
  return ThreadPool(thread_count(threads));
}

}  // namespace spartan::python
