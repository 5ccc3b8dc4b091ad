#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/core/pose.h"
#include "spartan/core/strict_yaml.h"
#include "spartan/rig_design/internal/stereo_relations.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan {

using namespace internal;

namespace {

constexpr int kSchema = 1;
constexpr std::size_t kMaxListLength = 1000;
constexpr std::size_t kLongestName = 24;  // letters
constexpr double kTiltSteps = 0.1;        // default step, of the angle of the ground at the range below the horizon

// Bounds of a value, both included.
struct Limits {
  double low, high;
};
constexpr Limits kLength_m{1e-6, 1e6}, kView_deg{0.1, 179}, kAngle_deg{1e-6, 180}, kPercent{1e-6, 100},
    kPixel_um{0.01, 1000}, kSide_px{1, 1e6}, kAccuracy_px{1e-6, 1e3}, kTilt_deg{0.01, 90}, kPan_deg{-180, 180};

bool within(double value, const Limits& limits) {
  return value >= limits.low && value <= limits.high;
}

std::optional<double> bounded(YamlMap& map, const char* key, const Limits& limits) {
  const auto value = map.number(key);
  if (!value || within(*value, limits)) return value;
  map.add_error(key, fmt::format("is {}, must be between {} and {}", *value, limits.low, limits.high));
  return std::nullopt;
}

std::optional<double> optional_bounded(YamlMap& map, const char* key, const Limits& limits) {
  return map.optional_node(key) ? bounded(map, key, limits) : std::nullopt;
}

std::optional<int> whole(YamlMap& map, const char* key, const Limits& limits) {
  const auto value = map.integer(key);
  if (!value || within(*value, limits)) return value;
  map.add_error(key, fmt::format("is {}, must be between {} and {}", *value, limits.low, limits.high));
  return std::nullopt;
}

// Rounded to 9 decimals, so that each value is the double nearest to its decimal: 0.05 + 10 · 0.01 is exactly 0.15.
std::vector<double> stepped(double from, double to, double step) {
  const auto count = static_cast<int>(std::round((to - from) / step));
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(count) + 1);
  for (int i = 0; i <= count; ++i) values.push_back(std::round((from + i * step) * 1e9) / 1e9);
  return values;
}

// {from, to, step}.
std::optional<std::vector<double>> read_steps(YamlMap& map, const char* key, const YamlNode& node) {
  YamlMap steps(node, map.path(key), map.errors());
  const auto from = steps.number("from"), to = steps.number("to"), step = steps.number("step");
  steps.reject_unknown_keys();
  if (!from || !to || !step) return std::nullopt;
  if (!(*step > 0) || *to < *from) {
    steps.add_error(*step > 0 ? "to" : "step", *step > 0 ? "is below from" : "must be positive");
    return std::nullopt;
  }
  const double count = (*to - *from) / *step;
  if (!(count < static_cast<double>(kMaxListLength))) {
    steps.add_error("step", fmt::format("gives more than {} values", kMaxListLength));
    return std::nullopt;
  }
  if (std::abs(count - std::round(count)) > 1e-6) {
    steps.add_error("step", fmt::format("does not divide the range from {} to {} evenly", *from, *to));
    return std::nullopt;
  }
  return stepped(*from, *to, *step);
}

std::optional<std::vector<double>> read_listed(YamlMap& map, const char* key, const YamlNode& node) {
  if (node.items().empty() || node.items().size() > kMaxListLength) {
    map.add_error(key, fmt::format("has {} entries, must have 1 to {}", node.items().size(), kMaxListLength));
    return std::nullopt;
  }
  std::vector<double> values;
  for (const YamlNode& entry : node.items()) {
    const auto value = entry.is_scalar() ? parse_finite_number(entry.scalar()) : std::nullopt;
    if (!value) {
      map.add_error(key, "must hold finite numbers only");
      return std::nullopt;
    }
    values.push_back(*value);
  }
  return values;
}

