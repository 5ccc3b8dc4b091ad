#include "spartan/numerics/random.h"

#include <cmath>
#include <stdexcept>

namespace spartan {

Random::Random(std::uint64_t seed, std::uint64_t stream) : increment_((stream << 1) | 1U) {
  next();
  state_ += seed;
  next();
}

std::uint32_t Random::next() {
  const std::uint64_t old = state_;
  state_ = old * 6364136223846793005ULL + increment_;
  const auto shifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
  const auto rotation = static_cast<std::uint32_t>(old >> 59U);
  return (shifted >> rotation) | (shifted << ((32U - rotation) & 31U));
}

std::uint32_t Random::below(std::uint32_t bound) {
  if (bound == 0) throw std::invalid_argument("Random::below: bound is 0");
  const std::uint32_t threshold =
      (0U - bound) % bound;  // 2³² mod bound; draws below it are rejected, they would bias the result
  for (;;) {
    const std::uint32_t draw = next();
    if (draw >= threshold) return draw % bound;
  }
}

double Random::uniform() {
  const std::uint64_t high = next() >> 5U, low = next() >> 6U;
  return static_cast<double>((high << 26U) | low) * 0x1p-53;
}

double Random::normal() {
  // The second number of each pair is discarded, so that the generator needs no further state.
  for (;;) {
    const double u = uniform(-1, 1), v = uniform(-1, 1);
    const double s = u * u + v * v;
    if (s > 0 && s < 1) return u * std::sqrt(-2.0 * std::log(s) / s);
  }
}

}  // namespace spartan
