// Examples in the documentation, for tests that read them as a user would.
#pragma once

#include <fstream>
#include <sstream>
#include <string>

#include "spartan/testing/real_data.h"

namespace spartan::testing {

/// The text of the fenced code block after `<!-- example: NAME -->` in docs/formats.md; empty if there is none.
inline std::string doc_example(const std::string& name) {
  std::ifstream file(source_folder() + "/docs/formats.md");
  std::stringstream text;
  text << file.rdbuf();
  const std::string page = text.str();
  const std::size_t mark = page.find("<!-- example: " + name + " -->\n```");
  if (mark == std::string::npos) return {};
  const std::size_t begin = page.find('\n', page.find("```", mark)) + 1;
  return page.substr(begin, page.find("```", begin) - begin);
}

}  // namespace spartan::testing