// A list [a, b, …] or {from, to, step}; every value within limits, without duplicates. `absent`: where the key is
// missing; empty: it must be there.
std::vector<double> read_values(YamlMap& map, const char* key, const Limits& limits,
                                const std::vector<double>& absent = {}) {
  const auto node = absent.empty() ? map.node(key) : map.optional_node(key);
  if (!node) return absent;
  if (!node->is_list() && !node->is_map()) {
    map.add_error(key, "must be a list of numbers, or {from, to, step}");
    return {};
  }
  const auto values = node->is_map() ? read_steps(map, key, *node) : read_listed(map, key, *node);
  if (!values) return {};
  for (const double value : *values) {
    if (within(value, limits)) continue;
    map.add_error(key, fmt::format("holds {}, must be between {} and {}", value, limits.low, limits.high));
    return {};
  }
  std::vector<double> sorted = *values;
  std::sort(sorted.begin(), sorted.end());
  if (const auto duplicate = std::adjacent_find(sorted.begin(), sorted.end()); duplicate != sorted.end()) {
    map.add_error(key, fmt::format("holds {} twice", *duplicate));
    return {};
  }
  return *values;
}

CandidateLists read_lists(YamlMap map) {
  CandidateLists lists;
  lists.baselines_m = read_values(map, "baselines_m", kLength_m, stepped(0.05, 0.50, 0.05));
  lists.nearest_m = read_values(map, "nearest_m", kLength_m, stepped(0.5, 1.5, 0.1));
  lists.hfov_deg = read_values(map, "hfov_deg", kView_deg, stepped(40, 90, 5));
  lists.pixel_sizes_um = read_values(map, "pixel_sizes_um", kPixel_um, {3.45, 5.5});
  for (const double width : read_values(map, "widths_px", kSide_px, {640, 1024, 1280, 1920})) {
    if (width != std::floor(width)) map.add_error("widths_px", fmt::format("holds {}, must be whole numbers", width));
    lists.widths_px.push_back(static_cast<int>(width));
  }
  map.reject_unknown_keys();
  return lists;
}

PanRequirements read_pans(YamlMap map) {
  PanRequirements pans;
  pans.angles_deg = read_values(map, "angles_deg", kPan_deg);
  std::sort(pans.angles_deg.begin(), pans.angles_deg.end());
  pans.azimuth_deg = bounded(map, "azimuth_deg", {1e-6, 360}).value_or(0);
  pans.smallest_overlap_percent = optional_bounded(map, "smallest_overlap_percent", {0, 100}).value_or(0);
  map.reject_unknown_keys();
  return pans;
}

PublishedPair read_published(YamlMap map) {
  PublishedPair published;
  published.parameters.baseline_m = bounded(map, "baseline_m", kLength_m).value_or(1);
  published.parameters.nearest_m = bounded(map, "nearest_m", kLength_m).value_or(1);
  published.parameters.hfov_deg = bounded(map, "hfov_deg", kView_deg).value_or(1);
  published.parameters.pixel_size_um = bounded(map, "pixel_size_um", kPixel_um).value_or(1);
  published.parameters.width_px = whole(map, "width_px", kSide_px).value_or(1);
  if (map.optional_node("height_px")) published.height_px = whole(map, "height_px", kSide_px);
  published.vfov_deg = optional_bounded(map, "vfov_deg", kView_deg);
  published.focal_length_mm = optional_bounded(map, "focal_length_mm", {1e-3, 1e5});
  published.tilt_deg = optional_bounded(map, "tilt_deg", kTilt_deg);
  map.reject_unknown_keys();
  return published;
}

std::vector<DesignCriterion> read_order(YamlMap& map) {
  const struct {
    const char* name;
    DesignCriterion criterion;
  } kKnown[] = {{"range_margin", DesignCriterion::range_margin},
                {"pan_overlap", DesignCriterion::pan_overlap},
                {"shorter_baseline", DesignCriterion::shorter_baseline}};
  std::vector<DesignCriterion> order;
  const auto node = map.optional_node("order");
  if (!node) return {DesignCriterion::range_margin, DesignCriterion::pan_overlap, DesignCriterion::shorter_baseline};
  if (!node->is_list() || node->items().empty()) {
    map.add_error("order", "must be a list of: range_margin, pan_overlap, shorter_baseline");
    return order;
  }
  for (const YamlNode& entry : node->items()) {
    const auto* known = std::find_if(std::begin(kKnown), std::end(kKnown),
                                     [&](const auto& k) { return entry.is_scalar() && entry.scalar() == k.name; });
    if (known == std::end(kKnown)) {
      map.add_error("order", "must hold range_margin, pan_overlap, shorter_baseline only");
      break;
    }
    if (std::find(order.begin(), order.end(), known->criterion) != order.end()) {
      map.add_error("order", fmt::format("holds {} twice", known->name));
      break;
    }
    order.push_back(known->criterion);
  }
  return order;
}

