// Scenarios of the simulator.
#include <cstdint>
#include <string>

#include "spartan/sim/scenario.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto scenario = spartan::sim::parse_scenario(text, "scenario.yaml");
  if (!scenario) return 0;
  // An accepted scenario must round-trip; planning it may fail but not crash.
  const std::string dump = spartan::dump_options(*scenario);
  const auto again = spartan::sim::parse_scenario(dump, "dump");
  if (!again || spartan::dump_options(*again) != dump) __builtin_trap();
  (void)spartan::sim::plan_drive(*scenario, spartan::Rig(), text, "scenario.yaml");
  return 0;
}
