// PFM image files.
#include <cstdint>
#include <string>

#include "spartan/image_io/image_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto image = spartan::parse_pfm(std::string(reinterpret_cast<const char*>(data), size), "input");
  if (image && image->empty()) __builtin_trap();
  return 0;
}
