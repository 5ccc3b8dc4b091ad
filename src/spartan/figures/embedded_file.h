// Files that are part of the program: scripts and styles of pages.
#pragma once

#include <string_view>

namespace spartan {

struct EmbeddedFile {
  const char* path;  ///< where a page asks for it
  const char* type;  ///< MIME
  std::string_view content;
};

}  // namespace spartan
