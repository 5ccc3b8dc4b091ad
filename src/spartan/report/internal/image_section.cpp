#include "spartan/report/internal/image_section.h"

#include <fmt/format.h>

#include <cstddef>
#include <vector>

#include "spartan/figures/html.h"
#include "spartan/figures/plot.h"
#include "spartan/image_io/image_io.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/report/internal/page_parts.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {
namespace {

constexpr std::size_t kDriveImages = 6, kTerrainViews = 3;

// One view of the terrain: the rectified left image beside its disparities.
Result<std::string> terrain_figures(const TerrainRecord& view, const std::string& folder, Recording& source,
                                    Imager& imager) {
  const auto disparity = read_pfm(folder + "/" + std::to_string(view.stamp.ns) + ".pfm");
  if (!disparity) return failure(disparity);
  std::string html;
  if (const auto frame = source.frame_at(view.pair, view.stamp)) {
    const auto rectified = imager.process(*frame);
    if (!rectified) return failure(rectified);
    html = html_image(
        shrunk(rectified->left, kPageImage_px),
        fmt::format("{} pair, left camera, at {:.2f} s, rectified", view.pair, seconds_between(Stamp(), view.stamp)));
  }
  const ColourBar bar{"disparity, px (near: red)", disparity_colour_range(*disparity), disparity_colour};
  return html + html_image(shrunk(colour_disparity(*disparity).view(), kPageImage_px),
                           fmt::format("Disparities: {:.0f} % of the pixels known (unknown: black), {} points in the "
                                       "point cloud",
                                       view.density_percent, view.points),
                           to_html(bar));
}

}  // namespace

// The left images along the drive.
Result<std::string> image_section(Recording& source, Imager& imager) {
  std::string html = "<div class=\"images\">";
  for (const StereoPair& pair : source.info().rig.pairs) {
    if (!pair.for_odometry) continue;
    const std::vector<Stamp> stamps = source.listed_stamps(pair.name);
    for (const std::size_t i : spread_indices(stamps.size(), kDriveImages)) {
      const auto frame = source.frame_at(pair.name, stamps[i]);
      if (!frame) continue;
      const auto view = imager.process(*frame);
      if (!view && view.error().code == ErrorCode::frame_rejected) continue;  // the run has skipped it as well
      if (!view) return failure(view);
      html += html_image(
          shrunk(view->left, kPageImage_px),
          fmt::format("{} pair, left camera, after {:.1f} s", pair.name, seconds_between(stamps.front(), stamps[i])));
    }
  }
  return html + "</div>\n";
}

Result<std::string> terrain_section(Recording& source, Imager& imager, const std::string& run, RunStore& store) {
  const auto views = store.terrain();
  if (!views) return failure(views);
  if (views->empty()) return std::string();
  std::string html = fmt::format("<p>Views reconstructed in 3D: {}.</p>\n<div class=\"images\">", views->size());
  for (const std::size_t i : spread_indices(views->size(), kTerrainViews)) {
    const auto figures = terrain_figures((*views)[i], RunFolder{run}.terrain(), source, imager);
    if (!figures) return failure(figures);
    html += *figures;
  }
  return html + "</div>\n";
}

}  // namespace spartan::internal
