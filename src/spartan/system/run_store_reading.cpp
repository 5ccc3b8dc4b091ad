// Reading the records of a run store.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "spartan/system/internal/run_store_state.h"

namespace spartan {

namespace {

// A query over a table whose first column is a frame's `seq`, read in parallel with the frames (merge join): its rows
// are in the order of the frames, so each row is read once, for any number of frames.
class RowsOfFrames {
 public:
  /// `sql`: of the rows whose `seq` is above its parameter.
  static Result<RowsOfFrames> open(Database& db, const std::string& sql, std::int64_t after) {
    auto select = db.prepare(sql);
    if (!select) return failure(select);
    select->bind(1, after);
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

tl::unexpected<Error> damaged_table(const Database& db, const char* table, const char* what) {
  return failure(ErrorCode::store_damaged, std::string("is damaged: table '") + table + "': " + what, db.path(),
                 "run again into a new folder");
}

/// Tables that older versions of the program did not write.
Result<bool> has_table(Database& db, const char* name) {
  auto select = db.prepare("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?");
  if (!select) return failure(select);
  select->bind(1, std::string(name));
  const auto row = select->step();
  if (!row) return failure(row);
  return select->integer(0) > 0;
}

bool is_pose(const Pose& pose) {
  return pose.translation().allFinite() && std::abs(pose.rotation().norm() - 1) < 1e-6;
}

constexpr const char* kNoPose = "a pose is incomplete or not finite";
constexpr const char* kDamagedRow = "a pose is incomplete, a number is not finite, or a state is unknown";

// The names of SensorState.
bool is_sensor_state(std::string_view name) {
  return name == "ok" || name == "suspect" || name == "excluded" || name == "missing";
}

// A pose and, in the column behind it, its covariance; none if they are incomplete or the pose is not finite.
std::optional<UncertainPose> uncertain_pose_of(const SqlStatement& row, int column) {
  const Bytes pose = row.blob(column), covariance = row.blob(column + 1);
  ArchiveReader pose_in(pose), covariance_in(covariance);
  const UncertainPose read{pose_in.get_pose(), covariance_in.get_matrix6()};
  if (!pose_in.finish("") || !covariance_in.finish("")) return std::nullopt;
  return is_pose(read.pose) ? std::optional(read) : std::nullopt;
}

std::optional<LocalizationRecord> localization_of(const SqlStatement& row) {
  const auto world = uncertain_pose_of(row, 1), odom = uncertain_pose_of(row, 3);
  if (!world || !odom) return std::nullopt;
  LocalizationRecord l;
  l.world_from_body = *world;
  l.odom_from_body = *odom;
  if (!row.is_null(5)) l.slip = row.real(5);
  if (!row.is_null(6)) l.slip_sigma = row.real(6);
  return l;
}

bool add_innovation(const SqlStatement& row, FrameRecord& frame) {
  const InnovationTest test{Stamp{row.integer(2)}, row.real(3), row.real(4)};
  if (!std::isfinite(test.nis) || !std::isfinite(test.gate) || test.nis < 0 || !(test.gate > 0)) return false;
  if (!frame.localization) return true;
  for (LocalizationRecord::Sensor& sensor : frame.localization->sensors) {
    if (sensor.name == row.text(1)) sensor.test = test;
  }
  return true;
}

// What other tables contain about a frame: `add` reads a row, and returns false where it is damaged.
struct FrameTable {
  const char* name;
  const char* columns;
  bool has_key;   ///< `seq` is its key: at most one row per frame
  bool optional;  ///< older versions of the program did not write it
  bool (*add)(const SqlStatement& row, FrameRecord& frame);

  /// Of the rows after a frame. Without the key they are found from the end of the table, which reads only them.
  std::string select() const {
    if (has_key) return fmt::format("SELECT {} FROM {} WHERE seq > ?1 ORDER BY seq", columns, name);
    return fmt::format(
        "SELECT {0} FROM {1} WHERE rowid > coalesce((SELECT rowid FROM {1} WHERE ?1 > 0 AND seq <= ?1 "
        "ORDER BY rowid DESC LIMIT 1), 0) ORDER BY rowid",
        columns, name);
  }
};

// Each after those that it builds on. Tables with several rows per frame are written in its transaction, so their rows
// are in the order of the frames.
constexpr FrameTable kFrameTables[] = {
    {"stage_times", "seq, stage, wall_ms, cpu_ms", false, false,
     [](const SqlStatement& row, FrameRecord& frame) {
       frame.times.push_back({row.text(1), row.real(2), row.real(3)});
       return true;
     }},
    {"latencies", "seq, wall_ms", true, true,
     [](const SqlStatement& row, FrameRecord& frame) {
       frame.latency_ms = row.real(1);
       return std::isfinite(*frame.latency_ms) && *frame.latency_ms >= 0;
     }},
    {"slam", "*", true, false,
     [](const SqlStatement& row, FrameRecord& frame) {
       frame.slam = uncertain_pose_of(row, 1);
       return frame.slam.has_value();
     }},
    {"smoothed", "*", true, true,
     [](const SqlStatement& row, FrameRecord& frame) {
       frame.smoothed = uncertain_pose_of(row, 1);
       return frame.smoothed.has_value();
     }},
    {"localization", "*", true, false,
     [](const SqlStatement& row, FrameRecord& frame) {
       frame.localization = localization_of(row);
       return frame.localization.has_value();
     }},
    {"health", "seq, sensor, state, reason", false, false,
     [](const SqlStatement& row, FrameRecord& frame) {
       if (frame.localization) frame.localization->sensors.push_back({row.text(1), row.text(2), row.text(3)});
       return is_sensor_state(row.text(2));
     }},
    {"innovations", "seq, sensor, stamp_ns, nis, gate", false, true, add_innovation},
};

// None if a pose or a covariance is incomplete, a pose is not finite, or a stamp is out of range.
std::optional<FrameRecord> frame_of(const SqlStatement& row) {
  constexpr std::int64_t kLatest_ns = std::numeric_limits<std::int64_t>::max() / 2;  // differences of stamps fit
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
  const Bytes covariance = row.blob(15);
  ArchiveReader covariance_in(covariance);
  r.world_from_body.covariance = covariance_in.get_matrix6();
  const auto motion = uncertain_pose_of(row, 18);
  if (!motion || !covariance_in.finish("") || !is_pose(r.world_from_body.pose)) return std::nullopt;
  r.motion.from.ns = row.integer(16);
  for (const std::int64_t ns : {r.stamp.ns, r.motion.from.ns}) {
    if (ns > kLatest_ns || ns < -kLatest_ns) return std::nullopt;
  }
  r.motion.to = r.stamp;
  r.motion.first = row.integer(17) != 0;
  r.motion.previous_from_current = motion->pose;
  r.motion.covariance = motion->covariance;
  r.motion.landmarks = static_cast<int>(row.integer(20));
  r.motion.matches = static_cast<int>(row.integer(21));
  r.motion.inliers = static_cast<int>(row.integer(22));
  r.motion.rms_px = row.real(23);
  return r;
}

// Rows "<stamp_ns> <name>". None where one is not.
std::optional<std::map<std::string, Stamp>> last_stamps_of(const std::string& text) {
  std::map<std::string, Stamp> stamps;
  std::istringstream rows(text);
  for (std::string row; std::getline(rows, row);) {
    Stamp stamp;
    const auto [end, error] = std::from_chars(row.data(), row.data() + row.size(), stamp.ns);
    if (error != std::errc() || *end != ' ' || end + 1 == row.data() + row.size()) return std::nullopt;
    stamps[std::string(end + 1)] = stamp;
  }
  return stamps;
}

}  // namespace

Result<std::vector<Bytes>> RunStore::localization_inputs() {
  Database& db = state_->db;
  const auto there = has_table(db, "localization_inputs");
  if (!there) return failure(there);
  if (!*there) return std::vector<Bytes>{};
  auto select = db.prepare("SELECT inputs FROM localization_inputs ORDER BY rowid");
  if (!select) return failure(select);
  std::vector<Bytes> all;
  for (;;) {
    const auto row = select->step();
    if (!row) return failure(row);
    if (!*row) return all;
    Bytes& inputs = all.emplace_back(select->blob(0));
    if (!remove_checksum(inputs)) return damaged_table(db, "localization_inputs", "a checksum does not fit");
  }
}

void append_checksum(Bytes& bytes) {
  Hash64 hash;
  hash.add(bytes.data(), bytes.size());
  ArchiveWriter out;
  out.put(hash.value());
  const Bytes checksum = out.take();
  bytes.insert(bytes.end(), checksum.begin(), checksum.end());
}

bool remove_checksum(Bytes& bytes) {
  if (bytes.size() < sizeof(std::uint64_t)) return false;
  Bytes before(bytes.begin(), bytes.end() - sizeof(std::uint64_t));
  Bytes expected = before;
  append_checksum(expected);
  if (expected != bytes) return false;
  bytes = std::move(before);
  return true;
}

TileStore& RunStore::tiles() {
  return *state_->tiles;
}

Result<std::vector<FrameRecord>> RunStore::frames() {
  std::vector<FrameRecord> records;
  const Status status = read_frames(0, [&](FrameRecord&& record) { records.push_back(std::move(record)); });
  if (!status) return failure(status);
  return records;
}

Status RunStore::read_frames(std::int64_t from, const std::function<void(FrameRecord&&)>& take) {
  Database& db = state_->db;
  auto select = db.prepare("SELECT * FROM frames WHERE seq > ?1 ORDER BY seq");
  if (!select) return failure(select);
  select->bind(1, from);
  std::vector<std::pair<const FrameTable*, RowsOfFrames>> tables;
  for (const FrameTable& table : kFrameTables) {
    const auto there = table.optional ? has_table(db, table.name) : true;
    if (!there) return failure(there);
    if (!*there) continue;
    auto rows = RowsOfFrames::open(db, table.select(), from);
    if (!rows) return failure(rows);
    tables.emplace_back(&table, std::move(*rows));
  }
  for (;;) {
    const auto row = select->step();
    if (!row) return failure(row);
    if (!*row) return {};
    auto record = frame_of(*select);
    if (!record) return damaged_table(db, "frames", kNoPose);
    for (auto& [table, rows] : tables) {
      bool whole = true;
      const Status read = rows.of(select->integer(0),
                                  [&](const SqlStatement& detail) { whole = table->add(detail, *record) && whole; });
      if (!read) return failure(read);
      if (!whole) return damaged_table(db, table->name, kDamagedRow);
    }
    take(std::move(*record));
  }
}

Result<std::vector<TerrainRecord>> RunStore::terrain(std::int64_t from) {
  std::vector<TerrainRecord> records;
  const std::string sql = fmt::format("SELECT * FROM terrain ORDER BY stamp_ns LIMIT -1 OFFSET {}", from);
  const Status status = for_each_row(state_->db, sql, [&](const SqlStatement& row) {
    records.push_back({Stamp{row.integer(0)}, row.text(1), row.real(2), row.integer(3)});
    return Status();
  });
  if (!status) return failure(status);
  return records;
}

Result<std::vector<MapRecord>> RunStore::maps(std::int64_t from) {
  std::vector<MapRecord> records;
  const std::string sql = fmt::format("SELECT * FROM maps ORDER BY stamp_ns LIMIT -1 OFFSET {}", from);
  const Status status = for_each_row(state_->db, sql, [&](const SqlStatement& row) -> Status {
    const auto prior = uncertain_pose_of(row, 7), corrected = uncertain_pose_of(row, 3);
    if (!prior || !corrected) return damaged_table(state_->db, "maps", kNoPose);
    records.push_back({Stamp{row.integer(0)}, row.integer(1), static_cast<int>(row.integer(2)), *prior, *corrected,
                       row.text(9), row.real(10), static_cast<int>(row.integer(5)), static_cast<int>(row.integer(6))});
    return {};
  });
  if (!status) return failure(status);
  return records;
}

Result<std::optional<RunStore::Checkpoint>> RunStore::checkpoint() {
  auto select = state_->db.prepare(
      "SELECT samples_taken, stages, (SELECT value FROM identity WHERE key = 'content'), wall_ms, cpu_ms, "
      "coalesce((SELECT value FROM identity WHERE key = 'stream'), '') "
      "FROM memory LEFT JOIN elapsed USING (id)");
  if (!select) return failure(select);
  const auto row = select->step();
  if (!row) return failure(row);
  if (!*row) return std::nullopt;
  Checkpoint checkpoint{select->blob(1), {select->integer(0), 0}, {1e-3 * select->real(3), 1e-3 * select->real(4)}};
  if (!remove_checksum(checkpoint.pipeline_state)) return damaged_table(state_->db, "memory", "the checksum differs");
  const std::string hash = select->text(2);
  const auto [end, error] = std::from_chars(hash.data(), hash.data() + hash.size(), checkpoint.source.content_hash, 16);
  if (error != std::errc() || end != hash.data() + hash.size())
    return damaged_table(state_->db, "identity", "'content' is missing or not a number");
  auto stamps = last_stamps_of(select->text(5));
  if (!stamps) return damaged_table(state_->db, "identity", "'stream' has a row that is not a stamp and a name");
  checkpoint.source.last_stamps = std::move(*stamps);
  return checkpoint;
}

}  // namespace spartan
