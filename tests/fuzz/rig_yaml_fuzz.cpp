// rig.yaml.
#include <cstdint>
#include <string>

#include "spartan/calibration_io/calibration_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto rig = spartan::parse_rig_yaml(std::string(reinterpret_cast<const char*>(data), size), "rig.yaml");
  if (!rig) return 0;
  // An accepted rig must be valid and round-trip.
  if (!rig->validation_errors().empty()) __builtin_trap();
  const auto again = spartan::parse_rig_yaml(spartan::to_rig_yaml(*rig), "rig.yaml");
  if (!again || !(*again == *rig)) __builtin_trap();
  return 0;
}