void read_limits(YamlMap& map, PairRequirements& pair) {
  pair.range_m = bounded(map, "range_m", kLength_m).value_or(1);
  // Defaults are what the published rover requires, docs/reference/requirements.md.
  pair.range_resolution_m = optional_bounded(map, "range_resolution_m", kLength_m).value_or(0.005 * pair.range_m);
  pair.disparity_accuracy_px = optional_bounded(map, "disparity_accuracy_px", kAccuracy_px).value_or(0.3);
  pair.largest_stereo_angle_deg = optional_bounded(map, "largest_stereo_angle_deg", kAngle_deg).value_or(15);
  pair.contradicting_stereo_angle_deg = optional_bounded(map, "contradicting_stereo_angle_deg", kAngle_deg);
  pair.largest_search_percent = optional_bounded(map, "largest_search_percent", kPercent).value_or(25);
  pair.smallest_baseline_m = optional_bounded(map, "smallest_baseline_m", {0, 1e6}).value_or(0);
  pair.smallest_height_m = optional_bounded(map, "smallest_height_m", {0, 1e6}).value_or(0);
  pair.height_m = bounded(map, "height_m", kLength_m).value_or(1);
  const double below_horizon_deg = std::atan(pair.height_m / pair.range_m) / kRadiansPerDegree;
  pair.tilt_step_deg =
      optional_bounded(map, "tilt_step_deg", {1e-3, 90}).value_or(std::min(1.0, kTiltSteps * below_horizon_deg));
  pair.rows_per_column = optional_bounded(map, "rows_per_column", {0.01, 100}).value_or(1);
}

// Consistency of several values; checked only where each value is valid by itself.
void check_consistency(YamlMap& map, const PairRequirements& pair) {
  const auto valid = [&](const char* key) { return !map.errors().has_error_near(map.path(key)); };
  if (valid("height_m") && valid("smallest_height_m") && pair.height_m < pair.smallest_height_m) {
    map.add_error("height_m", fmt::format("is {}, below smallest_height_m, {}", pair.height_m, pair.smallest_height_m));
  }
  const double below_horizon_deg = std::atan(pair.height_m / pair.range_m) / kRadiansPerDegree;
  if (valid("height_m") && valid("range_m") && valid("tilt_step_deg") && pair.tilt_step_deg >= below_horizon_deg) {
    map.add_error("tilt_step_deg", fmt::format("is {}; the ground at range_m is only {:.3f} degrees below the horizon",
                                               pair.tilt_step_deg, below_horizon_deg));
  }
  if (!pair.published || !valid("published") || !valid("rows_per_column")) return;
  const PublishedPair& published = *pair.published;
  const double vfov_deg = published.vfov_deg.value_or(
      vertical_view_rad(published.parameters.hfov_deg * kRadiansPerDegree, pair.published_rows_per_column()) /
      kRadiansPerDegree);
  if (published.tilt_deg && *published.tilt_deg <= vfov_deg / 2) {
    map.add_error("published.tilt_deg",
                  fmt::format("is {}, so the top row, {:.2f} degrees higher, would be above the horizon",
                              *published.tilt_deg, vfov_deg / 2));
  }
}

PairRequirements read_pair(YamlMap map) {
  PairRequirements pair;
  read_limits(map, pair);
  // Without candidates those of an empty group.
  const YamlNode lists = map.optional_node("candidates").value_or(YamlNode::map_of({}));
  pair.lists = read_lists(YamlMap(lists, map.path("candidates"), map.errors()));
  if (const std::size_t count = pair.lists.combinations(); count > kMostCombinations) {
    map.add_error("candidates", fmt::format("has {} combinations, at most {} are allowed", count, kMostCombinations));
  }
  pair.order = read_order(map);
  if (const auto pans = map.optional_node("pans"))
    pair.pans = read_pans(YamlMap(*pans, map.path("pans"), map.errors()));
  if (const auto published = map.optional_node("published")) {
    pair.published = read_published(YamlMap(*published, map.path("published"), map.errors()));
  }
  map.reject_unknown_keys();
  check_consistency(map, pair);
  return pair;
}

