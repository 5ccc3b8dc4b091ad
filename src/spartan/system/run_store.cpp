#include "spartan/system/run_store.h"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <utility>

#include "spartan/storage/database.h"
#include "spartan/system/internal/run_identity.h"
#include "spartan/system/internal/run_store_state.h"

namespace spartan {
namespace {

constexpr int kPageBytes = 512;  // a frame adds at most about 0.5 kB to each of several tables
// Pages in the write-ahead log that are copied into the database at once (2 MB): what is written again and again, such
// as the state of the pipeline, is copied once. With 16 MB no byte less is written, but the end of a run copies them.
constexpr int kLogPages = 4096;
constexpr int kApplicationId = 0x5350544E;  // "SPTN"
constexpr int kUserVersion = 3, kOldestReadableVersion = 2;

// All columns are the same in every run of the same input, except wall_ms and cpu_ms.
constexpr const char* kSchema = R"(
CREATE TABLE identity (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE frames (
  seq INTEGER PRIMARY KEY, frame_id INTEGER NOT NULL, pair TEXT NOT NULL, stamp_ns INTEGER NOT NULL,
  status TEXT NOT NULL, fault TEXT NOT NULL, message TEXT NOT NULL, has_pose INTEGER NOT NULL,
  tx REAL, ty REAL, tz REAL, qx REAL, qy REAL, qz REAL, qw REAL, covariance BLOB,
  motion_from_ns INTEGER, motion_first INTEGER, motion BLOB, motion_covariance BLOB,
  landmarks INTEGER, matches INTEGER, inliers INTEGER, rms_px REAL);
CREATE TABLE stage_times (seq INTEGER NOT NULL, stage TEXT NOT NULL, wall_ms REAL NOT NULL, cpu_ms REAL NOT NULL);
CREATE TABLE terrain (stamp_ns INTEGER PRIMARY KEY, pair TEXT NOT NULL, density_percent REAL NOT NULL, points INTEGER NOT NULL);
CREATE TABLE localization (
  seq INTEGER PRIMARY KEY, pose BLOB NOT NULL, covariance BLOB NOT NULL, odom_pose BLOB NOT NULL,
  odom_covariance BLOB NOT NULL, slip REAL, slip_sigma REAL);
CREATE TABLE slam (seq INTEGER PRIMARY KEY, pose BLOB NOT NULL, covariance BLOB NOT NULL);
CREATE TABLE health (seq INTEGER NOT NULL, sensor TEXT NOT NULL, state TEXT NOT NULL, reason TEXT NOT NULL);
CREATE TABLE maps (
  stamp_ns INTEGER PRIMARY KEY, position_id INTEGER NOT NULL, views INTEGER NOT NULL, pose BLOB NOT NULL,
  covariance BLOB NOT NULL, known_cells INTEGER NOT NULL, obstacles INTEGER NOT NULL, believed_pose BLOB NOT NULL,
  believed_covariance BLOB NOT NULL, verdict TEXT NOT NULL, overlap REAL NOT NULL);
CREATE TABLE memory (id INTEGER PRIMARY KEY CHECK (id = 1), samples_taken INTEGER NOT NULL, stages BLOB NOT NULL);
)";
// Added to stores that are without them. `counts`: rows of the tables at the checkpoint; stores of version 2 have a
// checkpoint at the latest frame.
constexpr const char* kAddedTables = R"(
CREATE TABLE IF NOT EXISTS elapsed (id INTEGER PRIMARY KEY CHECK (id = 1), wall_ms REAL NOT NULL, cpu_ms REAL NOT NULL);
CREATE TABLE IF NOT EXISTS counts (
  id INTEGER PRIMARY KEY CHECK (id = 1), frames INTEGER NOT NULL, terrain INTEGER NOT NULL, maps INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS localization_inputs (seq INTEGER NOT NULL, inputs BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS smoothed (seq INTEGER PRIMARY KEY, pose BLOB NOT NULL, covariance BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS innovations (
  seq INTEGER NOT NULL, sensor TEXT NOT NULL, stamp_ns INTEGER NOT NULL, nis REAL NOT NULL, gate REAL NOT NULL);
CREATE TABLE IF NOT EXISTS latencies (seq INTEGER PRIMARY KEY, wall_ms REAL NOT NULL);
)";
// Frames are numbered from 1 without gaps; terrain views and maps are committed in the order of their stamps.
constexpr const char* kReturnToCheckpoint = R"(
INSERT OR IGNORE INTO counts SELECT 1, 0, 0, 0 WHERE NOT EXISTS (SELECT 1 FROM memory);
DELETE FROM frames WHERE seq > (SELECT frames FROM counts);
DELETE FROM stage_times WHERE seq > (SELECT frames FROM counts);
DELETE FROM localization WHERE seq > (SELECT frames FROM counts);
DELETE FROM slam WHERE seq > (SELECT frames FROM counts);
DELETE FROM health WHERE seq > (SELECT frames FROM counts);
DELETE FROM localization_inputs WHERE seq > (SELECT frames FROM counts);
DELETE FROM innovations WHERE seq > (SELECT frames FROM counts);
DELETE FROM latencies WHERE seq > (SELECT frames FROM counts);
DELETE FROM terrain WHERE EXISTS (SELECT 1 FROM counts) AND stamp_ns NOT IN (
  SELECT stamp_ns FROM terrain ORDER BY stamp_ns LIMIT (SELECT terrain FROM counts));
DELETE FROM maps WHERE EXISTS (SELECT 1 FROM counts) AND stamp_ns NOT IN (
  SELECT stamp_ns FROM maps ORDER BY stamp_ns LIMIT (SELECT maps FROM counts));
)";
constexpr const char* kSelectCounts =
    "SELECT (SELECT coalesce(max(seq), 0) FROM frames), (SELECT count(*) FROM terrain), (SELECT count(*) FROM maps)";
constexpr const char* kSelectProgress =
    "SELECT (SELECT coalesce(max(seq), 0) FROM frames), (SELECT coalesce(max(samples_taken), -1) FROM memory)";

Bytes bytes_of(const Matrix6d& m) {
  ArchiveWriter out;
  out.put(m);
  return out.take();
}
Bytes bytes_of(const Pose& pose) {
  ArchiveWriter out;
  out.put(pose);
  return out.take();
}

Result<int> pragma(Database& db, const char* name) {
  auto statement = db.prepare(fmt::format("PRAGMA {}", name));
  if (!statement) return failure(statement);
  const auto row = statement->step();
  if (!row) return failure(row);
  return static_cast<int>(statement->integer(0));
}

Status check_version(Database& db) {
  const auto application = pragma(db, "application_id");
  if (!application) return failure(application);
  const auto version = pragma(db, "user_version");
  if (!version) return failure(version);
  if (*application != kApplicationId) return failure(ErrorCode::input, "is not the database of a run", db.path());
  if (*version < kOldestReadableVersion || *version > kUserVersion) {
    return failure(ErrorCode::configuration,
                   fmt::format("has schema version {}, but this program writes version {}", *version, kUserVersion),
                   db.path(), "run again into a new folder");
  }
  return {};
}

}  // namespace

Status RunStore::State::prepare() {
  auto opened = TileStore::open_existing(db);
  if (!opened) return failure(opened);
  tiles.emplace(std::move(*opened));
  if (Status s =
          db.execute(fmt::format("{} PRAGMA user_version={}; PRAGMA wal_autocheckpoint={}; PRAGMA secure_delete=0; "
                                 "PRAGMA synchronous=FULL;",
                                 kAddedTables, kUserVersion, kLogPages));
      !s)
    return s;
  const std::pair<std::optional<SqlStatement>*, const char*> statements[] = {
      {&insert_frame, "INSERT INTO frames VALUES (NULL,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)"},
      {&insert_time, "INSERT INTO stage_times VALUES ((SELECT max(seq) FROM frames),?,?,?)"},
      {&insert_latency, "INSERT INTO latencies VALUES ((SELECT max(seq) FROM frames),?)"},
      {&insert_localization, "INSERT INTO localization VALUES ((SELECT max(seq) FROM frames),?,?,?,?,?,?)"},
      {&insert_slam, "INSERT INTO slam VALUES ((SELECT max(seq) FROM frames),?,?)"},
      {&insert_health, "INSERT INTO health VALUES ((SELECT max(seq) FROM frames),?,?,?)"},
      {&insert_innovation, "INSERT INTO innovations VALUES ((SELECT max(seq) FROM frames),?,?,?,?)"},
      {&insert_inputs, "INSERT INTO localization_inputs VALUES ((SELECT coalesce(max(seq), 0) FROM frames),?)"},
      {&insert_smoothed, "INSERT INTO smoothed VALUES (?,?,?)"},
      {&insert_map, "INSERT INTO maps VALUES (?,?,?,?,?,?,?,?,?,?,?)"},
      {&insert_terrain, "INSERT INTO terrain VALUES (?,?,?,?)"},
      {&replace_checkpoint, "INSERT OR REPLACE INTO memory VALUES (1,?,?)"},
      {&replace_content, "INSERT OR REPLACE INTO identity VALUES ('content',?)"},
      {&replace_stream, "INSERT OR REPLACE INTO identity VALUES ('stream',?)"},
      {&replace_elapsed, "INSERT OR REPLACE INTO elapsed VALUES (1,?,?)"},
      {&replace_counts, "INSERT OR REPLACE INTO counts VALUES (1,?,?,?)"},
      {&select_counts, kSelectCounts},
      {&select_progress, kSelectProgress},
  };
  for (const auto& [statement, sql] : statements) {
    auto prepared = db.prepare(sql);
    if (!prepared) return failure(prepared);
    statement->emplace(std::move(*prepared));
  }
  const auto stored = stored_progress();
  if (!stored) return failure(stored);
  progress = *stored;
  return {};
}

Status RunStore::State::return_to_checkpoint() {
  if (Status s = commit([&] { return db.execute(kReturnToCheckpoint); }); !s) return s;
  const auto stored = stored_progress();
  if (!stored) return failure(stored);
  progress = *stored;
  return {};
}

Result<RunStore::State::Progress> RunStore::State::stored_progress() {
  select_progress->reset();
  const auto row = select_progress->step();
  if (!row) return failure(row);
  const Progress stored{select_progress->integer(0), select_progress->integer(1)};
  select_progress->reset();
  return stored;
}

Result<RunStore::RowCounts> RunStore::State::row_counts() {
  select_counts->reset();
  const auto row = select_counts->step();
  if (!row) return failure(row);
  const RowCounts counts{select_counts->integer(0), select_counts->integer(1), select_counts->integer(2)};
  select_counts->reset();
  return counts;
}

Status RunStore::State::expect_unchanged() {
  if (db.was_moved()) {
    return failure(ErrorCode::output, "was removed or replaced during the run", db.path(),
                   "run again into a new folder");
  }
  const auto stored = stored_progress();
  if (!stored) return failure(stored);
  if (*stored == progress) return {};
  return failure(ErrorCode::output, "was changed by another process during the run", db.path(),
                 "let one process work on a run folder, then continue with --resume");
}

Status RunStore::State::commit(const std::function<Status()>& write) {
  if (Status s = db.execute("BEGIN IMMEDIATE"); !s) return s;
  Status written = expect_unchanged();
  if (written) written = write();
  const auto stored = written ? stored_progress() : Result<Progress>(progress);
  if (!stored) written = failure(stored);
  if (written) written = db.execute("COMMIT");
  if (written) progress = *stored;
  if (!written) static_cast<void>(db.execute("ROLLBACK"));  // fails if SQLite has already rolled back
  return written;
}

Status RunStore::State::write(const Step& step) {
  if (step.frame) {
    if (Status s = write(*step.frame); !s) return s;
    // Of a run that ended here before.
    if (Status s = db.execute("DELETE FROM smoothed"); !s) return s;
  }
  if (step.terrain) {
    if (Status s = write(*step.terrain); !s) return s;
  }
  if (step.map) {
    if (Status s = write(*step.map); !s) return s;
  }
  if (!step.localization_inputs.empty()) {
    Bytes inputs = step.localization_inputs;
    append_checksum(inputs);
    if (Status s = insert_inputs->bind(1, inputs).run(); !s) return s;
  }
  return write(step.times);
}

Status RunStore::State::write_checkpoint(const Checkpoint& checkpoint) {
  const SourcePosition& source = checkpoint.source;
  const ElapsedTime& elapsed = checkpoint.elapsed;
  Bytes memory = checkpoint.pipeline_state;
  append_checksum(memory);
  if (Status s = replace_checkpoint->bind(1, source.samples_taken).bind(2, memory).run(); !s) return s;
  if (Status s = replace_elapsed->bind(1, 1e3 * elapsed.wall_s).bind(2, 1e3 * elapsed.cpu_s).run(); !s) return s;
  const auto rows = checkpoint.rows ? Result<RowCounts>(*checkpoint.rows) : row_counts();
  if (!rows) return failure(rows);
  if (Status s = replace_counts->bind(1, rows->frames).bind(2, rows->terrain).bind(3, rows->maps).run(); !s) return s;
  if (Status s = replace_content->bind(1, fmt::format("{:016x}", source.content_hash)).run(); !s) return s;
  if (source.last_stamps.empty()) return {};
  std::string text;
  for (const auto& [name, stamp] : source.last_stamps) text += fmt::format("{} {}\n", stamp.ns, name);
  return replace_stream->bind(1, text).run();
}

Status RunStore::State::write(const LocalizationRecord& l) {
  SqlStatement& i = *insert_localization;
  i.bind(1, bytes_of(l.world_from_body.pose)).bind(2, bytes_of(l.world_from_body.covariance));
  i.bind(3, bytes_of(l.odom_from_body.pose)).bind(4, bytes_of(l.odom_from_body.covariance));
  i.bind(5, l.slip).bind(6, l.slip_sigma);
  if (Status s = i.run(); !s) return s;
  for (const LocalizationRecord::Sensor& sensor : l.sensors) {
    if (Status s = insert_health->bind(1, sensor.name).bind(2, sensor.state).bind(3, sensor.reason).run(); !s) return s;
    if (!sensor.test) continue;
    insert_innovation->bind(1, sensor.name).bind(2, sensor.test->stamp.ns);
    if (Status s = insert_innovation->bind(3, sensor.test->nis).bind(4, sensor.test->gate).run(); !s) return s;
  }
  return {};
}

Status RunStore::State::write(const TerrainRecord& t) {
  return insert_terrain->bind(1, t.stamp.ns).bind(2, t.pair).bind(3, t.density_percent).bind(4, t.points).run();
}

Status RunStore::State::write(const MapRecord& map) {
  SqlStatement& i = *insert_map;
  i.bind(1, map.stamp.ns).bind(2, map.position_id).bind(3, std::int64_t{map.views});
  i.bind(4, bytes_of(map.world_from_body.pose)).bind(5, bytes_of(map.world_from_body.covariance));
  i.bind(6, std::int64_t{map.known_cells}).bind(7, std::int64_t{map.obstacles});
  i.bind(8, bytes_of(map.prior.pose)).bind(9, bytes_of(map.prior.covariance));
  return i.bind(10, map.status).bind(11, map.overlap).run();
}

// Times of the latest frame.
Status RunStore::State::write(const std::vector<StageTime>& times) {
  for (const StageTime& time : times) {
    if (Status s = insert_time->bind(1, time.stage).bind(2, time.wall_ms).bind(3, time.cpu_ms).run(); !s) return s;
  }
  return {};
}

Status RunStore::State::write(const FrameRecord& frame) {
  const Eigen::Vector3d& t = frame.world_from_body.pose.translation();
  const Eigen::Quaterniond& q = frame.world_from_body.pose.rotation();
  const MotionEstimate& motion = frame.motion;
  SqlStatement& f = *insert_frame;
  f.bind(1, frame.frame_id).bind(2, frame.pair).bind(3, frame.stamp.ns).bind(4, frame.status).bind(5, frame.fault);
  f.bind(6, frame.message).bind(7, std::int64_t{frame.has_pose});
  f.bind(8, t.x()).bind(9, t.y()).bind(10, t.z()).bind(11, q.x()).bind(12, q.y()).bind(13, q.z()).bind(14, q.w());
  f.bind(15, bytes_of(frame.world_from_body.covariance));
  f.bind(16, motion.from.ns).bind(17, std::int64_t{motion.first}).bind(18, bytes_of(motion.previous_from_current));
  f.bind(19, bytes_of(motion.covariance)).bind(20, std::int64_t{motion.landmarks});
  f.bind(21, std::int64_t{motion.matches}).bind(22, std::int64_t{motion.inliers}).bind(23, motion.rms_px);
  if (Status s = f.run(); !s) return s;
  if (Status s = write(frame.times); !s) return s;
  if (frame.latency_ms) {
    if (Status s = insert_latency->bind(1, *frame.latency_ms).run(); !s) return s;
  }
  if (frame.slam) {
    insert_slam->bind(1, bytes_of(frame.slam->pose)).bind(2, bytes_of(frame.slam->covariance));
    if (Status s = insert_slam->run(); !s) return s;
  }
  return frame.localization ? write(*frame.localization) : Status();
}

RunStore::RunStore(std::unique_ptr<State> state) : state_(std::move(state)) {}
RunStore::RunStore(RunStore&&) noexcept = default;
RunStore& RunStore::operator=(RunStore&&) noexcept = default;
RunStore::~RunStore() = default;

Result<bool> RunStore::contains_run(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return false;
  auto db = Database::open(path, Database::Mode::open);
  if (!db) return failure(db);
  auto tables = db->prepare("SELECT count(*) FROM sqlite_master");
  if (!tables) return failure(tables);
  const auto row = tables->step();
  if (!row) return failure(row);
  return tables->integer(0) > 0;
}

Result<std::optional<RunIdentity>> RunStore::identity_of(const std::string& path) {
  const auto there = contains_run(path);
  if (!there) return failure(there);
  if (!*there) return std::nullopt;
  auto store = open_read_only(path);
  if (!store) return failure(store);
  auto identity = store->identity();
  if (!identity) return failure(identity);
  return std::move(*identity);
}

Result<RunIdentity> RunStore::identity() {
  return internal::read_identity(state_->db);
}

Result<RunStore> RunStore::create(const std::string& path, const RunIdentity& identity) {
  auto db = Database::open(path, Database::Mode::create, kPageBytes);
  if (!db) return failure(db);
  const std::string header =
      fmt::format("PRAGMA application_id={}; PRAGMA user_version={};", kApplicationId, kUserVersion);
  if (Status s = db->execute("BEGIN;" + header + kSchema); !s) return failure(s);
  if (Status s = internal::write_identity(*db, identity); !s) return failure(s);
  if (const auto tiles = TileStore::open(*db); !tiles) return failure(tiles);
  if (Status s = db->execute("COMMIT"); !s) return failure(s);
  auto state = std::make_unique<State>(std::move(*db));
  if (Status s = state->prepare(); !s) return failure(s);
  return RunStore(std::move(state));
}

Result<RunStore> RunStore::resume(const std::string& path, const RunIdentity& identity) {
  auto db = Database::open(path, Database::Mode::open);
  if (!db) return failure(db);
  if (Status s = check_version(*db); !s) return failure(s);
  if (Status s = db->expect_tables(kSchema); !s) return failure(s);
  if (Status s = internal::expect_identity(*db, identity); !s) return failure(s);
  auto state = std::make_unique<State>(std::move(*db));
  if (Status s = state->prepare(); !s) return failure(s);
  if (Status s = state->return_to_checkpoint(); !s) return failure(s);
  return RunStore(std::move(state));
}

Result<RunStore> RunStore::open_read_only(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    return failure(ErrorCode::input, "does not exist: this is not a run folder", path);
  auto db = Database::open(path, Database::Mode::read_only);
  if (!db) return failure(db);
  if (Status s = check_version(*db); !s) return failure(s);
  if (Status s = db->expect_tables(kSchema); !s) return failure(s);
  auto state = std::make_unique<State>(std::move(*db));
  auto tiles = TileStore::open_existing(state->db);
  if (!tiles) return failure(tiles);
  state->tiles.emplace(std::move(*tiles));
  return RunStore(std::move(state));
}

Status RunStore::commit(const std::vector<Step>& steps, const std::optional<Checkpoint>& checkpoint,
                        const MapChanges& maps) {
  return state_->commit([&]() -> Status {
    for (const Step& step : steps) {
      if (Status s = state_->write(step); !s) return s;
    }
    if (Status s = state_->tiles->write(maps); !s) return s;
    return checkpoint ? state_->write_checkpoint(*checkpoint) : Status();
  });
}

Result<RunStore::RowCounts> RunStore::row_counts() {
  return state_->row_counts();
}

Status RunStore::commit_smoothed(const std::vector<std::optional<UncertainPose>>& poses) {
  return state_->commit([&]() -> Status {
    if (Status s = state_->db.execute("DELETE FROM smoothed"); !s) return s;
    std::int64_t seq = 0;
    for (const std::optional<UncertainPose>& pose : poses) {
      ++seq;
      if (!pose) continue;
      SqlStatement& i = *state_->insert_smoothed;
      if (Status s = i.bind(1, seq).bind(2, bytes_of(pose->pose)).bind(3, bytes_of(pose->covariance)).run(); !s)
        return s;
    }
    return {};
  });
}

}  // namespace spartan
