// The frame of a self-contained HTML page: contents, style, and the script of its plots.
#pragma once

#include <string>
#include <vector>

namespace spartan::internal {

struct PageSection {
  std::string title;
  std::string body;  ///< HTML
};

/// `header`: HTML above the contents. Sections without a body are left out.
std::string html_page(const std::string& title, const std::string& header, const std::vector<PageSection>& sections);

/// The script that switches layers of plots, zooms them, and reads values from them (page_script.cpp).
extern const char* const kPlotScript;

}  // namespace spartan::internal
