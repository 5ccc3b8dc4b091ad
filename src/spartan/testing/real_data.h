// Where the files are that some tests need: real recordings, and what ships with the project.
#pragma once

#include <cstdlib>
#include <string>

namespace spartan::testing {

/// The project's source folder, for tests that read files which ship with it.
inline std::string source_folder() {
  const char* source = std::getenv("SPARTAN_SOURCE_DIR");
  return source ? source : ".";
}

/// $SPARTAN_DATA, or ../shared/data beside the source folder.
inline std::string data_folder() {
  if (const char* given = std::getenv("SPARTAN_DATA")) return given;
  return source_folder() + "/../shared/data";
}

}  // namespace spartan::testing
