// Wall-clock timing for benchmarks with their own main.
#pragma once

#include <chrono>
#include <functional>
#include <vector>

#include "spartan/numerics/median.h"

namespace spartan {

inline double milliseconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// Median time of several runs.
inline double median_milliseconds(int runs, const std::function<void()>& work) {
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(runs));
  for (int run = 0; run < runs; ++run) times.push_back(milliseconds(work));
  return median(std::move(times));
}

}  // namespace spartan
