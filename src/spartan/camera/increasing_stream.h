// The rows of a sensor table whose stamps increase.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "spartan/camera/recording_index.h"

namespace spartan {

/// Leaves out the rows that stand against most of those around them: one stamp far ahead costs itself and not all that
/// follow it, one that runs back costs itself too. It looks `kLookAhead` rows ahead, so a jump must be over before half
/// of that.
class IncreasingStream : public SampleStream {
 public:
  explicit IncreasingStream(std::unique_ptr<SampleStream> rows) : rows_(std::move(rows)) {}

  /// A fault comes behind the last row before it.
  Result<std::optional<Sample>> next() override;

  std::int64_t left_out() const { return left_out_; }

  static constexpr std::size_t kLookAhead = 64;

 private:
  void look_ahead();
  bool front_stands_against_the_rest() const;

  std::unique_ptr<SampleStream> rows_;
  std::deque<Sample> ahead_;
  std::optional<Stamp> last_;
  std::optional<Error> fault_;
  bool ended_ = false;
  std::int64_t left_out_ = 0;
};

}  // namespace spartan
