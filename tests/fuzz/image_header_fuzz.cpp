// Headers of PNG, JPEG and PGM/PPM files, read without decoding.
#include <cstdint>

#include "input_file.h"
#include "spartan/image_io/image_io.h"

using spartan::read_image_size;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const spartan::testing::InputFile input(data, size);
  const auto found = read_image_size(input.path());
  if (found && found->empty()) __builtin_trap();
  return 0;
}
