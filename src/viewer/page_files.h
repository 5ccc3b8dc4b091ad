// The files of the page, carried in the program: those of viewer/page, and three.js.
#pragma once

#include <span>
#include <string_view>

namespace spartan::viewer {

struct PageFile {
  const char* path;  ///< of the request
  const char* type;  ///< MIME
  std::string_view content;
};
std::span<const PageFile> page_files();

}  // namespace spartan::viewer
