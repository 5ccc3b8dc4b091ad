// spartan map info: what is in a global map on the disk.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "program/json.h"
#include "program/map.h"
#include "spartan/system/saved_map.h"

namespace spartan::program {
namespace {

Json stop_json(const MapStop& stop) {
  const Pose& pose = stop.world_from_body.pose;
  const Eigen::Vector3d ahead = pose.rotation() * Eigen::Vector3d::UnitX();
  const double variance = stop.world_from_body.covariance.topLeftCorner<3, 3>().trace();
  return {{"stamp_ns", stop.stamp.ns},
          {"x_m", pose.translation().x()},
          {"y_m", pose.translation().y()},
          {"z_m", pose.translation().z()},
          {"yaw_deg", std::atan2(ahead.y(), ahead.x()) * 180 / std::numbers::pi},
          {"sigma_m", std::sqrt(std::max(0.0, variance))}};
}

Json to_json(const GlobalMap& map, const MapView& view) {
  std::array<int, 4> cells{};  // by class
  float least = 0, most = 0;
  std::vector<float> variances;
  for (int r = 0; r < view.window.height; ++r) {
    for (int c = 0; c < view.window.width; ++c) {
      ++cells[static_cast<std::size_t>(view.kind(c, r))];
      if (!(view.count(c, r) > 0)) continue;
      least = variances.empty() ? view.elevation_m(c, r) : std::min(least, view.elevation_m(c, r));
      most = variances.empty() ? view.elevation_m(c, r) : std::max(most, view.elevation_m(c, r));
      variances.push_back(view.variance_m2(c, r));
    }
  }
  const auto middle = variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  Json stops = Json::array();
  for (const MapStop& stop : map.stops()) stops.push_back(stop_json(stop));
  const MapPlace place = view.place();
  return {{"schema", 1},
          {"cell_m", view.cell_m},
          {"west_m", place.west_m},
          {"north_m", place.north_m},
          {"columns", view.window.width},
          {"rows", view.window.height},
          {"submaps", map.submaps().size()},
          {"tiles", map.tiles()},
          {"cells", {{"free", cells[1]}, {"obstacle", cells[2]}, {"cavity", cells[3]}}},
          {"known_m2", static_cast<double>(variances.size()) * view.cell_m * view.cell_m},
          {"elevation_m", {{"least", least}, {"most", most}}},
          {"sigma_m", {{"median", variances.empty() ? 0.0 : std::sqrt(static_cast<double>(*middle))}}},
          {"stops", std::move(stops)}};
}

std::string to_text(const Json& json) {
  const Json& cells = json["cells"];
  std::string text = fmt::format(
      "{} x {} cells of {} m in {} tiles of {} submaps; north-west corner at {:.2f}, {:.2f} m\n"
      "{:.1f} m2 known: {} cells free, {} obstacle, {} cavity\n"
      "elevation {:.3f} m to {:.3f} m, standard deviation {:.1f} mm (median)\n"
      "made at {} stops:\n",
      json["columns"].get<int>(), json["rows"].get<int>(), json["cell_m"].get<double>(),
      json["tiles"].get<std::size_t>(), json["submaps"].get<std::size_t>(), json["west_m"].get<double>(),
      json["north_m"].get<double>(), json["known_m2"].get<double>(), cells["free"].get<int>(),
      cells["obstacle"].get<int>(), cells["cavity"].get<int>(), json["elevation_m"]["least"].get<double>(),
      json["elevation_m"]["most"].get<double>(), 1e3 * json["sigma_m"]["median"].get<double>(), json["stops"].size());
  for (const Json& stop : json["stops"]) {
    text += fmt::format("  {} ns at {:.3f}, {:.3f}, {:.3f} m, heading {:.1f} deg, known to {:.1f} mm\n",
                        stop["stamp_ns"].get<std::int64_t>(), stop["x_m"].get<double>(), stop["y_m"].get<double>(),
                        stop["z_m"].get<double>(), stop["yaw_deg"].get<double>(), 1e3 * stop["sigma_m"].get<double>());
  }
  return text;
}

Result<ExitCode> info(const Context& context, const std::string& path) {
  auto saved = SavedMap::open(path);
  if (!saved) return failure(saved);
  const auto view = saved->map().view(saved->map().extent());
  if (!view) return failure(view);
  const Json json = to_json(saved->map(), *view);
  if (Status s = print(context.json ? json.dump(2) + "\n" : to_text(json)); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_map_info(CLI::App& map, Context& context) {
  auto path = std::make_shared<std::string>();
  CLI::App* verb = add_verb(map, context, "info", "What a global map holds", "map info my_run",
                            [&context, path] { return info(context, *path); });
  verb->add_option("map", *path, "a map file, or a run folder")->required();
  add_json_flag(*verb, context);
}

}  // namespace spartan::program
