// RAII wrapper of SQLite with errors as Result.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "spartan/core/archive.h"
#include "spartan/core/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace spartan {

/// A prepared statement. Bind parameters with `bind(1, …)` (the first index is 1), call step(), read columns (the first
/// index is 0); reset() before it is used again.
class SqlStatement {
 public:
  SqlStatement(sqlite3* db, sqlite3_stmt* statement, std::string path);
  SqlStatement(SqlStatement&&) noexcept;
  SqlStatement& operator=(SqlStatement&&) noexcept;
  ~SqlStatement();

  SqlStatement& bind(int index, std::int64_t value);
  SqlStatement& bind(int index, double value);
  SqlStatement& bind(int index, const std::string& text);
  SqlStatement& bind(int index, const Bytes& blob);
  SqlStatement& bind(int index, const std::optional<double>& value);  ///< NULL for nullopt

  /// Advances to the next row: true if there is one. Codes: `output` if the disk is full or the file cannot be
  /// written, `store_damaged`.
  Result<bool> step();
  /// Runs the statement to its end and resets it.
  Status run();
  void reset();

  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  Bytes blob(int column) const;
  bool is_null(int column) const;

 private:
  sqlite3* db_ = nullptr;
  sqlite3_stmt* statement_ = nullptr;
  std::string path_;
};

/// A connection to an SQLite database file.
class Database {
 public:
  enum class Mode { create, open, read_only };
  /// Opens the database, with a write-ahead log unless it is read-only. Codes: `output` (cannot be created or written),
  /// `store_damaged` (missing, damaged or not a database).
  static Result<Database> open(const std::string& path, Mode mode);
  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  Status execute(const std::string& sql);
  Result<SqlStatement> prepare(const std::string& sql);
  const std::string& path() const { return path_; }

 private:
  Database(sqlite3* db, std::string path) : db_(db), path_(std::move(path)) {}
  sqlite3* db_ = nullptr;
  std::string path_;
};

}  // namespace spartan
