#include "spartan/report/internal/image_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "spartan/figures/html.h"
#include "spartan/figures/plot.h"
#include "spartan/image_io/image_io.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {
namespace {

constexpr int kDriveImages = 6, kTerrainViews = 3, kImageWidth_px = 440;

// One view of the terrain: the rectified left image beside its disparities.
Result<std::string> terrain_figures(const TerrainRecord& view, const std::string& folder, FrameSource& source,
                                    Imager& imager) {
  const auto disparity = read_pfm(folder + "/" + std::to_string(view.stamp.ns) + ".pfm");
  if (!disparity) return failure(disparity);
  std::string html;
  if (const auto frame = source.frame_at(view.pair, view.stamp)) {
    const auto rectified = imager.process(*frame);
    if (!rectified) return failure(rectified);
    html = html_image(
        shrunk(rectified->left, kImageWidth_px),
        fmt::format("{} pair, left camera, at {:.2f} s, rectified", view.pair, seconds_between(Stamp(), view.stamp)));
  }
  const ColourBar bar{"disparity, px (near: red)", disparity_colour_range(*disparity), disparity_colour};
  return html + html_image(shrunk(colour_disparity(*disparity).view(), kImageWidth_px),
                           fmt::format("Disparities: {:.0f} % of the pixels known (unknown: black), {} points in the "
                                       "point cloud",
                                       view.density_percent, view.points),
                           to_html(bar));
}

}  // namespace

// The left images along the drive.
Result<std::string> image_section(FrameSource& source, Imager& imager) {
  std::string html = "<div class=\"images\">";
  for (const StereoPair& pair : source.info().rig.pairs) {
    if (!pair.for_odometry) continue;
    const std::vector<Stamp> stamps = source.listed_stamps(pair.name);
    const int count = std::min<int>(kDriveImages, static_cast<int>(stamps.size()));
    for (int i = 0; i < count; ++i) {
      const Stamp stamp =
          stamps[count > 1 ? static_cast<std::size_t>(i) * (stamps.size() - 1) / static_cast<std::size_t>(count - 1)
                           : 0];
      const auto frame = source.frame_at(pair.name, stamp);
      if (!frame) continue;
      const auto view = imager.process(*frame);
      if (!view && view.error().code == ErrorCode::frame_rejected) continue;  // the run has skipped it as well
      if (!view) return failure(view);
      html += html_image(
          shrunk(view->left, kImageWidth_px),
          fmt::format("{} pair, left camera, after {:.1f} s", pair.name, seconds_between(stamps.front(), stamp)));
    }
  }
  return html + "</div>\n";
}

Result<std::string> terrain_section(FrameSource& source, Imager& imager, const std::string& run, RunStore& store) {
  const auto views = store.terrain();
  if (!views) return failure(views);
  if (views->empty()) return std::string();
  std::string html = fmt::format("<p>Views reconstructed in 3D: {}.</p>\n<div class=\"images\">", views->size());
  const std::size_t count = std::min<std::size_t>(kTerrainViews, views->size());
  for (std::size_t i = 0; i < count; ++i) {
    const TerrainRecord& view = (*views)[count > 1 ? i * (views->size() - 1) / (count - 1) : 0];
    const auto figures = terrain_figures(view, RunFolder{run}.terrain(), source, imager);
    if (!figures) return failure(figures);
    html += *figures;
  }
  return html + "</div>\n";
}

}  // namespace spartan::internal
