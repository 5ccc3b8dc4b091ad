// Folders of the files that some tests need: real recordings, and files of the project.
#pragma once

#include <cstdlib>
#include <string>

namespace spartan::testing {

/// The project's source folder: $SPARTAN_SOURCE_DIR, or the working directory.
inline std::string source_folder() {
  const char* source = std::getenv("SPARTAN_SOURCE_DIR");
  return source ? source : ".";
}

/// The folder of recordings and images: $SPARTAN_DATA, or ../shared/data beside the source folder.
inline std::string data_folder() {
  if (const char* given = std::getenv("SPARTAN_DATA")) return given;
  return source_folder() + "/../shared/data";
}

}  // namespace spartan::testing
