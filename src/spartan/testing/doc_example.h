// Examples in the documentation, for tests that read them as a user would.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "spartan/testing/real_data.h"

namespace spartan::testing {

/// The text of a page of docs/reference, by its name without ending.
inline std::string reference_page(const std::string& name) {
  std::ifstream file(source_folder() + "/docs/reference/" + name + ".md");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The text of the fenced code block after `<!-- example: NAME -->` in a page of docs/reference; empty if there is
/// none.
inline std::string doc_example(const std::string& name) {
  for (const auto& entry : std::filesystem::directory_iterator(source_folder() + "/docs/reference")) {
    if (entry.path().extension() != ".md") continue;
    const std::string page = reference_page(entry.path().stem().string());
    const std::size_t mark = page.find("<!-- example: " + name + " -->\n```");
    if (mark == std::string::npos) continue;
    const std::size_t begin = page.find('\n', page.find("```", mark)) + 1;
    return page.substr(begin, page.find("```", begin) - begin);
  }
  return {};
}

}  // namespace spartan::testing
