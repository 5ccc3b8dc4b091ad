// Option files and `--set` assignments.
#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/options.h"

namespace {

struct Group {
  int count = 3;
  std::vector<double> lengths_m{1, 2};
  template <class Visitor>
  void describe(Visitor& v) {
    v.field("count", count, "Number of items.", spartan::between(0, 100));
    v.field("lengths_m", lengths_m, "Lengths in m.", spartan::at_least(0));
  }
};

struct Options {
  bool on = true;
  double gain = 0.5;
  std::string method = "fast";
  std::string note;
  Group group;
  template <class Visitor>
  void describe(Visitor& v) {
    v.field("on", on, "Whether it is on.");
    v.field("gain", gain, "Gain.");
    v.field("method", method, "Method.", {"fast", "exact"});
    v.field("note", note, "Free text.");
    v.group("group", group);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto options = spartan::parse_options<Options>(text, "input");
  // Accepted options must round-trip.
  if (options && !spartan::parse_options<Options>(spartan::dump_options(*options), "dump")) __builtin_trap();
  (void)spartan::set_option(Options{}, text);
  return 0;
}
