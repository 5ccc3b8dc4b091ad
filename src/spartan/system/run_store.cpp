#include "spartan/system/run_store.h"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <utility>

#include "spartan/core/options.h"
#include "spartan/storage/database.h"
#include "spartan/system/run_options.h"

namespace spartan {
namespace {

constexpr int kApplicationId = 0x5350544E;  // "SPTN"
constexpr int kUserVersion = 2;

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
CREATE INDEX health_of_frame ON health (seq);
CREATE TABLE maps (
  stamp_ns INTEGER PRIMARY KEY, position_id INTEGER NOT NULL, views INTEGER NOT NULL, pose BLOB NOT NULL,
  covariance BLOB NOT NULL, known_cells INTEGER NOT NULL, obstacles INTEGER NOT NULL, believed_pose BLOB NOT NULL,
  believed_covariance BLOB NOT NULL, verdict TEXT NOT NULL, overlap REAL NOT NULL);
CREATE TABLE memory (id INTEGER PRIMARY KEY CHECK (id = 1), samples_taken INTEGER NOT NULL, stages BLOB NOT NULL);
)";

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
  if (*version != kUserVersion) {
    return failure(ErrorCode::configuration,
                   fmt::format("has schema version {}, but this program writes version {}", *version, kUserVersion),
                   db.path(), "run again into a new folder");
  }
  return {};
}

Status write_identity(Database& db, const std::string& key, const std::string& value) {
  auto insert = db.prepare("INSERT INTO identity VALUES (?, ?)");
  if (!insert) return failure(insert);
  return insert->bind(1, key).bind(2, value).run();
}

Status expect_identity(Database& db, const std::string& key, const std::string& value, std::string what) {
  auto select = db.prepare("SELECT value FROM identity WHERE key = ?");
  if (!select) return failure(select);
  select->bind(1, key);
  const auto row = select->step();
  if (!row) return failure(row);
  if (*row && select->text(0) == value) return {};
  if (*row && key == "options") {
    const auto before = parse_options<RunOptions>(select->text(0), db.path()),
               now = parse_options<RunOptions>(value, key);
    if (before && now) {
      const std::string differences = option_differences(*before, *now);
      if (differences.empty()) return {};  // only descriptions differ
      what += ": " + differences;
    }
  }
  return failure(ErrorCode::configuration, "was written by a run with " + what, db.path(),
                 "resume with the same input, rig and options, or run into a new folder");
}

}  // namespace

struct RunStore::State {
  explicit State(Database db_in) : db(std::move(db_in)) {}
  std::optional<TileStore> tiles;
  Database db;
  std::optional<SqlStatement> insert_frame, insert_time, insert_localization, insert_slam, insert_health,
      insert_terrain, insert_map, replace_checkpoint;

  Status prepare();
  Status write(const Step& step, const std::function<Result<Bytes>()>& save, std::int64_t samples_taken);
  Status write(const FrameRecord& frame);
  Status write(const LocalizationRecord& localization);
  Status write(const TerrainRecord& terrain);
  Status write(const MapRecord& map);
  Status write(const std::vector<StageTime>& times);
};

