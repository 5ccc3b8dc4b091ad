// Databases from strangers: nothing in a file may crash, hang or deceive the program.
#include "spartan/storage/database.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <filesystem>

#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

constexpr const char* kTableSchema = "CREATE TABLE t (id INTEGER PRIMARY KEY, x REAL NOT NULL);";

class ForeignDatabase : public ::testing::Test {
 protected:
  // Writes a file without the restrictions of Database.
  void write(const std::string& sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
    char* error = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &error), SQLITE_OK) << error;
    sqlite3_close(db);
  }
  Database open(Database::Mode mode = Database::Mode::read_only) {
    auto db = Database::open(path_, mode);
    EXPECT_TRUE(db) << db.error().message();
    return std::move(*db);
  }
  std::string schema_error() {
    Database db = open();
    const Status status = db.expect_tables(kTableSchema);
    if (status) return "none";
    EXPECT_EQ(status.error().code, ErrorCode::store_damaged);
    EXPECT_EQ(status.error().where, path_);
    return status.error().what;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/foreign.sqlite";
};

TEST_F(ForeignDatabase, TheExpectedTablesAreAccepted) {
  write(std::string(kTableSchema) + "CREATE TABLE other (y); CREATE INDEX i ON t (x);");
  EXPECT_EQ(schema_error(), "none") << "more tables than expected are no fault";
}

TEST_F(ForeignDatabase, ATableThatIsMissingOrDiffersIsNamed) {
  write("CREATE TABLE other (y)");
  EXPECT_EQ(schema_error(), "is damaged: table 't' is missing");
  for (const char* columns :
       {"id INTEGER PRIMARY KEY", "id INTEGER PRIMARY KEY, y REAL NOT NULL", "id INTEGER PRIMARY KEY, x TEXT NOT NULL",
        "id INTEGER, x REAL NOT NULL", "x REAL NOT NULL, id INTEGER PRIMARY KEY",
        "id INTEGER PRIMARY KEY, x REAL NOT NULL, z AS (x + 1)"}) {
    write("DROP TABLE IF EXISTS t; CREATE TABLE t (" + std::string(columns) + ")");
    EXPECT_EQ(schema_error(), "is damaged: table 't' has other columns than expected") << columns;
  }
}

TEST_F(ForeignDatabase, AViewInPlaceOfATableIsDamage) {
  write(
      "CREATE VIEW t AS WITH RECURSIVE n(i) AS (VALUES(1) UNION ALL SELECT i + 1 FROM n) SELECT i AS id, 1.0 AS x FROM "
      "n");
  EXPECT_EQ(schema_error(), "is damaged: table 't' is not a table but of type 'view'");
  // Nor can it be read.
  Database db = open();
  const auto select = db.prepare("SELECT id FROM t");
  EXPECT_FALSE(select);
}

TEST_F(ForeignDatabase, AVirtualTableIsDamage) {
  write("CREATE VIRTUAL TABLE t USING fts5(id, x)");
  EXPECT_THAT(schema_error(), HasSubstr("table 't' is not a table but of type 'virtual'"));
}

TEST_F(ForeignDatabase, AViewThatClaimsToBeATableIsNotRead) {
  write(
      "CREATE VIEW t AS SELECT 1 AS id, 1.0 AS x; PRAGMA writable_schema = ON; "
      "UPDATE sqlite_master SET type = 'table' WHERE name = 't';");
  auto db = Database::open(path_, Database::Mode::read_only);
  if (!db) return;
  EXPECT_FALSE(db->expect_tables(kTableSchema) && db->prepare("SELECT id FROM t"));
}

TEST_F(ForeignDatabase, TriggersDoNotRun) {
  write(std::string(kTableSchema) + "CREATE TRIGGER more AFTER INSERT ON t BEGIN DELETE FROM t; END;");
  Database db = open(Database::Mode::open);
  ASSERT_TRUE(db.execute("INSERT INTO t VALUES (1, 2.0)"));
  int rows = 0;
  ASSERT_TRUE(for_each_row(db, "SELECT * FROM t", [&](const SqlStatement&) {
    ++rows;
    return Status();
  }));
  EXPECT_EQ(rows, 1);
}

