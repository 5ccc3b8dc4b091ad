// Sensor stream filter that discards samples whose stamps do not increase.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "spartan/camera/internal/recording_index.h"

namespace spartan::internal {

/// Discards as few samples as possible within a sliding window so that stamps strictly increase (longest increasing
/// subsequence, see find_reversals()). An isolated stamp far in the future or in the past is discarded alone; it does
/// not invalidate the samples after it. The window holds `kLookAhead` samples, so an outlier burst must be shorter than
/// half of it.
class IncreasingStream : public SensorStream {
 public:
  explicit IncreasingStream(std::unique_ptr<SensorStream> rows) : rows_(std::move(rows)) {}

  /// An error of the input is returned after all valid samples before it.
  Result<std::optional<Sample>> next() override;

  DiscardedSamples discarded() const override {
    DiscardedSamples all = rows_->discarded();
    all.reversed += reversed_;
    return all;
  }

  static constexpr std::size_t kLookAhead = 64;  ///< samples; empirical

 private:
  void look_ahead();
  bool front_is_outlier() const;

  std::unique_ptr<SensorStream> rows_;
  std::deque<Sample> ahead_;
  std::optional<Stamp> last_;
  std::optional<Error> fault_;
  bool ended_ = false;
  std::int64_t reversed_ = 0;
};

}  // namespace spartan::internal
