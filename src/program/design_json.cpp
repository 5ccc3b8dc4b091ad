// A rig design as JSON.
#include <fmt/format.h>

#include <algorithm>

#include "program/design_report.h"
#include "program/json.h"

namespace spartan::program {
namespace {

Json figures_json(const PairMetrics& pair) {
  const PairMargins& margins = pair.margins;
  return {{"baseline_m", number(pair.parameters.baseline_m)},
          {"nearest_m", number(pair.parameters.nearest_m)},
          {"hfov_deg", number(pair.parameters.hfov_deg)},
          {"width_px", pair.parameters.width_px},
          {"pixel_size_um", number(pair.parameters.pixel_size_um)},
          {"range_m", number(pair.range_m)},
          {"focal_length_mm", number(pair.focal_length_mm)},
          {"stereo_angle_deg", number(pair.stereo_angle_deg)},
          {"search_percent", number(pair.search_percent)},
          {"pan_overlap_percent", number(pair.pan_overlap_percent)},
          {"vfov_deg", number(pair.vfov_deg)},
          {"tilt_deg", number(pair.tilt_deg)},
          {"view_near_m", number(pair.view_near_m)},
          {"view_far_m", number(pair.view_far_m)},
          {"margins",
           {{"range_m", number(margins.range_m)},
            {"stereo_angle_deg", number(margins.stereo_angle_deg)},
            {"search_percent", number(margins.search_percent)},
            {"baseline_m", number(margins.baseline_m)},
            {"pan_overlap_percent", number(margins.pan_overlap_percent)}}}};
}

Json published_json(const PairDesign& design) {
  if (!design.published) return nullptr;
  Json json = {{"feasible", design.published->feasible}, {"is_candidate", design.published_is_candidate}};
  json.update(figures_json(*design.published));
  return json;
}

// Without the feasible set.
Json pair_json(const PairDesign& design) {
  const auto or_null = [](const PairMetrics* pair) { return pair ? figures_json(*pair) : Json(nullptr); };
  Json json = {{"combinations", design.combinations}, {"feasible_count", design.feasible.size()}};
  json["with_pan_overlap_count"] = design.with_pan_overlap_count ? Json(*design.with_pan_overlap_count) : Json(nullptr);
  json["best"] = or_null(design.best());
  json["equally_good"] = design.equally_good;
  json["best_with_pan_overlap"] = or_null(design.best_with_pan_overlap ? &*design.best_with_pan_overlap : nullptr);
  json["nearest"] = or_null(design.nearest ? &*design.nearest : nullptr);
  json["published"] = published_json(design);
  json["nearest_to_a_limit"] = number(design.smallest_limit_distance);
  return json;
}

Json sectors_json(const AzimuthSet& set) {
  Json json = Json::array();
  for (const AzimuthSector& sector : set.sectors()) json.push_back({number(sector.from_deg), number(sector.to_deg)});
  return json;
}

// The figures of all pans, each null and with its reason where there is none.
class GroundJson {
 public:
  explicit GroundJson(const RigDesign& design) {
    const auto none = std::find_if(design.pairs.begin(), design.pairs.end(),
                                   [](const PairDesign& pair) { return pair.selected() == nullptr; });
    const std::string no_pair =
        none == design.pairs.end() ? "" : fmt::format("no {} pair is feasible or published", none->name);
    add("view_overlap_m", number(design.view_overlap_m), no_pair.empty() ? "there is only one pair" : no_pair);
    if (design.pans) {
      add_pans(*design.pans);
      return;
    }
    const bool without_pans = std::none_of(design.pairs.begin(), design.pairs.end(),
                                           [](const PairDesign& pair) { return pair.pans_required; });
    for (const char* key : {"pan_overlap_percent", "pan_overlap_far_percent", "pan_overlap_far_stereo_percent",
                            "azimuth_far_deg", "azimuth_far_stereo_deg", "azimuth_held_from_m", "azimuth_held_to_m",
                            "azimuth_far_sectors_deg", "azimuth_far_stereo_sectors_deg"}) {
      add(key, nullptr, without_pans ? "no pans are required" : "the pair with pans is neither feasible nor published");
    }
  }
  const Json& figures() const { return figures_; }
  const Json& reasons() const { return reasons_; }

