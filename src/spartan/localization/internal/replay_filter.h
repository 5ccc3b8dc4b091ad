// A filter that takes samples in any order within a bounded time: late ones are put in their place, and what came after
// them is taken again.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "spartan/core/archive.h"
#include "spartan/core/result.h"
#include "spartan/localization/internal/error_state_filter.h"

namespace spartan {

class ReplayFilter {
 public:
  explicit ReplayFilter(const LocalizationOptions& options);

  /// Samples up to `stamp` that were added before lay the world; later ones follow at once. Throws where it has
  /// started.
  void start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, const std::optional<Eigen::Vector3d>& up_in_body = {});
  bool started() const { return filter_.memory().started; }

  /// Nothing where the measurement was taken; else why it was not. Whatever the order of arrival, the state is the
  /// same, bit for bit, as after all that were taken in the order of comes_before(). A constraint on the pose at the
  /// last shot is never too late: where that shot is older than the buffer, the constraint is taken at the buffer's far
  /// end, as that is when it comes.
  std::optional<Refusal> add(const Measurement& measurement);

  /// Whether a sample of that moment would not be too late; only once started.
  bool reaches(Stamp stamp) const;

  const ErrorStateFilter& filter() const { return filter_; }

  void put(ArchiveWriter& out) const;
  /// False where the bytes make no sense.
  bool get(ArchiveReader& in);

 private:
  /// The state before entry `count`; the first one is the oldest that is kept.
  struct Snapshot {
    std::size_t count = 0;
    FilterMemory memory;
  };

  std::optional<Refusal> add_before_start(const Measurement& measurement);
  std::optional<Refusal> add_started(const Measurement& measurement);
  /// Into the entries, and no more: where it stands, or nothing where it is there already.
  std::optional<std::size_t> place(const Measurement& measurement);
  std::optional<Refusal> take(const Measurement& measurement);
  bool opens_cell(std::size_t entry) const;
  void replay_from(std::size_t entry);
  void run_from(std::size_t entry);
  void forget_old();

  LocalizationOptions options_;
  ErrorStateFilter filter_;
  std::vector<Measurement> entries_;  ///< in order; before the start: all that came
  std::vector<Snapshot> snapshots_;
  Stamp start_, newest_;
  std::optional<Stamp> odd_;  ///< of the sample before, where that was refused for being far from all others
};

}  // namespace spartan
