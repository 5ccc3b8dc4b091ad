#include "spartan/report/internal/page.h"

#include <fmt/format.h>

#include <cctype>

#include "spartan/figures/html.h"

namespace spartan::internal {
namespace {

// Sizes of letters in plots are in their own units: larger where a plot is shown smaller.
constexpr const char* kStyle = R"css(
:root { --orange: #b26a00; --light-blue: #2a7fb0; --blue: #0072b2; --purple: #a0507f; --ink: #2b2320; --soft: #5c4d43; --paper: #fbf7f2; --rule: #dcc7b4; --accent: #8a330f; }
* { box-sizing: border-box; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 0; color: var(--ink); background: var(--paper); }
.page { max-width: 1560px; margin: 0 auto; padding: 1rem; }
h1 { color: var(--accent); font-size: 1.75rem; line-height: 1.2; margin: .5rem 0; overflow-wrap: anywhere; }
h2 { border-bottom: 1px solid var(--rule); margin: 2rem 0 1rem; scroll-margin-top: 1rem; }
h3 { font-size: 1rem; margin: 1.5rem 0 .5rem; }
p { max-width: 75ch; }
a { color: var(--accent); }
.numbers { display: flex; flex-wrap: wrap; gap: .75rem 2.25rem; margin: 1rem 0; padding: 0; list-style: none; }
.numbers b { display: block; font-size: 1.4rem; line-height: 1.3; }
nav ul { display: flex; flex-wrap: wrap; gap: .25rem 1.25rem; list-style: none; padding: 0; margin: .5rem 0; }
figure { margin: 0; min-width: 0; }
figcaption { font-size: .875rem; color: var(--soft); }
.plot { margin-bottom: 1.25rem; }
.plot > figcaption { font-size: 1rem; font-weight: 600; color: var(--ink); }
.images { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 310px), 1fr)); gap: 1.25rem; }
.image { max-width: 460px; }
.image img { display: block; width: 100%; height: auto; border-radius: 4px; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); gap: 1.5rem; align-items: start; }
.chart { display: block; width: 100%; height: auto; background: #fff; border-radius: 4px; touch-action: pan-y; }
svg text { font: 12px system-ui, sans-serif; fill: #3d332c; }
.ticks path { stroke: #e6ddd3; fill: none; }
.area image { image-rendering: pixelated; }
.scale path { stroke: #1e1a18; stroke-width: 2; fill: none; }
.scale text { paint-order: stroke; stroke: #fff; stroke-width: 3px; }
.pointed { fill: none; stroke: #1e1a18; stroke-width: 2; pointer-events: none; }
.box { fill: #8a330f22; stroke: #8a330f; pointer-events: none; }
.legend { display: flex; flex-wrap: wrap; gap: .25rem .5rem; margin: .25rem 0; align-items: center; }
.key { display: inline-flex; gap: .4rem; align-items: center; font: inherit; font-size: .875rem; color: inherit; background: none; border: 1px solid transparent; padding: .1rem .4rem; border-radius: 4px; }
button.key { cursor: pointer; min-height: 1.75rem; }
button.key:hover, button:focus-visible { border-color: var(--soft); }
button[aria-pressed=false] { text-decoration: line-through; }
.zoom { margin-left: auto; display: inline-flex; gap: .25rem; }
.zoom button { font: inherit; min-width: 2rem; min-height: 1.75rem; border: 1px solid var(--rule); border-radius: 4px; background: #fff; color: var(--ink); cursor: pointer; }
.solid > #scene { width: 100%; aspect-ratio: 3 / 2; max-height: 700px; background: #dfe7ee; border-radius: 4px; overflow: hidden; touch-action: none; }
.solid .legend { margin: .4rem 0; }
.swatch, .ramp { display: inline-block; width: 1.1rem; height: .7rem; border-radius: 2px; }
.ramp { width: 7rem; }
select { font: inherit; min-height: 1.75rem; }
.readout { display: block; min-height: 1.5em; font-size: .875rem; font-variant-numeric: tabular-nums; }
.colours { display: flex; flex-wrap: wrap; gap: .25rem .75rem; align-items: center; font-size: .875rem; }
.colours svg { max-width: 100%; height: auto; }
.table { overflow-x: auto; max-width: 100%; margin: 1rem 0; }
caption { text-align: left; font-size: .875rem; color: var(--soft); padding-bottom: .25rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .9rem; text-align: right; border-bottom: 1px solid #e6d7c8; font-weight: normal; }
th[scope=col] { font-weight: 600; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
.text td { text-align: left; overflow-wrap: anywhere; }
.files { columns: 18rem; padding-left: 1.2rem; }
.files li { overflow-wrap: anywhere; }
code { overflow-wrap: anywhere; }
.warning { border-left: 4px solid #b3261e; padding: .25rem .75rem; background: #fff; }
@media (max-width: 600px) { svg text { font-size: 18px; } h1 { font-size: 1.4rem; } .bar text { font-size: 12px; } }
@media (min-width: 1200px) {
  .page { display: grid; grid-template-columns: 12rem minmax(0, 1fr); column-gap: 2.5rem; }
  header { grid-column: 1 / -1; }
  nav ul { flex-direction: column; position: sticky; top: 1rem; }
}
@media print { .zoom, nav { display: none; } }
)css";

// The name of an anchor: letters and digits of the title.
std::string anchor(const std::string& title) {
  std::string name;
  for (const char c : title) {
    const auto letter = static_cast<unsigned char>(c);
    name += std::isalnum(letter) != 0 ? static_cast<char>(std::tolower(letter)) : '-';
  }
  return name;
}

}  // namespace

std::string html_page(const std::string& title, const std::string& header, const std::vector<PageSection>& sections) {
  std::string contents, body;
  for (const PageSection& section : sections) {
    if (section.body.empty()) continue;
    contents += fmt::format("<li><a href=\"#{}\">{}</a></li>\n", anchor(section.title), html_text(section.title));
    body += fmt::format("<section aria-labelledby=\"{0}\"><h2 id=\"{0}\">{1}</h2>\n{2}</section>\n",
                        anchor(section.title), html_text(section.title), section.body);
  }
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         html_text(title) + "</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>" + kStyle +
         "</style></head><body><div class=\"page\">\n<header><h1>" + html_text(title) + "</h1>\n" + header +
         "</header>\n<nav aria-label=\"Contents\"><ul>\n" + contents + "</ul></nav>\n<main>\n" + body +
         "</main></div>\n<script>" + kPlotScript + "</script>\n</body></html>\n";
}

}  // namespace spartan::internal
