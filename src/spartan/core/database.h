// A thin, owning layer over SQLite: errors as Result, statements that clean up after themselves.
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

/// One prepared statement. Bind with `bind(1, …)`, step, read columns; `reset()` to use it again.
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
  SqlStatement& bind(int index, const std::optional<double>& value);  ///< NULL where there is none

  /// True while there is a row. Codes: `output` where the disk is full or the file cannot be written, `store_damaged`.
  Result<bool> step();
  /// Steps to the end and resets.
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

class Database {
 public:
  enum class Mode { create, open, read_only };
  /// Opens with a write-ahead log. Codes: `output` (cannot be made or written), `store_damaged` (damaged or not a
  /// database).
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
