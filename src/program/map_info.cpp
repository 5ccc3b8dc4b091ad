// spartan map info: properties of a saved global map.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "program/json.h"
#include "program/map.h"
#include "spartan/slam/global_map.h"
#include "spartan/system/map_files.h"

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

Json map_to_json(const GlobalMap& map, const MapStatistics& statistics) {
  Json stops = Json::array();
  for (const MapStop& stop : map.stops()) stops.push_back(stop_json(stop));
  const LatticeWindow extent = map.extent();
  const GeoTransform place = extent.place(map.cell_m());
  return {
      {"schema", 1},
      {"cell_m", map.cell_m()},
      {"west_m", place.west_m},
      {"north_m", place.north_m},
      {"columns", extent.width},
      {"rows", extent.height},
      {"submaps", map.submaps().size()},
      {"tiles", map.tiles()},
      {"cells", {{"free", statistics.cells[1]}, {"obstacle", statistics.cells[2]}, {"cavity", statistics.cells[3]}}},
      {"known_m2", static_cast<double>(statistics.known) * map.cell_m() * map.cell_m()},
      {"elevation_m", {{"least", statistics.min_elevation_m}, {"most", statistics.max_elevation_m}}},
      {"sigma_m", {{"median", std::sqrt(static_cast<double>(statistics.median_variance_m2))}}},
      {"stops", std::move(stops)}};
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string to_text(const Json& json) {
  const Json& cells = json["cells"];
  std::string text = fmt::format(
      "{} x {} cells of {} m in {} tiles of {}; upper left corner x {:.2f} m, y {:.2f} m\n"
      "{:.1f} m2 mapped: {} cells free, {} obstacle, {} cavity\n"
      "elevation {:.3f} m to {:.3f} m, median standard deviation of a cell {:.1f} mm\n"
      "{}, with stamp and pose of the body:\n",
      json["columns"].get<int>(), json["rows"].get<int>(), json["cell_m"].get<double>(),
      json["tiles"].get<std::size_t>(), counted(json["submaps"].get<std::size_t>(), "submap"),
      json["west_m"].get<double>(), json["north_m"].get<double>(), json["known_m2"].get<double>(),
      cells["free"].get<std::int64_t>(), cells["obstacle"].get<std::int64_t>(), cells["cavity"].get<std::int64_t>(),
      json["elevation_m"]["least"].get<double>(), json["elevation_m"]["most"].get<double>(),
      1e3 * json["sigma_m"]["median"].get<double>(), counted(json["stops"].size(), "local map"));
  for (const Json& stop : json["stops"]) {
    text += fmt::format("  {} ns at {:.3f}, {:.3f}, {:.3f} m, yaw {:.1f} deg, standard deviation {:.1f} mm\n",
                        stop["stamp_ns"].get<std::int64_t>(), stop["x_m"].get<double>(), stop["y_m"].get<double>(),
                        stop["z_m"].get<double>(), stop["yaw_deg"].get<double>(), 1e3 * stop["sigma_m"].get<double>());
  }
  return text;
}

Result<ExitCode> info(const Context& context, const std::string& path) {
  auto saved = SavedMap::open(path);
  if (!saved) return failure(saved);
  const auto statistics = map_statistics(saved->map());
  if (!statistics) return failure(statistics);
  const Json json = map_to_json(saved->map(), *statistics);
  if (Status s = print(context.json ? text_of(json) + "\n" : to_text(json)); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_map_info(CLI::App& map, Context& context) {
  auto path = std::make_shared<std::string>();
  CLI::App* command =
      add_command(map, context, "info", "Print extent, cell counts, elevations and local maps of a global map",
                  "map info my_run", [&context, path] { return info(context, *path); });
  command->add_option("map", *path, "Saved map (.map) or run folder.")->required();
  add_json_flag(*command, context);
}

}  // namespace spartan::program
