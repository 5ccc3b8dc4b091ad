// Reading the records of a run store.
#include <string>
#include <utility>

#include "spartan/system/internal/run_store_state.h"

namespace spartan {

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
