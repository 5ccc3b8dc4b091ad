// Files with a homography.
#include <cmath>
#include <cstdint>
#include <string>

#include "spartan/odometry/view_matching.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto matrix = spartan::parse_homography(std::string(reinterpret_cast<const char*>(data), size), "input");
  if (matrix && !(matrix->allFinite() && matrix->cwiseAbs().maxCoeff() > 0)) __builtin_trap();
  return 0;
}
