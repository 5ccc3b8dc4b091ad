#include "run_results.h"

#include <sqlite3.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "spartan/core/files.h"

namespace spartan::testing {
namespace {

namespace fs = std::filesystem;

bool is_time_column(const std::string& name) {
  return name == "wall_ms" || name == "cpu_ms";
}

std::string dump_table(sqlite3* db, const std::string& table) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(db, ("SELECT * FROM " + table).c_str(), -1, &statement, nullptr) != SQLITE_OK) {
    throw std::runtime_error(sqlite3_errmsg(db));
  }
  std::string text;
  while (sqlite3_step(statement) == SQLITE_ROW) {
    for (int column = 0; column < sqlite3_column_count(statement); ++column) {
      if (is_time_column(sqlite3_column_name(statement, column))) continue;
      const auto* data = static_cast<const char*>(sqlite3_column_blob(statement, column));
      const int size = sqlite3_column_bytes(statement, column);
      text += std::to_string(size) + ":";
      if (data != nullptr) text.append(data, static_cast<std::size_t>(size));
      text += "|";
    }
    text += "\n";
  }
  sqlite3_finalize(statement);
  return text;
}

std::vector<std::string> tables_of(sqlite3* db) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(db, "SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name", -1, &statement,
                         nullptr) != SQLITE_OK) {
    throw std::runtime_error(sqlite3_errmsg(db));
  }
  std::vector<std::string> names;
  while (sqlite3_step(statement) == SQLITE_ROW)
    names.emplace_back(reinterpret_cast<const char*>(sqlite3_column_text(statement, 0)));
  sqlite3_finalize(statement);
  return names;
}

std::string dump_database(const std::string& path) {
  sqlite3* db = nullptr;
  if (sqlite3_open_v2(path.c_str(), &db, SQLITE_OPEN_READONLY, nullptr) != SQLITE_OK)
    throw std::runtime_error("cannot open " + path);
  std::string text;
  for (const std::string& table : tables_of(db)) text += "== " + table + "\n" + dump_table(db, table);
  sqlite3_close(db);
  return text;
}

bool is_byte_stable(const fs::path& relative) {
  const std::string first = relative.begin()->string();
  return relative.extension() == ".tum" || first == "terrain" || first == "maps" || first == "config.yaml" ||
         first == "rig.yaml";
}

}  // namespace

std::map<std::string, std::string> byte_stable_content(const std::string& run_folder) {
  std::map<std::string, std::string> content;
  for (const auto& entry : fs::recursive_directory_iterator(run_folder)) {
    if (!entry.is_regular_file()) continue;
    const fs::path relative = fs::relative(entry.path(), run_folder);
    if (relative == "run.sqlite") content["run.sqlite"] = dump_database(entry.path().string());
    if (is_byte_stable(relative)) content[relative.string()] = read_file(entry.path().string()).value();
  }
  return content;
}

}  // namespace spartan::testing
