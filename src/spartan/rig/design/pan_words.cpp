#include "spartan/rig/design/pan_words.h"

#include <fmt/format.h>

namespace spartan {

std::string in_words(const AzimuthSet& set, const std::string& degrees) {
  if (set.empty()) return "nowhere";
  std::string text;
  for (const AzimuthSector& sector : set.sectors()) {
    text += fmt::format("{}{:.1f} to {:.1f}", text.empty() ? "" : ", ", sector.from_deg, sector.to_deg);
  }
  return text + degrees;
}

std::string in_words(const PanOverlap& overlap, const std::string& degrees) {
  if (overlap.percent() >= 0) return fmt::format("overlap by {:.1f} %", overlap.percent());
  return fmt::format("leave a gap of {:.1f}{}", overlap.gap_deg(), degrees);
}

std::string overlaps_in_words(const PanFigures& pans, const std::string& degrees) {
  const PanOverlap &nominal = pans.overlap.value(), &one_eye = pans.far_overlap.value();
  const auto& both_eyes = pans.far_overlap_stereo;
  if (both_eyes && nominal.percent() >= 0 && one_eye.percent() >= 0 && both_eyes->percent() >= 0) {
    return fmt::format(
        "Neighbouring pans overlap by {:.1f} % of the view, at the far edge by {:.1f} % (one eye) and {:.1f} % (both "
        "eyes)",
        nominal.percent(), one_eye.percent(), both_eyes->percent());
  }
  if (both_eyes && nominal.percent() < 0 && one_eye.percent() < 0 && both_eyes->percent() < 0) {
    return fmt::format(
        "Neighbouring pans leave a gap of {:.1f}{}, at the far edge of {:.1f}{} (one eye) and {:.1f}{} (both eyes)",
        nominal.gap_deg(), degrees, one_eye.gap_deg(), degrees, both_eyes->gap_deg(), degrees);
  }
  const std::string shared = both_eyes ? in_words(*both_eyes, degrees) + " (both eyes)" : "both eyes share nothing";
  return fmt::format("Neighbouring pans {}{}; at the far edge they {} (one eye), {}", in_words(nominal, degrees),
                     nominal.percent() >= 0 ? " of the view" : "", in_words(one_eye, degrees), shared);
}

}  // namespace spartan
