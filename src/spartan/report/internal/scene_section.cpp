#include "spartan/report/internal/scene_section.h"

#include <cstddef>

#include "spartan/figures/html.h"
#include "spartan/figures/scene_files.h"
#include "spartan/report/internal/page_parts.h"
#include "spartan/report/report.h"
#include "spartan/system/map_files.h"

namespace spartan::internal {
namespace {

constexpr std::int64_t kMostSceneCells = 150'000;
constexpr std::size_t kMostSceneFrames = 1500;

constexpr const char* kFigure = R"html(<figure class="solid">
<div class="legend"><label>Colour <select id="colour-by">
<option value="colour">image</option><option value="elevation_m">elevation</option><option value="class">class</option>
<option value="cost">cost</option><option value="sigma_m">σ of elevation</option></select></label></div>
<div id="scene" role="img" tabindex="0" aria-label="The terrain in 3D. Drag to turn, wheel or pinch to zoom, arrow keys to move, Shift and arrow keys to turn, + and − to zoom."></div>
<div class="legend" id="scene-legend"></div>
<figcaption>The global map and the trajectories; the rover is at its last position. Drag turns, wheel or pinch zooms; so do Shift with the arrow keys, and + and −.</figcaption>
</figure>
)html";

// Without WebGL the section says so.
constexpr const char* kSceneScript = R"js(
(() => {
  'use strict';
  const at = id => document.getElementById(id);
  if (!document.createElement('canvas').getContext('webgl')) {
    at('scene').textContent = 'This browser does not draw in 3D (WebGL).';
    return;
  }
  const bytes = Uint8Array.from(atob(at('scene-map').textContent), c => c.charCodeAt(0));
  const frames = JSON.parse(at('scene-frames').textContent), scene = makeScene(at('scene'));
  scene.setFrames(frames);
  scene.setMap(bytes.buffer);
  scene.setTime(frames.pose.length - 1);
  const paint = () => scene.legend(at('scene-legend'), scene.colourBy(at('colour-by').value));
  at('colour-by').addEventListener('change', paint);
  paint();
})();
)js";

std::string columns_of_some(const std::vector<FrameRecord>& frames) {
  FrameColumns columns(0, frames.empty() ? Stamp() : frames.front().stamp);
  for (const std::size_t i : spread_indices(frames.size(), kMostSceneFrames)) {
    FrameRecord frame = frames[i];
    frame.times.clear();
    frame.message.clear();
    columns.add(frame);
  }
  return columns.json();
}

// JSON without "<", so that no text of a run ends the element that holds it.
std::string escaped(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

// Data of a page, as text that the parser of HTML leaves alone.
std::string data_element(const char* id, const std::string& text) {
  return std::string("<script type=\"text/plain\" id=\"") + id + "\">" + text + "</script>\n";
}

}  // namespace

Result<std::string> scene_section(const std::string& run, RunStore& store, const std::vector<FrameRecord>& frames) {
  const auto tiles = store.tiles().index();
  if (!tiles) return failure(tiles);
  if (tiles->empty() || scene_files().empty()) return std::string();
  auto saved = SavedMap::open(run);
  if (!saved) return failure(saved);
  const auto map = map_layers(*saved, kMostSceneCells);
  if (!map) return failure(map);
  std::string html = kFigure + data_element("scene-map", base64(*map)) +
                     data_element("scene-frames", escaped(columns_of_some(frames)));
  for (const EmbeddedFile& file : scene_files()) html += "<script>" + std::string(file.content) + "</script>\n";
  return html + "<script>" + kSceneScript + "</script>\n";
}

}  // namespace spartan::internal
