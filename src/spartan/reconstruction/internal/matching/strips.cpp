#include "spartan/reconstruction/internal/matching/strips.h"

namespace spartan::internal::matching {

int strip_rows(int height, std::int64_t costs_per_row) {
  constexpr int kRows = 128;
  constexpr std::int64_t kCosts = 16'000'000;
  const auto wanted =
      static_cast<int>(std::clamp<std::int64_t>(kCosts / std::max<std::int64_t>(1, costs_per_row), 64, kRows));
  const int strips = 2 * std::max(1, (height + wanted) / (2 * wanted));
  const int rows = (height + strips - 1) / strips;
  return std::max(64, (rows + kTile - 1) / kTile * kTile);
}

void for_each_strip(int height, int rows_per_strip, const ThreadPool& workers, std::vector<StripBuffers>& buffers,
                    const std::function<void(const StripRows&, StripBuffers&)>& match) {
  const int count = (height + rows_per_strip - 1) / rows_per_strip, threads = std::min(count, workers.threads());
  if (static_cast<int>(buffers.size()) < threads) buffers.resize(static_cast<std::size_t>(threads));
  workers.parallel_for_parts(count, [&](int i, int worker) {
    const int from = i * rows_per_strip, to = std::min(height, from + rows_per_strip);
    match({from, to, std::max(0, from - kStripMargin), std::min(height, to + kStripMargin)},
          buffers[static_cast<std::size_t>(worker)]);
  });
}

std::size_t StripBuffers::bytes() const {
  return static_cast<std::size_t>(costs.stride()) + 2 * static_cast<std::size_t>(sums.stride()) + paths.size() +
         minima.size() + p2.size() + slots.size() +
         2 * (unused_sums.size() + winners.size() + right_best.size() + starts.size()) +
         runs.size() * sizeof(ColumnRun);
}

}  // namespace spartan::internal::matching
