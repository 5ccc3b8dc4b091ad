// Map files. An input is a list of edits, which are applied to the tables of a small valid map: most mutations of the
// bytes of a database would be refused by SQLite, before a parser of this project reads them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "spartan/slam/global_map.h"
#include "spartan/testing/temporary_folder.h"

namespace {

using namespace spartan;

constexpr std::size_t kMostEdits = 16;
constexpr double kCell_m = 0.25;

// An edit as it stands in the input.
struct Edit {
  std::uint8_t action, table, row, column;
  std::uint32_t at;
  std::array<std::uint8_t, 8> value;
};
static_assert(sizeof(Edit) == 16);

struct Table {
  const char* name;
  std::vector<const char*> columns;
  int keys;  // the first columns
};
const std::array<Table, 4>& tables() {
  static const std::array<Table, 4> list{{
      {"map_tiles", {"submap", "ix", "iy", "revision", "checksum", "cells"}, 4},
      {"map_submaps", {"id", "anchor"}, 1},
      {"map_stops", {"id", "stamp_ns", "pose", "covariance"}, 1},
      {"map_properties", {"key", "value"}, 1},
  }};
  return list;
}

MapOptions map_options(double cell_m) {
  MapOptions options;
  options.cell_m = cell_m;
  options.extent_m = 5;
  return options;
}

// A plane of 20 by 20 cells around the body.
LocalMap plane_around(const Pose& world_from_body) {
  const auto generator = MapGenerator::create(map_options(kCell_m), ThreadPool(1));
  std::vector<SurfacePoint> points;
  for (float x = -2.4F; x < 2.5F; x += 0.1F) {
    for (float y = -2.4F; y < 2.5F; y += 0.1F) {
      points.push_back({{x, y, 0.1F * x}, 0.01F, {0, 0, -1}, GroundClass::ground});
    }
  }
  return generator.value().generate(points, world_from_body);
}

// Writes a map of two submaps, one of them with an anchor off the lattice.
std::string valid_map() {
  const testing::TemporaryFolder folder;
  GlobalMap map = GlobalMap::create({}, kCell_m).value();
  const Pose second = Pose::from_translation({60, 0, 0});
  for (const Pose& pose : {Pose(), second}) {
    if (!map.add(plane_around(pose), {1}, {pose, Matrix6d::Identity()}, Matrix6d::Zero())) __builtin_trap();
  }
  map.move_submap(map.submaps().back().id, Pose(exp_so3({0, 0, 0.1}), {0.01, 0.02, 0}));
  if (!MapFile::save(map, folder.path() + "/map")) __builtin_trap();
  return testing::content_of(folder.path() + "/map");
}

SqlStatement& bind_value(SqlStatement& statement, const Edit& edit) {
  std::int64_t integer = 0;
  double real = 0;
  std::memcpy(&integer, edit.value.data(), sizeof integer);
  std::memcpy(&real, edit.value.data(), sizeof real);
  switch (edit.at % 5) {
    case 0:
      return statement.bind(1, integer);
    case 1:
      return statement.bind(1, real);
    case 2:
      return statement.bind(1, std::string(edit.value.begin(), edit.value.end()));
    case 3:
      return statement.bind(1, Bytes(edit.value.begin(), edit.value.end()));
    default:
      return statement.bind(1, std::optional<double>());
  }
}

// Whether the edit could be applied does not matter: the tables have constraints.
void change_value(Database& db, const Edit& edit) {
  const Table& table = tables()[edit.table % tables().size()];
  std::string keys = table.columns[0];
  for (int i = 1; i < table.keys; ++i) keys += std::string(", ") + table.columns[static_cast<std::size_t>(i)];
  const std::string row = " WHERE (" + keys + ") IN (SELECT " + keys + " FROM " + table.name + " LIMIT 1 OFFSET " +
                          std::to_string(edit.row % 4) + ")";
  const std::string column = table.columns[edit.column % table.columns.size()];
  const bool removes = edit.action % 4 == 1;
  auto statement =
      db.prepare(removes ? "DELETE FROM " + std::string(table.name) + row
                         : "UPDATE OR IGNORE " + std::string(table.name) + " SET " + column + " = ?" + row);
  if (!statement) __builtin_trap();
  if (!removes) bind_value(*statement, edit);
  static_cast<void>(statement->run());
}

// Changes four bytes of a cell. The checksum of its tile is right, as a stranger could compute it.
void change_cell(Database& db, const Edit& edit) {
  auto store = TileStore::open_existing(db);
  if (!store) return;
  const auto index = store->index();
  if (!index || index->empty()) return;
  const TileStore::Entry& entry = (*index)[edit.row % index->size()];
  auto tile = store->read(entry);
  if (!tile) return;
  const std::size_t cell = edit.at % tile->cells.size();
  static_assert(std::is_trivially_copyable_v<MapCell>);
  std::uint8_t* const bytes = reinterpret_cast<std::uint8_t*>(&tile->cells[cell]);
  std::memcpy(bytes + edit.column % (sizeof(MapCell) / 4) * 4, edit.value.data(), 4);
  static_cast<void>(store->write({entry.key, entry.revision}, *tile));
}

void apply(Database& db, const std::uint8_t* data, std::size_t size) {
  for (std::size_t i = 0; i < std::min(size / sizeof(Edit), kMostEdits); ++i) {
    Edit edit{};
    std::memcpy(&edit, data + i * sizeof edit, sizeof edit);
    edit.action % 4 == 3 ? change_cell(db, edit) : change_value(db, edit);
  }
}

// Everything that the program reads of a map.
void use(GlobalMap& map) {
  static_cast<void>(map_statistics(map, 128));
  static_cast<void>(map.at(0.3, -0.4));
  LatticeWindow window = map.extent();
  window.width = std::min(window.width, 64);
  window.height = std::min(window.height, 64);
  static_cast<void>(map.view(window));
  // The terrain shape of a part only: it takes longer than all the rest.
  window.width = std::min(window.width, 12);
  window.height = std::min(window.height, 12);
  const auto part = map.view(window);
  if (part && window.cells() > 0) static_cast<void>(part->shape(map_options(map.cell_m()), ThreadPool(1)));
  for (const LatticeWindow& piece : map.pieces(128)) {
    if (piece.width <= 0 || piece.width > 128 || piece.height <= 0 || piece.height > 128) __builtin_trap();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const testing::TemporaryFolder folder;
  static const std::string valid = valid_map();
  static_cast<void>(tile_from_bytes(Bytes(data, data + size), "tile"));
  const std::string path = folder.write("edited.map", valid);
  {
    auto db = Database::open(path, Database::Mode::open);
    if (!db || !db->execute("PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF")) __builtin_trap();
    apply(*db, data, size);
  }
  auto file = MapFile::open(path, {}, Database::Mode::read_only);
  if (!file) return 0;
  use(file->map());
  if (file->map().add(plane_around(Pose()), {1}, {}, Matrix6d::Zero())) use(file->map());
  auto own = GlobalMap::create({}, file->map().cell_m());
  if (own && own->merge(file->map())) use(*own);
  return 0;
}
