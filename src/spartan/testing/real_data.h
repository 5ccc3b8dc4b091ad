// Where the real recordings are that some tests need.
#pragma once

#include <cstdlib>
#include <string>

namespace spartan::testing {

/// $SPARTAN_DATA, or ../shared/data beside the source folder.
inline std::string data_folder() {
  if (const char* given = std::getenv("SPARTAN_DATA")) return given;
  const char* source = std::getenv("SPARTAN_SOURCE_DIR");
  return std::string(source ? source : ".") + "/../shared/data";
}

}  // namespace spartan::testing
