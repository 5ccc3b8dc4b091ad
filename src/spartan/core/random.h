// Seeded random numbers whose sequence is part of the contract: the same on every machine and compiler.
#pragma once

#include <cstdint>

namespace spartan {

/// PCG32 (O'Neill 2014, XSH-RR 64/32). Distributions are our own, because those of the standard library
/// differ between implementations. A generator is passed to whoever needs one; there is no global one.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  std::uint32_t next();
  /// Uniform integer in [0, bound), without bias; bound > 0.
  std::uint32_t below(std::uint32_t bound);
  /// Uniform in [0, 1), 53 bits.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Normal with mean 0 and standard deviation 1 (polar method).
  double normal();
  double normal(double mean, double sigma) { return mean + sigma * normal(); }

 private:
  std::uint64_t state_ = 0;
  std::uint64_t increment_ = 0;
};

}  // namespace spartan