// Why a pair cannot have this name; empty if it can. The JSON of a design has it as a key, its table as a word.
std::string fault_of_name(const std::string& name) {
  constexpr std::array<std::string_view, 14> kReserved{"schema",
                                                       "pairs",
                                                       "view_overlap_m",
                                                       "warnings",
                                                       "reasons",
                                                       "azimuth_far_deg",
                                                       "azimuth_held_to_m",
                                                       "azimuth_held_from_m",
                                                       "azimuth_far_stereo_deg",
                                                       "pan_overlap_percent",
                                                       "pan_overlap_far_percent",
                                                       "pan_overlap_far_stereo_percent",
                                                       "azimuth_far_sectors_deg",
                                                       "azimuth_far_stereo_sectors_deg"};
  if (std::find(kReserved.begin(), kReserved.end(), name) != kReserved.end())
    return "cannot be the name of a pair: it has another meaning in the JSON of a design";
  const auto allowed = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-'; };
  if (name.empty() || name.size() > kLongestName || !std::all_of(name.begin(), name.end(), allowed))
    return fmt::format("is not a name of a pair: use 1 to {} letters, digits, '_' and '-'", kLongestName);
  return {};
}

std::vector<PairRequirements> read_pairs(YamlMap map) {
  std::vector<PairRequirements> pairs;
  for (const auto& [name, node] : map.entries()) {
    if (const std::string fault = fault_of_name(name); !fault.empty()) {
      map.add_error(name, fault);
      continue;
    }
    PairRequirements pair = read_pair(YamlMap(node, map.path(name), map.errors()));
    pair.name = name;
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

RigRequirements read_root(YamlMap root, const std::string& default_name) {
  RigRequirements requirements;
  if (const auto schema = root.integer("schema"); schema && *schema != kSchema) {
    root.add_error("schema", fmt::format("is {}; this version reads schema {}", *schema, kSchema));
  }
  requirements.name = root.optional_node("name") ? root.text("name").value_or(default_name) : default_name;
  if (const auto pairs = root.optional_node("pairs")) {
    requirements.pairs = read_pairs(YamlMap(*pairs, "pairs", root.errors()));
  }
  // Files of version 0.1 have these two pairs at the top.
  for (const char* name : {"wide", "narrow"}) {
    const auto node = root.optional_node(name);
    if (!node) continue;
    requirements.pairs.push_back(read_pair(YamlMap(*node, name, root.errors())));
    requirements.pairs.back().name = name;
  }
  root.reject_unknown_keys();
  if (requirements.pairs.empty() && !root.errors().has_error_near("pairs"))
    root.add_error("pairs", "is missing: name at least one pair, with its requirements");
  for (std::size_t i = 0; i < requirements.pairs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (requirements.pairs[j].name == requirements.pairs[i].name)
        root.add_error("pairs." + requirements.pairs[i].name, "is given twice, once outside of pairs");
    }
  }
  return requirements;
}

}  // namespace

std::size_t RigRequirements::panned() const {
  const auto found = std::find_if(pairs.begin(), pairs.end(), [](const PairRequirements& pair) { return pair.pans; });
  return found == pairs.end() ? 0 : static_cast<std::size_t>(found - pairs.begin());
}

std::size_t CandidateLists::combinations() const {
  return baselines_m.size() * nearest_m.size() * hfov_deg.size() * pixel_sizes_um.size() * widths_px.size();
}

double PanRequirements::widest_step_deg() const {
  double widest = 0;
  for (std::size_t i = 1; i < angles_deg.size(); ++i) widest = std::max(widest, angles_deg[i] - angles_deg[i - 1]);
  if (angles_deg.size() > 1 && azimuth_deg >= 360) {
    widest = std::max(widest, 360 - (angles_deg.back() - angles_deg.front()));
  }
  return widest;
}

double PairRequirements::published_rows_per_column() const {
  if (!published || !published->height_px) return rows_per_column;
  return static_cast<double>(*published->height_px) / published->parameters.width_px;
}

Result<RigRequirements> parse_requirements(const std::string& text, const std::string& name) {
  const auto loaded = parse_yaml(text, name);
  if (!loaded) return failure(loaded);
  YamlErrors errors(name);
  RigRequirements requirements = read_root(YamlMap(*loaded, "", errors), std::filesystem::path(name).stem().string());
  if (const Status status = errors.status(); !status) return failure(status);
  return requirements;
}

Result<RigRequirements> read_requirements(const std::string& path) {
  const auto text = read_file(path);
  if (!text) return failure(text);
  return parse_requirements(*text, path);
}

}  // namespace spartan
