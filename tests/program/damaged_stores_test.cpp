// Saved maps and run stores with damaged or hostile content: exit code 3 and the name of what is wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>

#include "program.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::run_program;

struct Damage {
  const char* sql;
  const char* message;
};

void damage_database(const std::string& path, const std::string& sql) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  char* error = nullptr;
  EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &error), SQLITE_OK) << sql << ": " << error;
  sqlite3_close(db);
}

class DamagedStores : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(stops() + "/whole")) GTEST_SKIP() << "built without the simulator";
  }
  static std::string stops() { return testing::small_runs_folder() + "/stops"; }
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }

  testing::TemporaryFolder folder_;
};

constexpr const char* kEndlessView =
    "DROP TABLE map_stops; CREATE VIEW map_stops AS WITH RECURSIVE n(i) AS (VALUES(1) UNION ALL SELECT i + 1 FROM n) "
    "SELECT i AS id, 1 AS stamp_ns, x'00' AS pose, x'00' AS covariance FROM n";

TEST_F(DamagedStores, OfMapsAreNamed) {
  ASSERT_EQ(run_program({"map", "export", stops() + "/whole", "-o", path("good.map")}).exit_code, 0);
  ASSERT_EQ(run_program({"map", "info", path("good.map")}).exit_code, 0);
  for (const Damage& damage : {
           Damage{"DELETE FROM map_submaps", "'map_submaps' has no submap"},
           Damage{"DROP TABLE map_stops", "table 'map_stops' is missing"},
           Damage{"ALTER TABLE map_tiles DROP COLUMN checksum", "table 'map_tiles' has other columns"},
           Damage{kEndlessView, "table 'map_stops' is not a table but of type 'view'"},
           Damage{"UPDATE map_properties SET value = -1", "the cell size is -1 m"},
           Damage{"UPDATE map_properties SET value = 'wide'", "the cell size is"},
           Damage{"UPDATE map_properties SET value = 1e300", "the cell size is"},
           Damage{"UPDATE map_tiles SET ix = ix + 9223372036854700000", "table 'map_tiles' has tile 9223372036854"},
           Damage{"UPDATE map_tiles SET iy = 2000000000 + iy", "table 'map_tiles' has tile"},
           Damage{"UPDATE map_tiles SET revision = 9223372036854775807", "revision 9223372036854775807"},
           Damage{"UPDATE map_tiles SET cells = x'00'", "checksum mismatch"},
           Damage{"UPDATE map_submaps SET id = -7", "table 'map_submaps' has the id -7"},
           Damage{"UPDATE map_submaps SET anchor = x'0011'", "submap 0"},
           Damage{"UPDATE map_submaps SET anchor = zeroblob(56)", "submap 0: is damaged: a number is out of bounds"},
           Damage{"UPDATE map_submaps SET anchor = x'000000000000000000000000000000000000000000000000000000000000F03F"
                  "00000000000000000000000000000000000000000000F07F'",
                  "submap 0: is damaged: a number is out of bounds"},
           Damage{"UPDATE map_properties SET value = 0.005 WHERE key = 'cell_m';"
                  "UPDATE map_submaps SET anchor = x'000000000000000000000000000000000000000000000000000000000000F03F"
                  "00000000882A614100000000000000000000000000000000'",
                  "the anchor of submap 0 is too far away"},
           Damage{"UPDATE map_stops SET pose = x''", "stop 0"},
       }) {
    fs::copy_file(path("good.map"), path("bad.map"), fs::copy_options::overwrite_existing);
    damage_database(path("bad.map"), damage.sql);
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"map", "info", path("bad.map")},
          {"map", "export", path("bad.map"), "-o", path("x.tif")},
          {"map", "merge", path("good.map"), path("bad.map"), "-o", path("x.map")}}) {
      const ProgramResult result = run_program(command);
      EXPECT_EQ(result.exit_code, 3) << command[1] << ": " << damage.sql << ": " << result.err;
      EXPECT_THAT(result.err, HasSubstr(damage.message)) << command[1] << ": " << damage.sql;
    }
  }
}

TEST_F(DamagedStores, FarWindowsAreUsageErrors) {
  for (const char* window : {"-1e300,-1e300,1e300,1e300", "1e12,0,1000000000010,10", "0,0,nan,1", "5,5,1,1"}) {
    EXPECT_EQ(run_program({"map", "export", stops() + "/whole", "-o", path("x.tif"), "--window", window}).exit_code, 2)
        << window;
  }
}

TEST_F(DamagedStores, OfRunsAreNamed) {
  for (const Damage& damage : {
           Damage{"DELETE FROM frames", "table 'frames' is empty"},
           Damage{"DROP TABLE health", "table 'health' is missing"},
           Damage{"ALTER TABLE frames ADD COLUMN more", "table 'frames' has other columns"},
           Damage{"UPDATE memory SET stages = x'010203'", "table 'memory': the checksum differs"},
           Damage{"UPDATE memory SET stages = substr(stages, 1, 500) || x'FF' || substr(stages, 502)",
                  "table 'memory': the checksum differs"},
           Damage{"DELETE FROM identity WHERE key = 'content'", "table 'identity'"},
           Damage{"UPDATE frames SET qw = 1e300", "table 'frames': a pose is incomplete or not finite"},
           Damage{"UPDATE frames SET stamp_ns = 9223372036854775807", "table 'frames'"},
           Damage{"UPDATE localization SET pose = x'00'", "table 'localization': a pose"},
           Damage{"UPDATE slam SET covariance = x'00'", "table 'slam': a pose"},
           Damage{"UPDATE health SET state = 'fine'", "table 'health'"},
           Damage{"DELETE FROM map_submaps", "'map_submaps' has no submap"},
       }) {
    fs::remove_all(path("run"));
    fs::copy(stops() + "/whole", path("run"), fs::copy_options::recursive);
    damage_database(path("run/run.sqlite"), damage.sql);
    const ProgramResult result = run_program({"run", stops() + "/rec", "-o", path("run"), "--resume"});
    EXPECT_EQ(result.exit_code, 3) << damage.sql << ": " << result.err;
    EXPECT_THAT(result.err, HasSubstr(damage.message)) << damage.sql;
  }
}

}  // namespace
}  // namespace spartan
