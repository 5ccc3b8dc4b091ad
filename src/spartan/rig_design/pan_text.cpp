#include <fmt/format.h>

#include "spartan/rig_design/rig_designer.h"

namespace spartan {

std::string to_text(const AzimuthSet& set, const std::string& degrees) {
  if (set.empty()) return "nowhere";
  std::string text;
  for (const AzimuthSector& sector : set.sectors()) {
    text += fmt::format("{}{:.1f} to {:.1f}", text.empty() ? "" : ", ", sector.from_deg, sector.to_deg);
  }
  return text + degrees;
}

std::string to_text(const PanOverlap& overlap, const std::string& degrees) {
  if (overlap.percent() >= 0) return fmt::format("overlap by {:.1f} %", overlap.percent());
  return fmt::format("leave a gap of {:.1f}{}", overlap.gap_deg(), degrees);
}

std::string describe_overlaps(const PanCoverage& pans, const std::string& degrees) {
  const PanOverlap &nominal = pans.overlap.value(), &one_camera = pans.far_overlap.value();
  const auto& both_cameras = pans.far_overlap_stereo;
  if (both_cameras && nominal.percent() >= 0 && one_camera.percent() >= 0 && both_cameras->percent() >= 0) {
    return fmt::format(
        "Neighbouring pans overlap by {:.1f} % of the view, at the far edge by {:.1f} % (one camera) and {:.1f} % "
        "(both "
        "cameras)",
        nominal.percent(), one_camera.percent(), both_cameras->percent());
  }
  if (both_cameras && nominal.percent() < 0 && one_camera.percent() < 0 && both_cameras->percent() < 0) {
    return fmt::format(
        "Neighbouring pans leave a gap of {:.1f}{}, at the far edge of {:.1f}{} (one camera) and {:.1f}{} (both "
        "cameras)",
        nominal.gap_deg(), degrees, one_camera.gap_deg(), degrees, both_cameras->gap_deg(), degrees);
  }
  const std::string shared =
      both_cameras ? to_text(*both_cameras, degrees) + " (both cameras)" : "both cameras share no ground";
  return fmt::format("Neighbouring pans {}{}; at the far edge they {} (one camera), {}", to_text(nominal, degrees),
                     nominal.percent() >= 0 ? " of the view" : "", to_text(one_camera, degrees), shared);
}

}  // namespace spartan
