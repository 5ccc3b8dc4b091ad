// PNG, JPEG, PGM and PPM files.
#include <cstdint>
#include <string>

#include "spartan/image_io/image_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string content(reinterpret_cast<const char*>(data), size);
  const auto image = spartan::decode_image(content, "input");
  if (image && image->empty()) __builtin_trap();
  return 0;
}
