// Frame numbers and time stamps in names of image files, one name a line.
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "spartan/camera/internal/layouts/name_numbers.h"

using namespace spartan::internal;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream text(std::string(reinterpret_cast<const char*>(data), size));
  std::vector<std::string> names;
  for (std::string name; names.size() < 1000 && std::getline(text, name);) names.push_back(name);
  const auto numbers = numbers_in_names(names);
  if (!numbers) return 0;
  if (numbers->values.size() != names.size()) __builtin_trap();
  const auto unit = stamp_unit(numbers->values);
  if (!unit) return 0;
  for (const std::int64_t value : numbers->values) (void)to_stamp(value, *unit);
  return 0;
}
