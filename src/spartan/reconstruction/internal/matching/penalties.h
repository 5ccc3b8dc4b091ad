// Penalties of semi-global matching, in bits of the 32-bit census cost.
#pragma once

#include <array>
#include <cstdint>

namespace spartan::internal::matching {

struct Penalties {
  std::uint8_t p1 = 18;                           ///< Of a step by one disparity.
  alignas(16) std::array<std::uint8_t, 16> p2{};  ///< Of a larger step, by the gray-level change; see P2Row.
  std::uint8_t out_of_view = 11;                  ///< Cost where x − d lies outside of the right image.
};

}  // namespace spartan::internal::matching
