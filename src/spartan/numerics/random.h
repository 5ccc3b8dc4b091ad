// Seeded random numbers with a reproducible sequence: the same on every machine and compiler.
#pragma once

#include <cstdint>

namespace spartan {

/// PCG32 (O'Neill 2014, XSH-RR 64/32). The distributions are implemented here because those of the standard library
/// differ between implementations. There is no global generator: functions take one as a parameter.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  std::uint32_t next();
  /// Unbiased uniform integer in [0, bound); throws std::invalid_argument if bound is 0.
  std::uint32_t below(std::uint32_t bound);
  /// Uniform in [0, 1), with 53 random bits.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal (Marsaglia polar method).
  double normal();
  double normal(double mean, double sigma) { return mean + sigma * normal(); }

 private:
  std::uint64_t state_ = 0;
  std::uint64_t increment_ = 0;
};

}  // namespace spartan
