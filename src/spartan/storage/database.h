// RAII wrapper of SQLite with errors as Result.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

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
  void keep(int code);
  void expect_memory(const void* data) const;
  sqlite3* db_ = nullptr;
  sqlite3_stmt* statement_ = nullptr;
  std::string path_;
  int bind_error_ = 0;
};

/// A connection to an SQLite database file.
class Database {
 public:
  enum class Mode { create, open, read_only };
  /// Opens the database, with a write-ahead log unless it is read-only. Files may come from strangers: views, triggers
  /// and functions with side effects are disabled, and a query that needs more than about 10^9 steps for a row ends.
  /// Codes: `input` and `read_error` (an existing file is expected, see read_file()), `output` (cannot be created or
  /// written), `store_damaged` (damaged or not a database), `resources`. `page_bytes`: of a database that is created; a
  /// transaction writes whole pages, so small ones suit many small transactions.
  static Result<Database> open(const std::string& path, Mode mode, int page_bytes = 4096);
  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  Status execute(const std::string& sql);
  Result<SqlStatement> prepare(const std::string& sql);
  const std::string& path() const { return path_; }
  /// Compares the tables that the statements of `schema` create (CREATE TABLE) with those of this database: names of
  /// tables, and names, types and keys of their columns in their order. Code `store_damaged`, with the name of the
  /// table that is missing, differs, or is a view or a virtual table.
  Status expect_tables(const std::string& schema);

  /// Whether the file was removed or renamed, or replaced by another one, since it was opened.
  bool was_moved() const;

 private:
  Database(sqlite3* db, std::string path) : db_(db), path_(std::move(path)) {}
  sqlite3* db_ = nullptr;
  std::string path_;
};

/// Calls `read(row)` for each row of a query until it returns an error. Codes as SqlStatement::step(), and those of
/// `read`.
template <class Read>
Status for_each_row(Database& db, const std::string& sql, const Read& read) {
  auto select = db.prepare(sql);
  if (!select) return failure(select);
  for (;;) {
    const auto row = select->step();
    if (!row) return failure(row);
    if (!*row) return {};
    if (Status s = read(std::as_const(*select)); !s) return s;
  }
}

}  // namespace spartan
