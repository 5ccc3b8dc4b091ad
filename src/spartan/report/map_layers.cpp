
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "spartan/report/report.h"

namespace spartan {
namespace {

class Layers {
 public:
  Layers(const MapView& view, int step) : view_(view), step_(step) {}
  int width() const { return (view_.window.width + step_ - 1) / step_; }
  int height() const { return (view_.window.height + step_ - 1) / step_; }

  // `value` of (column, row) has the type of the layer.
  template <class Value>
  void add(const char* name, const char* type, const Value& value) {
    while (bytes_.size() % 4 != 0) bytes_ += '\0';
    list_.push_back({{"name", name}, {"type", type}, {"offset", bytes_.size()}});
    for (int r = 0; r < view_.window.height; r += step_) {
      for (int c = 0; c < view_.window.width; c += step_) {
        const auto element = value(c, r);
        bytes_.append(reinterpret_cast<const char*>(&element), sizeof(element));
      }
    }
  }

  std::string file() const {
    const GeoTransform place = view_.place();
    const double cell_m = place.cell_m * step_;
    std::string header = nlohmann::json{
        {"width", width()},
        {"height", height()},
        {"cell_m", cell_m},
        {"west_m", place.west_m + (place.cell_m - cell_m) / 2},  // the kept cells are the centres of larger ones
        {"north_m", place.north_m - (place.cell_m - cell_m) / 2},
        {"layers", list_}}.dump();
    header.resize((header.size() + 3) / 4 * 4, ' ');
    const auto length = static_cast<std::uint32_t>(header.size());
    return std::string(reinterpret_cast<const char*>(&length), sizeof(length)) + header + bytes_;
  }

 private:
  const MapView& view_;
  int step_;
  nlohmann::json list_ = nlohmann::json::array();
  std::string bytes_;
};

}  // namespace

Result<std::string> map_layers(SavedMap& saved, std::int64_t most_cells) {
  GlobalMap& map = saved.map();
  const int step = map.overview_step(most_cells);
  const bool all = map.extent().cells() <= GlobalMap::kMostCells;
  const auto view = all ? map.view(map.extent()) : map.overview(step);
  if (!view) return failure(view);
  const auto colours = saved.cell_colours(*view);
  if (!colours) return failure(colours);
  const Traversability shape = view->shape(saved.options().mapping.map, ThreadPool(1));
  Layers layers(*view, all ? step : 1);
  layers.add("elevation_m", "float32", [&](int c, int r) { return view->elevation_m(c, r); });
  layers.add("sigma_m", "float32", [&](int c, int r) { return std::sqrt(view->variance_m2(c, r)); });
  layers.add("cost", "float32", [&](int c, int r) { return shape.cost(c, r); });
  layers.add("class", "uint8", [&](int c, int r) { return static_cast<std::uint8_t>(view->kind(c, r)); });
  layers.add("colour", "rgb8", [&](int c, int r) { return (*colours)(c, r); });
  return layers.file();
}

}  // namespace spartan