TEST_F(ForeignDatabase, AQueryWithoutEndEnds) {
  write(kTableSchema);
  Database db = open();
  auto endless = db.prepare("WITH RECURSIVE n(i) AS (VALUES(1) UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n");
  ASSERT_TRUE(endless);
  const auto row = endless->step();
  ASSERT_FALSE(row);
  EXPECT_EQ(row.error().code, ErrorCode::store_damaged);
  EXPECT_THAT(row.error().message(), HasSubstr("a query does not end"));
}

TEST_F(ForeignDatabase, ErrorsOfTheFileAreInputErrors) {
  const auto code_of_open = [](const std::string& path) {
    const auto db = Database::open(path, Database::Mode::read_only);
    EXPECT_FALSE(db) << path;
    return db ? ErrorCode::internal : db.error().code;
  };
  EXPECT_EQ(code_of_open(folder_.path() + "/none"), ErrorCode::input);
  EXPECT_EQ(code_of_open(folder_.path()), ErrorCode::input);
  EXPECT_EQ(code_of_open("/dev/zero"), ErrorCode::input);
  std::filesystem::create_symlink(folder_.path() + "/loop", folder_.path() + "/loop");
  EXPECT_EQ(code_of_open(folder_.path() + "/loop"), ErrorCode::input);
  EXPECT_EQ(code_of_open(folder_.path() + "/" + std::string(300, 'x')), ErrorCode::input);
  const std::string fifo = folder_.file("fifo");
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(code_of_open(fifo), ErrorCode::input);
}

TEST_F(ForeignDatabase, KnowsThatItsFileWasRemoved) {
  write(kTableSchema);
  const Database db = open(Database::Mode::open);
  EXPECT_FALSE(db.was_moved());
  std::filesystem::remove(path_);
  EXPECT_TRUE(db.was_moved());
}

TEST_F(ForeignDatabase, AValueThatCannotBeBoundIsNotStoredAsNull) {
  Database db = open(Database::Mode::create);
  ASSERT_TRUE(db.execute("CREATE TABLE u (x)"));
  auto insert = db.prepare("INSERT INTO u VALUES (?1)");
  ASSERT_TRUE(insert);
  const Status status = insert->bind(2, std::string("no such parameter")).run();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().where, path_);
  insert->reset();
  EXPECT_TRUE(insert->bind(1, 1.5).run()) << "the error ends with reset()";
  EXPECT_EQ(db.prepare("SELECT x FROM u")->step(), true) << "one row";
}

TEST(Database, APathMayBeginWithTwoSlashes) {
  const TemporaryFolder folder;
  const std::string path = "/" + folder.path() + "/a.sqlite";
  ASSERT_TRUE(Database::open(path, Database::Mode::create));
  const auto read = Database::open(path, Database::Mode::read_only);
  EXPECT_TRUE(read) << read.error().message();
}

TEST(Database, ANameThatLooksLikeAUriIsAPath) {
  const TemporaryFolder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const auto made = Database::open("file:a?mode=memory", Database::Mode::create);
  const bool exists = std::filesystem::exists("file:a?mode=memory");
  const auto read = Database::open("file:a?mode=memory", Database::Mode::read_only);
  std::filesystem::current_path(before);
  ASSERT_TRUE(made) << made.error().message();
  EXPECT_TRUE(exists);
  EXPECT_TRUE(read) << read.error().message();
}

// /proc/self/mem is a regular file; read() answers with EIO.
TEST(Database, AFileThatCannotBeReadIsAnErrorOfReading) {
  const auto db = Database::open("/proc/self/mem", Database::Mode::read_only);
  ASSERT_FALSE(db);
  EXPECT_EQ(db.error().code, ErrorCode::read_error) << db.error().message();
  EXPECT_NE(db.error().message().find("/proc/self/mem: cannot be read"), std::string::npos) << db.error().message();
}

}  // namespace
}  // namespace spartan
