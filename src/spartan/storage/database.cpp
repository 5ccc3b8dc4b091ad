#include "spartan/storage/database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cerrno>
#include <filesystem>
#include <new>
#include <utility>

#include "spartan/core/files.h"

namespace spartan {
namespace {

Error error_of(sqlite3* db, const std::string& path) {
  const int code = db == nullptr ? SQLITE_NOMEM : sqlite3_extended_errcode(db);
  const std::string what = db == nullptr ? "out of memory" : sqlite3_errmsg(db);
  const bool only_read = db != nullptr && sqlite3_db_readonly(db, "main") == 1;
  // CORRUPTFS: what SQLite makes of EIO, ENXIO and ERANGE while it reads.
  if (code == SQLITE_IOERR_READ || code == SQLITE_IOERR_CORRUPTFS || code == SQLITE_IOERR_FSTAT ||
      (only_read && (code & 0xFF) == SQLITE_IOERR))
    return {ErrorCode::read_error, "cannot be read: " + what, path, "try again, or check the disk"};
  const int system_error = db == nullptr ? ENOMEM : sqlite3_system_errno(db);
  if ((code & 0xFF) == SQLITE_NOMEM || code == SQLITE_IOERR_NOMEM ||
      ((code & 0xFF) == SQLITE_CANTOPEN && (system_error == EMFILE || system_error == ENFILE))) {
    return {ErrorCode::resources, what, path, "free memory or raise the limits (ulimit -v, ulimit -n)"};
  }
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
              "give a saved map (.map) or a run folder, not a GeoTIFF; a damaged one must be made again"};
    case SQLITE_INTERRUPT:
      return {ErrorCode::store_damaged, "is damaged: a query does not end", path, "run again into a new folder"};
    case SQLITE_ERROR:
    case SQLITE_SCHEMA:
    case SQLITE_CONSTRAINT:
    case SQLITE_MISMATCH:
    case SQLITE_TOOBIG:
    case SQLITE_AUTH:
    case SQLITE_CORRUPT:
      return {ErrorCode::store_damaged, "is damaged: " + what, path, "run again into a new folder"};
    default:
      return {ErrorCode::internal, what, path, ""};
  }
}

// Ends queries that need too many steps of SQLite's virtual machine before their next row. A table of 10^7 rows needs
// some 10^8 steps to be sorted. No clock: the same file gives the same result on every machine.
class StepLimit {
 public:
  explicit StepLimit(sqlite3* db) : db_(db) {
    sqlite3_progress_handler(db_, kStepsPerCall, &StepLimit::count, &calls_);
  }
  StepLimit(const StepLimit&) = delete;
  StepLimit& operator=(const StepLimit&) = delete;
  ~StepLimit() { sqlite3_progress_handler(db_, 0, nullptr, nullptr); }

 private:
  static constexpr int kStepsPerCall = 10'000'000, kMostCalls = 100;
  static int count(void* calls) { return ++*static_cast<int*>(calls) > kMostCalls ? 1 : 0; }
  sqlite3* db_;
  int calls_ = 0;
};