Status RunStore::State::prepare() {
  auto opened = TileStore::open_existing(db);
  if (!opened) return failure(opened);
  tiles.emplace(std::move(*opened));
  const auto make = [&](std::optional<SqlStatement>& statement, const char* sql) -> Status {
    auto prepared = db.prepare(sql);
    if (!prepared) return failure(prepared);
    statement.emplace(std::move(*prepared));
    return {};
  };
  if (Status s = make(insert_frame, "INSERT INTO frames VALUES (NULL,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
      !s)
    return s;
  if (Status s = make(insert_time, "INSERT INTO stage_times VALUES ((SELECT max(seq) FROM frames),?,?,?)"); !s)
    return s;
  if (Status s =
          make(insert_localization, "INSERT INTO localization VALUES ((SELECT max(seq) FROM frames),?,?,?,?,?,?)");
      !s)
    return s;
  if (Status s = make(insert_slam, "INSERT INTO slam VALUES ((SELECT max(seq) FROM frames),?,?)"); !s) return s;
  if (Status s = make(insert_health, "INSERT INTO health VALUES ((SELECT max(seq) FROM frames),?,?,?)"); !s) return s;
  if (Status s = make(insert_map, "INSERT INTO maps VALUES (?,?,?,?,?,?,?,?,?,?,?)"); !s) return s;
  if (Status s = make(insert_terrain, "INSERT INTO terrain VALUES (?,?,?,?)"); !s) return s;
  return make(replace_checkpoint, "INSERT OR REPLACE INTO memory VALUES (1,?,?)");
}

Status RunStore::State::write(const Step& step, const std::function<Result<Bytes>()>& save,
                              std::int64_t samples_taken) {
  if (step.frame) {
    if (Status s = write(*step.frame); !s) return s;
  }
  if (step.terrain) {
    if (Status s = write(*step.terrain); !s) return s;
  }
  if (step.map) {
    if (Status s = write(*step.map); !s) return s;
  }
  if (Status s = write(step.times); !s) return s;
  const auto pipeline_state = save();
  if (!pipeline_state) return failure(pipeline_state);
  return replace_checkpoint->bind(1, samples_taken).bind(2, *pipeline_state).run();
}

Status RunStore::State::write(const LocalizationRecord& l) {
  SqlStatement& i = *insert_localization;
  i.bind(1, bytes_of(l.world_from_body.pose)).bind(2, bytes_of(l.world_from_body.covariance));
  i.bind(3, bytes_of(l.odom_from_body.pose)).bind(4, bytes_of(l.odom_from_body.covariance));
  i.bind(5, l.slip).bind(6, l.slip_sigma);
  if (Status s = i.run(); !s) return s;
  for (const LocalizationRecord::Sensor& sensor : l.sensors) {
    if (Status s = insert_health->bind(1, sensor.name).bind(2, sensor.state).bind(3, sensor.reason).run(); !s) return s;
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
  if (!std::filesystem::exists(path)) return false;
  auto db = Database::open(path, Database::Mode::open);
  if (!db) return failure(db);
  auto tables = db->prepare("SELECT count(*) FROM sqlite_master");
  if (!tables) return failure(tables);
  const auto row = tables->step();
  if (!row) return failure(row);
  return tables->integer(0) > 0;
}

Result<RunStore> RunStore::create(const std::string& path, const RunIdentity& identity) {
  auto db = Database::open(path, Database::Mode::create);
  if (!db) return failure(db);
  const std::string header =
      fmt::format("PRAGMA application_id={}; PRAGMA user_version={};", kApplicationId, kUserVersion);
  if (Status s = db->execute("BEGIN;" + header + kSchema); !s) return failure(s);
  if (Status s = write_identity(*db, "input", identity.input); !s) return failure(s);
  if (Status s = write_identity(*db, "options", identity.options); !s) return failure(s);
  if (Status s = write_identity(*db, "rig", identity.rig); !s) return failure(s);
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
  if (Status s = expect_identity(*db, "input", identity.input, "another input"); !s) return failure(s);
  if (Status s = expect_identity(*db, "rig", identity.rig, "another rig"); !s) return failure(s);
  if (Status s = expect_identity(*db, "options", identity.options, "other options"); !s) return failure(s);
  auto state = std::make_unique<State>(std::move(*db));
  if (Status s = state->prepare(); !s) return failure(s);
  return RunStore(std::move(state));
}

Result<RunStore> RunStore::open_read_only(const std::string& path) {
  if (!std::filesystem::exists(path))
    return failure(ErrorCode::input, "does not exist: this is not a run folder", path);
  auto db = Database::open(path, Database::Mode::read_only);
  if (!db) return failure(db);
  if (Status s = check_version(*db); !s) return failure(s);
  auto state = std::make_unique<State>(std::move(*db));
  auto tiles = TileStore::open_existing(state->db);
  if (!tiles) return failure(tiles);
  state->tiles.emplace(std::move(*tiles));
  return RunStore(std::move(state));
}

Status RunStore::commit(const Step& step, const std::function<Result<Bytes>()>& save, std::int64_t samples_taken) {
  if (Status s = state_->db.execute("BEGIN IMMEDIATE"); !s) return s;
  Status written = state_->write(step, save, samples_taken);
  if (written) written = state_->db.execute("COMMIT");
  if (!written) static_cast<void>(state_->db.execute("ROLLBACK"));  // fails if SQLite has already rolled back
  return written;
}

namespace {

// A query over a table whose first column is a frame's `seq`, read in parallel with the frames (merge join): its rows
// are in the order of the frames, so each row is read once, for any number of frames.
class RowsOfFrames {
 public:
  static Result<RowsOfFrames> open(Database& db, const char* sql) {
    auto select = db.prepare(sql);
    if (!select) return failure(select);
    RowsOfFrames rows(std::move(*select), db.path());
    if (Status s = rows.next(); !s) return failure(s);
    return rows;
  }

  /// Calls `read(row)` for each row of this frame. Must be called for the frames in their order.
  template <class Read>
  Status of(std::int64_t seq, const Read& read) {
    while (more_ && seq_ <= seq) {
      if (seq_ == seq) read(std::as_const(select_));
      if (Status s = next(); !s) return s;
    }
    return {};
  }

 private:
  RowsOfFrames(SqlStatement select, std::string path) : select_(std::move(select)), path_(std::move(path)) {}

  Status next() {
    const auto row = select_.step();
    if (!row) return failure(row);
    more_ = *row;
    if (!more_) return {};
    const std::int64_t before = std::exchange(seq_, select_.integer(0));
    if (seq_ >= before) return {};
    return failure(ErrorCode::store_damaged, "is damaged: rows are not in the order of the frames", path_,
                   "run again into a new folder");
  }

  SqlStatement select_;
  std::string path_;
  std::int64_t seq_ = 0;
  bool more_ = false;
};

LocalizationRecord localization_of(const SqlStatement& row) {
  LocalizationRecord l;
  const Bytes pose = row.blob(1), covariance = row.blob(2), odom = row.blob(3), odom_covariance = row.blob(4);
  l.world_from_body = {ArchiveReader(pose).get_pose(), ArchiveReader(covariance).get_matrix6()};
  l.odom_from_body = {ArchiveReader(odom).get_pose(), ArchiveReader(odom_covariance).get_matrix6()};
  if (!row.is_null(5)) l.slip = row.real(5);
  if (!row.is_null(6)) l.slip_sigma = row.real(6);
  return l;
}

FrameRecord frame_of(const SqlStatement& row) {
  FrameRecord r;
  r.frame_id = row.integer(1);
  r.pair = row.text(2);
  r.stamp.ns = row.integer(3);
  r.status = row.text(4);
  r.fault = row.text(5);
  r.message = row.text(6);
  r.has_pose = row.integer(7) != 0;
  const Eigen::Quaterniond q(row.real(14), row.real(11), row.real(12), row.real(13));
  r.world_from_body.pose = Pose::from_unit_quaternion(q, {row.real(8), row.real(9), row.real(10)});
  const Bytes covariance = row.blob(15), motion = row.blob(18), motion_covariance = row.blob(19);
  r.world_from_body.covariance = ArchiveReader(covariance).get_matrix6();
  r.motion.from.ns = row.integer(16);
  r.motion.to = r.stamp;
  r.motion.first = row.integer(17) != 0;
  r.motion.previous_from_current = ArchiveReader(motion).get_pose();
  r.motion.covariance = ArchiveReader(motion_covariance).get_matrix6();
  r.motion.landmarks = static_cast<int>(row.integer(20));
  r.motion.matches = static_cast<int>(row.integer(21));
  r.motion.inliers = static_cast<int>(row.integer(22));
  r.motion.rms_px = row.real(23);
  return r;
}

}  // namespace

TileStore& RunStore::tiles() {
  return *state_->tiles;
}

// Tables with several rows per frame are written in its transaction, so their rows are in the order of the frames.
Result<std::vector<FrameRecord>> RunStore::frames() {
  Database& db = state_->db;
  auto select = db.prepare("SELECT * FROM frames ORDER BY seq");
  if (!select) return failure(select);
  auto times = RowsOfFrames::open(db, "SELECT seq, stage, wall_ms, cpu_ms FROM stage_times ORDER BY rowid");
  if (!times) return failure(times);
  auto localization = RowsOfFrames::open(db, "SELECT * FROM localization ORDER BY seq");
  if (!localization) return failure(localization);
  auto slam = RowsOfFrames::open(db, "SELECT * FROM slam ORDER BY seq");
  if (!slam) return failure(slam);
  auto health = RowsOfFrames::open(db, "SELECT seq, sensor, state, reason FROM health ORDER BY rowid");
  if (!health) return failure(health);
  std::vector<FrameRecord> records;
  for (;;) {
    const auto row = select->step();
    if (!row) return failure(row);
    if (!*row) return records;
    const std::int64_t seq = select->integer(0);
    FrameRecord& r = records.emplace_back(frame_of(*select));
    Status read = times->of(seq, [&](const SqlStatement& time) {
      r.times.push_back({time.text(1), time.real(2), time.real(3)});
    });
    if (read) {
      read = slam->of(seq, [&](const SqlStatement& corrected) {
        const Bytes pose = corrected.blob(1), covariance = corrected.blob(2);
        r.slam = UncertainPose{ArchiveReader(pose).get_pose(), ArchiveReader(covariance).get_matrix6()};
      });
    }
    if (read) {
      read = localization->of(seq, [&](const SqlStatement& localized) { r.localization = localization_of(localized); });
    }
    if (read) {
      read = health->of(seq, [&](const SqlStatement& sensor) {
        if (r.localization) r.localization->sensors.push_back({sensor.text(1), sensor.text(2), sensor.text(3)});
      });
    }
    if (!read) return failure(read);
  }
}

Result<std::vector<TerrainRecord>> RunStore::terrain() {
  auto select = state_->db.prepare("SELECT * FROM terrain ORDER BY stamp_ns");
  if (!select) return failure(select);
  std::vector<TerrainRecord> records;
  for (;;) {
    const auto row = select->step();
    if (!row) return failure(row);
    if (!*row) return records;
    records.push_back({Stamp{select->integer(0)}, select->text(1), select->real(2), select->integer(3)});
  }
}

Result<std::vector<MapRecord>> RunStore::maps() {
  auto select = state_->db.prepare("SELECT * FROM maps ORDER BY stamp_ns");
  if (!select) return failure(select);
  std::vector<MapRecord> records;
  for (;;) {
    const auto row = select->step();
    if (!row) return failure(row);
    if (!*row) return records;
    const Bytes pose = select->blob(3), covariance = select->blob(4), prior = select->blob(7),
                prior_covariance = select->blob(8);
    records.push_back({Stamp{select->integer(0)},
                       select->integer(1),
                       static_cast<int>(select->integer(2)),
                       {ArchiveReader(prior).get_pose(), ArchiveReader(prior_covariance).get_matrix6()},
                       {ArchiveReader(pose).get_pose(), ArchiveReader(covariance).get_matrix6()},
                       select->text(9),
                       select->real(10),
                       static_cast<int>(select->integer(5)),
                       static_cast<int>(select->integer(6))});
  }
}

Result<std::optional<RunStore::Checkpoint>> RunStore::checkpoint() {
  auto select = state_->db.prepare("SELECT samples_taken, stages FROM memory");
  if (!select) return failure(select);
  const auto row = select->step();
  if (!row) return failure(row);
  if (!*row) return std::nullopt;
  return Checkpoint{select->blob(1), select->integer(0)};
}

}  // namespace spartan
