#include "spartan/storage/database.h"

#include <sqlite3.h>

#include <filesystem>
#include <utility>

namespace spartan {
namespace {

Error error_of(sqlite3* db, const std::string& path) {
  const int code = db == nullptr ? SQLITE_NOMEM : sqlite3_errcode(db);
  const std::string what = db == nullptr ? "out of memory" : sqlite3_errmsg(db);
  switch (code & 0xFF) {
    case SQLITE_FULL:
    case SQLITE_IOERR:
      return {ErrorCode::output, "cannot be written: " + what, path,
              "free disk space or raise the file size limit, then continue with --resume"};
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
      return {ErrorCode::output, "cannot be written: " + what, path, "choose a writable folder with -o"};
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {ErrorCode::output, "is in use by another process", path, "wait until the other process has finished"};
    case SQLITE_NOTADB:
      return {ErrorCode::store_damaged, "is damaged or not a database: " + what, path,
              "give a saved map (.map) or a run folder; a damaged one must be made again"};
    case SQLITE_CORRUPT:
      return {ErrorCode::store_damaged, "is damaged: " + what, path, "run again into a new folder"};
    default:
      return {ErrorCode::internal, what, path, ""};
  }
}

// Percent-encodes the characters that have a meaning in a URI.
std::string percent_encoded(const std::string& path) {
  std::string text;
  for (const char c : path) text += c == '%' ? "%25" : c == '?' ? "%3f" : c == '#' ? "%23" : std::string(1, c);
  return text;
}

}  // namespace

SqlStatement::SqlStatement(sqlite3* db, sqlite3_stmt* statement, std::string path)
    : db_(db), statement_(statement), path_(std::move(path)) {}
SqlStatement::SqlStatement(SqlStatement&& other) noexcept
    : db_(other.db_), statement_(std::exchange(other.statement_, nullptr)), path_(std::move(other.path_)) {}
SqlStatement& SqlStatement::operator=(SqlStatement&& other) noexcept {
  std::swap(db_, other.db_);
  std::swap(statement_, other.statement_);
  std::swap(path_, other.path_);
  return *this;
}
SqlStatement::~SqlStatement() {
  sqlite3_finalize(statement_);
}

SqlStatement& SqlStatement::bind(int index, std::int64_t value) {
  sqlite3_bind_int64(statement_, index, value);
  return *this;
}
SqlStatement& SqlStatement::bind(int index, double value) {
  sqlite3_bind_double(statement_, index, value);
  return *this;
}
SqlStatement& SqlStatement::bind(int index, const std::string& text) {
  sqlite3_bind_text64(statement_, index, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  return *this;
}
SqlStatement& SqlStatement::bind(int index, const Bytes& blob) {
  sqlite3_bind_blob64(statement_, index, blob.data(), blob.size(), SQLITE_TRANSIENT);
  return *this;
}

SqlStatement& SqlStatement::bind(int index, const std::optional<double>& value) {
  if (value) return bind(index, *value);
  sqlite3_bind_null(statement_, index);
  return *this;
}

Result<bool> SqlStatement::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return tl::unexpected<Error>(error_of(db_, path_));
}

Status SqlStatement::run() {
  for (;;) {
    const Result<bool> row = step();
    if (!row) {
      reset();
      return failure(row);
    }
    if (!*row) break;
  }
  reset();
  return {};
}

void SqlStatement::reset() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

std::int64_t SqlStatement::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}
double SqlStatement::real(int column) const {
  return sqlite3_column_double(statement_, column);
}
std::string SqlStatement::text(int column) const {
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return data == nullptr ? std::string{}
                         : std::string(data, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
}
bool SqlStatement::is_null(int column) const {
  return sqlite3_column_type(statement_, column) == SQLITE_NULL;
}
Bytes SqlStatement::blob(int column) const {
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_, column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
  return data == nullptr ? Bytes{} : Bytes(data, data + size);
}

Result<Database> Database::open(const std::string& path, Mode mode) {
  int flags = SQLITE_OPEN_READWRITE;
  if (mode == Mode::create) flags |= SQLITE_OPEN_CREATE;
  std::string name = path;
  if (mode == Mode::read_only) {
    flags = SQLITE_OPEN_READONLY;
    // Without a write-ahead log no process is writing. With `immutable` SQLite creates no -wal and -shm files beside
    // the database and so needs no write permission for the folder.
    if (!std::filesystem::exists(path + "-wal")) {
      flags |= SQLITE_OPEN_URI;
      name = "file:" + percent_encoded(path) + "?immutable=1";
    }
  }
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(name.c_str(), &handle, flags, nullptr);
  Database db(handle, path);
  if (code != SQLITE_OK) return tl::unexpected<Error>(error_of(handle, path));
  sqlite3_busy_timeout(handle, 5000);  // ms; waits for short locks of other processes
  // NORMAL: with a write-ahead log, committed data survive when the process is killed.
  if (mode != Mode::read_only) {
    if (Status status = db.execute("PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;"); !status) {
      return failure(status);
    }
  }
  return db;
}

Database::Database(Database&& other) noexcept : db_(std::exchange(other.db_, nullptr)), path_(std::move(other.path_)) {}
Database& Database::operator=(Database&& other) noexcept {
  std::swap(db_, other.db_);
  std::swap(path_, other.path_);
  return *this;
}
Database::~Database() {
  sqlite3_close_v2(db_);
}

Status Database::execute(const std::string& sql) {
  if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return tl::unexpected<Error>(error_of(db_, path_));
}

Result<SqlStatement> Database::prepare(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(db_, sql.c_str(), static_cast<int>(sql.size()), &statement, nullptr) != SQLITE_OK) {
    return tl::unexpected<Error>(error_of(db_, path_));
  }
  return SqlStatement(db_, statement, path_);
}

}  // namespace spartan
