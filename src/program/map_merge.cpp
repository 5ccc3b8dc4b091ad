// spartan map merge: merges two global maps that share a world frame.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "program/json.h"
#include "program/map.h"
#include "spartan/numerics/median.h"
#include "spartan/system/map_files.h"

namespace spartan::program {
namespace {

/// Median difference in elevation, in standard deviations and in metres, above which two maps are unlikely to share a
/// world frame. Empirical.
constexpr double kSuspiciousSigmas = 3;
constexpr double kSuspicious_m = 0.03;

struct Agreement {
  int cells = 0;  // cells known in both maps
  double median_m = 0, spread_m = 0, sigma_m = 0;

  bool suspicious() const {
    return cells > 0 && std::abs(median_m) > std::max(kSuspicious_m, kSuspiciousSigmas * sigma_m);
  }
};

// Differences of the elevations of b and a, where both are known.
Result<Agreement> compare(GlobalMap& a, GlobalMap& b) {
  const LatticeWindow window = a.extent();
  if (window.cells() > GlobalMap::kMostCells) return Agreement();  // too large to compare
  const auto one = a.view(window), other = b.view(window);
  if (!one) return failure(one);
  if (!other) return failure(other);
  std::vector<double> off, sigmas;
  for (int r = 0; r < window.height; ++r) {
    for (int c = 0; c < window.width; ++c) {
      if (!(one->count(c, r) > 0) || !(other->count(c, r) > 0)) continue;
      off.push_back(static_cast<double>(other->elevation_m(c, r)) - one->elevation_m(c, r));
      sigmas.push_back(std::sqrt(static_cast<double>(one->variance_m2(c, r) + other->variance_m2(c, r))));
    }
  }
  Agreement agreement;
  if (off.empty()) return agreement;
  agreement.cells = static_cast<int>(off.size());
  agreement.median_m = median(off);
  for (double& d : off) d = std::abs(d - agreement.median_m);
  agreement.spread_m = 1.4826 * median(off);
  agreement.sigma_m = median(sigmas);
  return agreement;
}

struct MergeArguments {
  std::string a, b, output;
};

Result<ExitCode> merge(const Context& context, const MergeArguments& arguments) {
  if (Status s = expect_new_file(context, arguments.output); !s) return failure(s);
  auto a = SavedMap::open(arguments.a);
  if (!a) return failure(a);
  auto b = SavedMap::open(arguments.b);
  if (!b) return failure(b);
  if (a->map().cell_m() != b->map().cell_m()) {
    return failure(ErrorCode::configuration,
                   fmt::format("has cells of {} m, {} has {} m", b->map().cell_m(), arguments.a, a->map().cell_m()),
                   arguments.b, "only maps of equal cell size can be merged");
  }
  const auto agreement = compare(a->map(), b->map());
  if (!agreement) return failure(agreement);
  auto created = GlobalMap::create(a->options().slam.map, a->map().cell_m());
  if (!created) return failure(created);
  GlobalMap& both = *created;
  const std::size_t shared = a->map().shared_stops(b->map());
  std::array<GlobalMap*, 2> maps{&a->map(), &b->map()};
  if (shared == a->map().stops().size()) std::swap(maps[0], maps[1]);  // b contains a
  for (GlobalMap* map : maps) {
    if (Status s = both.merge(*map); !s) return failure(s);
  }
  if (Status s = MapFile::save(both, arguments.output); !s) return failure(s);
  if (agreement->suspicious()) {
    context.log.warning(
        fmt::format("the elevations of {} are {:.0f} mm above those of {}: check that both maps share a world frame",
                    arguments.b, 1e3 * agreement->median_m, arguments.a));
  }
  if (shared > 0) context.log.warning(fmt::format("{} local maps are in both maps and count once", shared));
  const Json json{{"schema", 1},
                  {"stops", both.stops().size()},
                  {"shared_stops", shared},
                  {"submaps", both.submaps().size()},
                  {"tiles", both.tiles()},
                  {"both_know_cells", agreement->cells},
                  {"apart_m", {{"median", agreement->median_m}, {"spread", agreement->spread_m}}}};
  const std::string text = fmt::format(
      "{} local maps, {} submaps, {} tiles in {}\n{} cells are known in both maps; the second is {:.1f} mm above the "
      "first "
      "there (median; robust standard deviation {:.1f} mm)\n",
      both.stops().size(), both.submaps().size(), both.tiles(), arguments.output, agreement->cells,
      1e3 * agreement->median_m, 1e3 * agreement->spread_m);
  if (Status s = print(context.json ? text_of(json) + "\n" : text); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_map_merge(CLI::App& map, Context& context) {
  auto a = std::make_shared<MergeArguments>();
  CLI::App* command =
      add_command(map, context, "merge", "Merge two global maps that share a world frame",
                  "map merge run_monday run_tuesday -o site.map", [&context, a] { return merge(context, *a); });
  command->add_option("a", a->a, "Saved map (.map) or run folder.")->required();
  command->add_option("b", a->b, "Second map, in the same world frame. The maps are not aligned by matching.")
      ->required();
  command->add_option("-o,--output", a->output, "Map file to write.")->required();
  add_force_flag(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