 private:
  void add_pans(const PanCoverage& pans) {
    const auto percent = [](const std::optional<PanOverlap>& overlap) {
      return overlap ? number(overlap->percent()) : Json(nullptr);
    };
    const char* single = "there is a single pan";
    const DistanceSpan held = pans.full_coverage.value_or(DistanceSpan{});
    add("pan_overlap_percent", percent(pans.overlap), single);
    add("pan_overlap_far_percent", percent(pans.far_overlap), single);
    add("pan_overlap_far_stereo_percent", percent(pans.far_overlap_stereo),
        pans.overlap ? "the two cameras share no ground" : single);
    add("azimuth_far_deg", number(pans.azimuth_far.width_deg()));
    add("azimuth_far_stereo_deg", number(pans.azimuth_far_stereo.width_deg()));
    add("azimuth_held_from_m", number(held.from_m));
    add("azimuth_held_to_m", number(held.to_m));
    add("azimuth_far_sectors_deg", sectors_json(pans.azimuth_far));
    add("azimuth_far_stereo_sectors_deg", sectors_json(pans.azimuth_far_stereo));
  }

  void add(const char* key, const Json& figure, const std::string& why_null = "it is not finite") {
    figures_[key] = figure;
    if (figure.is_null()) reasons_[key] = why_null;
  }

  Json figures_ = Json::object(), reasons_ = Json::object();
};

Json warnings_json(const RigDesign& design) {
  Json json = Json::array();
  for (const DesignWarning& warning : design.warnings) {
    json.push_back(
        {{"id", warning.id}, {"pair", warning.pair}, {"text", warning.text}, {"value", number(warning.value)}});
  }
  return json;
}

// Collects small pieces and hands over large ones; after a failure nothing more.
class Pieces {
 public:
  explicit Pieces(const std::function<Status(const std::string&)>& write) : write_(write) {}

  void add(const std::string& piece) {
    text_ += piece;
    if (text_.size() >= kLarge) hand_over();
  }
  const Status& finish() {
    hand_over();
    return status_;
  }
  bool failed() const { return !status_; }

 private:
  static constexpr std::size_t kLarge = std::size_t{1} << 20;

  void hand_over() {
    if (status_ && !text_.empty()) status_ = write_(text_);
    text_.clear();
  }

  const std::function<Status(const std::string&)>& write_;
  std::string text_;
  Status status_;
};

// The text of a value nested `levels` deep. Line ends inside its strings are escaped.
std::string dump_inside(const Json& json, std::size_t levels) {
  std::string text;
  for (const char letter : text_of(json)) {
    text += letter;
    if (letter == '\n') text.append(2 * levels, ' ');
  }
  return text;
}

void add_pair(Pieces& pieces, const PairDesign& design, bool whole_set) {
  std::string text = dump_inside(pair_json(design), 1);
  if (!whole_set) {
    pieces.add(text);
    return;
  }
  text.resize(text.rfind('\n'));  // the object goes on
  pieces.add(text + ",\n    \"feasible\": [");
  const char* separator = "\n      ";
  for (const PairMetrics& pair : design.feasible) {
    if (pieces.failed()) return;
    pieces.add(separator + dump_inside(figures_json(pair), 3));
    separator = ",\n      ";
  }
  pieces.add(design.feasible.empty() ? "]\n  }" : "\n    ]\n  }");
}

}  // namespace

Status write_design_json(const RigDesign& design, bool whole_set,
                         const std::function<Status(const std::string&)>& write) {
  Pieces pieces(write);
  pieces.add("{\n  \"schema\": 1");
  Json names = Json::array();
  for (const PairDesign& pair : design.pairs) {
    names.push_back(pair.name);
    pieces.add(",\n  " + text_of(Json(pair.name)) + ": ");
    add_pair(pieces, pair, whole_set);
  }
  const GroundJson ground(design);
  Json rest = ground.figures();
  rest["pairs"] = names;
  rest["reasons"] = ground.reasons();
  rest["warnings"] = warnings_json(design);
  // Its members go on where those above end: without its opening brace.
  pieces.add("," + text_of(rest).substr(1) + "\n");
  return pieces.finish();
}

}  // namespace spartan::program
