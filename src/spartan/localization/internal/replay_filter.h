// A filter that accepts samples in any order within a bounded time: a late sample is inserted at its stamp, and all
// later ones are replayed.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "spartan/core/archive.h"
#include "spartan/core/result.h"
#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/processing_order.h"

namespace spartan::internal {

class ReplayFilter {
 public:
  explicit ReplayFilter(const LocalizationOptions& options);

  /// Samples up to `stamp` that were added before initialize the world; later ones are processed at once. Throws
  /// std::logic_error if already started.
  void start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, const std::optional<Eigen::Vector3d>& up_in_body = {},
             const Eigen::Vector3d& assumed_up_in_body = Eigen::Vector3d::UnitZ());
  bool started() const { return filter_.memory().started; }

  /// Returns nothing if the measurement was accepted, else the reason. Whatever the order of arrival, the state is bit
  /// for bit that of the accepted measurements in the order of comes_before(), where those of the IMU come earlier by
  /// InertialOptions::max_time_error_s. A constraint on the pose at the last
  /// frame is never too late: if that frame is older than the buffer, the constraint is applied at the far end of the
  /// buffer.
  std::optional<Refusal> add(const Measurement& measurement);

  /// Frames that were accepted and then removed, because their stamps were far ahead of all later samples.
  std::int64_t undone_leaps() const { return undone_leaps_; }

  /// Whether a sample with that stamp would not be too late; false before the start.
  bool reaches(Stamp stamp) const;

  /// The filter at the newest sample.
  ErrorStateFilter newest() const;
  /// The filter at a time of the buffer, as if later samples had not come (but for the IMU, whose clock may be off); at
  /// a later time, its prediction. Nothing
  /// before the buffer or before the start.
  std::optional<ErrorStateFilter> at(Stamp stamp) const;

  void put(ArchiveWriter& out) const;
  /// Returns false if the bytes are damaged.
  bool get(ArchiveReader& in);

 private:
  /// The memory before entry `count`; the first snapshot is the oldest that is kept.
  struct Snapshot {
    std::size_t count = 0;
    FilterMemory memory;
  };

  std::optional<Refusal> add_before_start(const Measurement& measurement);
  std::optional<Refusal> add_started(const Measurement& measurement);
  /// Inserts into the entries without processing; returns the index, or nothing for a duplicate.
  std::optional<std::size_t> place(const Measurement& measurement);
  std::optional<Refusal> insert(const Measurement& measurement);
  void undo_leap(Stamp arrived);
  double lead_s() const;
  bool opens_cell(std::size_t entry) const;
  void replay_from(std::size_t entry);
  void run();
  void discard_old();

  LocalizationOptions options_;
  ProcessingOrder order_;
  ErrorStateFilter filter_;
  std::vector<Measurement> entries_;  ///< in the order of order_
  std::size_t processed_ = 0;         ///< entries that the filter has processed; those after are newer than its lead
  std::vector<Snapshot> snapshots_;
  Stamp start_, newest_;
  std::optional<Stamp> isolated_;  ///< stamp of the sample before if it was refused as far from all others
  /// Newest stamp before a frame that is far ahead of it, until another sample confirms that time.
  std::optional<Stamp> before_leap_;
  std::int64_t undone_leaps_ = 0;
};

}  // namespace spartan::internal
