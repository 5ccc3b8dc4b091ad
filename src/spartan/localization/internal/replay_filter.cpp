#include "spartan/localization/internal/replay_filter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "spartan/localization/internal/measurement_archive.h"

namespace spartan::internal {
namespace {

/// Snapshots are taken where time crosses a multiple of this, so that they depend on the samples only, not on the order
/// of their arrival.
constexpr std::int64_t kCell_ns = 500'000'000;
/// A stamp may be ahead of all others by this, or by the length of the buffer if that is longer.
constexpr double kMinLead_s = 5;

std::int64_t cell_of(Stamp stamp) {
  return stamp.ns >= 0 ? stamp.ns / kCell_ns : -((-stamp.ns + kCell_ns - 1) / kCell_ns);
}

double age(const Measurement& m, Stamp newest) {
  return seconds_between(stamp_of_measurement(m), newest);
}

}  // namespace

ReplayFilter::ReplayFilter(const LocalizationOptions& options) : options_(options), order_(options), filter_(options) {}

void ReplayFilter::start(Stamp stamp, const Eigen::Vector3d& ahead_in_body,
                         const std::optional<Eigen::Vector3d>& up_in_body, const Eigen::Vector3d& assumed_up_in_body) {
  if (started()) throw std::logic_error("Localizer::start: called twice");
  std::erase_if(entries_, [&](const Measurement& m) { return std::abs(age(m, stamp)) > kBeforeStart_s; });
  const auto later = std::stable_partition(entries_.begin(), entries_.end(),
                                           [&](const Measurement& m) { return stamp_of_measurement(m) <= stamp; });
  filter_.start(stamp, ahead_in_body, std::span(entries_.data(), static_cast<std::size_t>(later - entries_.begin())),
                up_in_body, assumed_up_in_body);
  entries_.erase(entries_.begin(), later);
  start_ = newest_ = stamp;
  for (const Measurement& m : entries_) newest_ = std::max(newest_, stamp_of_measurement(m));
  snapshots_ = {{0, filter_.memory()}};
  run();
}

bool ReplayFilter::reaches(Stamp stamp) const {
  return started() && stamp >= start_ && seconds_between(stamp, newest_) <= options_.buffer_s;
}

std::optional<Refusal> ReplayFilter::add(const Measurement& m) {
  return started() ? add_started(m) : add_before_start(m);
}

/// No frame defines the time yet: an isolated stamp far from all others is refused, a second one near it is accepted
/// and replaces the earlier samples.
std::optional<Refusal> ReplayFilter::add_before_start(const Measurement& m) {
  const Stamp stamp = stamp_of_measurement(m);
  const bool isolated = !entries_.empty() && std::abs(age(m, newest_)) > kBeforeStart_s;
  if (isolated) {
    const bool first = !isolated_ || std::abs(age(m, *isolated_)) > kBeforeStart_s;
    isolated_ = stamp;
    if (first) return stamp > newest_ ? Refusal::too_early : Refusal::too_late;
    entries_.clear();
  }
  isolated_.reset();
  if (!place(m)) return Refusal::duplicate;
  newest_ = {};
  for (const Measurement& e : entries_) newest_ = std::max(newest_, stamp_of_measurement(e));
  std::erase_if(entries_, [&](const Measurement& e) { return age(e, newest_) > kBeforeStart_s; });
  return std::nullopt;
}

std::optional<Refusal> ReplayFilter::add_started(const Measurement& m) {
  const Stamp stamp = stamp_of_measurement(m);
  undo_leap(stamp);
  if (!reaches(stamp)) {
    const auto* constraint = std::get_if<PoseConstraint>(&m);
    if (constraint == nullptr || stamp != filter_.memory().vision.clone_stamp) return Refusal::too_late;
    // At the far end of the buffer: a late frame still comes after it.
    const auto buffer_ns = static_cast<std::int64_t>(options_.buffer_s * 1e9);
    return insert(LateConstraint{{newest_.ns - buffer_ns}, *constraint});
  }
  // It would make all other samples too late. Only vision, the required sensor, may advance the time that far.
  if (seconds_between(newest_, stamp) > lead_s() && !std::holds_alternative<RelativeMotion>(m))
    return Refusal::too_early;
  return insert(m);
}

double ReplayFilter::lead_s() const {
  return std::max(options_.buffer_s, kMinLead_s);
}

/// A frame far ahead was a wrong stamp if the next sample is from before: it is removed.
void ReplayFilter::undo_leap(Stamp arrived) {
  if (!before_leap_) return;
  const Stamp before = *before_leap_;
  before_leap_.reset();
  if (seconds_between(before, arrived) > lead_s()) return;
  entries_.pop_back();
  newest_ = before;
  ++undone_leaps_;
  replay_from(std::min(processed_, entries_.size()));
}

std::optional<std::size_t> ReplayFilter::place(const Measurement& m) {
  const auto at =
      std::lower_bound(entries_.begin(), entries_.end(), m,
                       [this](const Measurement& a, const Measurement& b) { return order_.precedes(a, b); });
  if (at != entries_.end() && !order_.precedes(m, *at)) return std::nullopt;
  const auto index = static_cast<std::size_t>(at - entries_.begin());  // insert() invalidates the iterator
  entries_.insert(at, m);
  return index;
}

std::optional<Refusal> ReplayFilter::insert(const Measurement& m) {
  const auto at = place(m);
  if (!at) return Refusal::duplicate;
  if (seconds_between(newest_, stamp_of_measurement(m)) > lead_s()) before_leap_ = newest_;
  newest_ = std::max(newest_, stamp_of_measurement(m));
  if (*at < processed_) {
    replay_from(*at);
  } else {
    run();
  }
  discard_old();
  return std::nullopt;
}

bool ReplayFilter::opens_cell(std::size_t entry) const {
  if (entry == 0) return false;
  return cell_of(order_.turn_of(entries_[entry])) != cell_of(order_.turn_of(entries_[entry - 1]));
}

std::optional<ErrorStateFilter> ReplayFilter::at(Stamp stamp) const {
  if (!started() || stamp < snapshots_.front().memory.stamp) return std::nullopt;
  ErrorStateFilter filter = filter_;
  std::size_t first = processed_;
  if (stamp < filter_.memory().stamp) {
    const auto later = std::partition_point(snapshots_.begin() + 1, snapshots_.end(),
                                            [&](const Snapshot& s) { return s.memory.stamp <= stamp; });
    const Snapshot& from = *(later - 1);
    filter.set_memory(from.memory);
    first = from.count;
  }
  for (std::size_t i = first; i < entries_.size() && order_.turn_of(entries_[i]) <= stamp; ++i)
    filter.process(entries_[i]);
  filter.predict_to(stamp);
  return filter;
}

void ReplayFilter::replay_from(std::size_t entry) {
  while (snapshots_.size() > 1 && snapshots_.back().count >= entry) snapshots_.pop_back();
  filter_.set_memory(snapshots_.back().memory);
  processed_ = snapshots_.back().count;
  if (snapshots_.size() > 1) snapshots_.pop_back();  // run() takes it again
  run();
}

/// Processes what no sample of the IMU with a newer stamp will precede.
void ReplayFilter::run() {
  const Stamp until{newest_.ns - order_.lead_ns()};
  for (; processed_ < entries_.size() && order_.turn_of(entries_[processed_]) <= until; ++processed_) {
    if (opens_cell(processed_)) snapshots_.push_back({processed_, filter_.memory()});
    filter_.process(entries_[processed_]);
  }
}

ErrorStateFilter ReplayFilter::newest() const {
  ErrorStateFilter filter = filter_;
  if (!started()) return filter;
  for (std::size_t i = processed_; i < entries_.size(); ++i) filter.process(entries_[i]);
  filter.predict_to(newest_);
  return filter;
}

/// Discards snapshots and entries that are older than any sample that is still accepted.
void ReplayFilter::discard_old() {
  if (before_leap_) return;  // they are needed if it is undone
  std::size_t first = 0;
  while (first + 1 < snapshots_.size() &&
         seconds_between(snapshots_[first + 1].memory.stamp, newest_) > options_.buffer_s)
    ++first;
  if (first == 0) return;
  const std::size_t gone = snapshots_[first].count;
  processed_ -= gone;
  entries_.erase(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(gone));
  snapshots_.erase(snapshots_.begin(), snapshots_.begin() + static_cast<std::ptrdiff_t>(first));
  for (Snapshot& snapshot : snapshots_) snapshot.count -= gone;
}

void ReplayFilter::put(ArchiveWriter& out) const {
  out.put(started());
  out.put(isolated_.has_value());
  out.put(isolated_.value_or(Stamp()).ns);
  out.put(before_leap_.has_value());
  out.put(before_leap_.value_or(Stamp()).ns);
  out.put(undone_leaps_);
  out.put(start_.ns);
  out.put(newest_.ns);
  internal::put(out, started() ? snapshots_.front().memory : FilterMemory{});
  out.put(static_cast<std::uint64_t>(entries_.size()));
  for (const Measurement& m : entries_) put_measurement(out, m);
}

bool ReplayFilter::get(ArchiveReader& in) {
  const bool has_started = in.get<bool>();
  const bool has_isolated = in.get<bool>();
  isolated_ = in.get_stamp();
  if (!has_isolated) isolated_.reset();
  const bool has_leap = in.get<bool>();
  before_leap_ = in.get_stamp();
  if (!has_leap) before_leap_.reset();
  undone_leaps_ = in.get<std::int64_t>();
  start_ = in.get_stamp();
  newest_ = in.get_stamp();
  const std::optional<FilterMemory> memory = get_filter_memory(in);
  if (!memory) return false;
  const auto count = in.get<std::uint64_t>();
  entries_.clear();
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto m = get_measurement(in);
    if (!m || !is_valid(*m)) return false;
    if (!entries_.empty() && !order_.precedes(entries_.back(), *m)) return false;
    entries_.push_back(*m);
  }
  if (!in.ok()) return false;
  filter_.set_memory(*memory);
  snapshots_.clear();
  if (!has_started || !memory->started) return has_started == memory->started;
  snapshots_ = {{0, *memory}};
  processed_ = 0;
  run();
  return true;
}

}  // namespace spartan::internal