void distrust_schema(sqlite3* db) {
  for (const auto& [option, value] : {std::pair{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                      {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                      {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                      {SQLITE_DBCONFIG_ENABLE_VIEW, 0}}) {
    sqlite3_db_config(db, option, value, nullptr);
  }
  sqlite3_limit(db, SQLITE_LIMIT_LENGTH, 1 << 28);
}

// One line a column: name, type, key, hidden or generated.
Result<std::string> columns_of(Database& db, const std::string& table) {
  auto select = db.prepare("SELECT name, type, pk, hidden FROM pragma_table_xinfo(?)");
  if (!select) return failure(select);
  select->bind(1, table);
  std::string columns;
  for (;;) {
    const auto row = select->step();
    if (!row) return failure(row);
    if (!*row) return columns;
    columns += fmt::format("{} {} {} {}\n", select->text(0), select->text(1), select->integer(2), select->integer(3));
  }
}

// "table", "view", "virtual" or "shadow"; empty if there is no such table.
Result<std::string> type_of(Database& db, const std::string& table) {
  auto select = db.prepare("SELECT type FROM pragma_table_list WHERE schema = 'main' AND name = ?");
  if (!select) return failure(select);
  const auto row = select->bind(1, table).step();
  if (!row) return failure(row);
  return *row ? select->text(0) : std::string();
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
    : db_(other.db_),
      statement_(std::exchange(other.statement_, nullptr)),
      path_(std::move(other.path_)),
      bind_error_(other.bind_error_) {}
SqlStatement& SqlStatement::operator=(SqlStatement&& other) noexcept {
  std::swap(db_, other.db_);
  std::swap(statement_, other.statement_);
  std::swap(path_, other.path_);
  std::swap(bind_error_, other.bind_error_);
  return *this;
}
SqlStatement::~SqlStatement() {
  sqlite3_finalize(statement_);
}

// The first error of a bind is reported by step(): otherwise NULL would be stored in place of the value.
void SqlStatement::keep(int code) {
  if (bind_error_ == SQLITE_OK) bind_error_ = code;
}

SqlStatement& SqlStatement::bind(int index, std::int64_t value) {
  keep(sqlite3_bind_int64(statement_, index, value));
  return *this;
}
SqlStatement& SqlStatement::bind(int index, double value) {
  keep(sqlite3_bind_double(statement_, index, value));
  return *this;
}
SqlStatement& SqlStatement::bind(int index, const std::string& text) {
  keep(sqlite3_bind_text64(statement_, index, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}
SqlStatement& SqlStatement::bind(int index, const Bytes& blob) {
  keep(sqlite3_bind_blob64(statement_, index, blob.data(), blob.size(), SQLITE_TRANSIENT));
  return *this;
}

SqlStatement& SqlStatement::bind(int index, const std::optional<double>& value) {
  if (value) return bind(index, *value);
  keep(sqlite3_bind_null(statement_, index));
  return *this;
}

Result<bool> SqlStatement::step() {
  if (bind_error_ == SQLITE_NOMEM) throw std::bad_alloc();
  if (bind_error_ != SQLITE_OK) return failure(ErrorCode::internal, sqlite3_errstr(bind_error_), path_);
  const StepLimit limit(db_);
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
  bind_error_ = SQLITE_OK;
}

std::int64_t SqlStatement::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}
double SqlStatement::real(int column) const {
  return sqlite3_column_double(statement_, column);
}
// A null pointer stands for NULL, for an empty value, and for a failed allocation.
void SqlStatement::expect_memory(const void* data) const {
  if (data == nullptr && sqlite3_errcode(db_) == SQLITE_NOMEM) throw std::bad_alloc();
}
std::string SqlStatement::text(int column) const {
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  expect_memory(data);
  return data == nullptr ? std::string{}
                         : std::string(data, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
}
bool SqlStatement::is_null(int column) const {
  return sqlite3_column_type(statement_, column) == SQLITE_NULL;
}
Bytes SqlStatement::blob(int column) const {
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_, column));
  expect_memory(data);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
  return data == nullptr ? Bytes{} : Bytes(data, data + size);
}

Result<Database> Database::open(const std::string& path, Mode mode, int page_bytes) {
  int flags = SQLITE_OPEN_READWRITE;
  if (mode == Mode::create) flags |= SQLITE_OPEN_CREATE;
  // A name that begins with "file:" would be read as a URI where SQLite was compiled so.
  std::string name = path.starts_with("file:") ? "./" + path : path;
  if (mode != Mode::create) {
    if (const auto file = InputFile::open(path); !file) return failure(file);
  }
  if (mode == Mode::read_only) {
    std::error_code error;
    flags = SQLITE_OPEN_READONLY;
    // Without a write-ahead log no process is writing. With `immutable` SQLite creates no -wal and -shm files beside
    // the database and so needs no write permission for the folder.
    if (!std::filesystem::exists(path + "-wal", error)) {
      flags |= SQLITE_OPEN_URI;
      // "//": what follows is the whole path, even if it begins with two slashes.
      name = (path.starts_with('/') ? "file://" : "file:") + percent_encoded(path) + "?immutable=1";
    }
  }
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(name.c_str(), &handle, flags, nullptr);
  Database db(handle, path);
  if (code != SQLITE_OK) return tl::unexpected<Error>(error_of(handle, path));
  distrust_schema(handle);
  sqlite3_busy_timeout(handle, 5000);  // ms; waits for short locks of other processes
  // NORMAL: with a write-ahead log, committed data survive when the process is killed.
  if (mode != Mode::read_only) {
    const std::string page_size = mode == Mode::create ? fmt::format("PRAGMA page_size={};", page_bytes) : "";
    if (Status status = db.execute(page_size + "PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;"); !status) {
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
  const StepLimit limit(db_);
  if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return tl::unexpected<Error>(error_of(db_, path_));
}

Status Database::expect_tables(const std::string& schema) {
  auto expected = open(":memory:", Mode::create);
  if (!expected) return failure(expected);
  if (Status s = expected->execute(schema); !s) return s;
  return for_each_row(*expected, "SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name",
                      [&](const SqlStatement& row) -> Status {
                        const std::string table = row.text(0);
                        const auto damaged = [&](const std::string& how) {
                          return failure(ErrorCode::store_damaged, "is damaged: table '" + table + "' " + how, path_,
                                         "run again into a new folder");
                        };
                        const auto type = type_of(*this, table);
                        if (!type) return failure(type);
                        if (type->empty()) return damaged("is missing");
                        if (*type != "table") return damaged("is not a table but of type '" + *type + "'");
                        const auto wanted = columns_of(*expected, table), found = columns_of(*this, table);
                        if (!wanted) return failure(wanted);
                        if (!found) return failure(found);
                        if (*wanted != *found) return damaged("has other columns than expected");
                        return {};
                      });
}

bool Database::was_moved() const {
  int moved = 0;
  return sqlite3_file_control(db_, nullptr, SQLITE_FCNTL_HAS_MOVED, &moved) == SQLITE_OK && moved != 0;
}

Result<SqlStatement> Database::prepare(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(db_, sql.c_str(), static_cast<int>(sql.size()), &statement, nullptr) != SQLITE_OK) {
    return tl::unexpected<Error>(error_of(db_, path_));
  }
  return SqlStatement(db_, statement, path_);
}

}  // namespace spartan
