#include "spartan/camera/internal/replay_stream.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <thread>
#include <utility>
#include <variant>

#include "spartan/core/stage_clock.h"

namespace spartan::internal {
namespace {

using std::chrono::nanoseconds;

// From the last sample of a pass to the first one of the next where the recording tells no interval.
constexpr double kPause_s = 0.1;

// Of the thread that decodes, to that of the process.
constexpr int kNiceness = 19;

bool is_image(const Sample& sample) {
  return std::holds_alternative<StereoFrame>(sample) || std::holds_alternative<MissingFrame>(sample);
}

nanoseconds scaled(double seconds, double speed) {
  return nanoseconds(static_cast<std::int64_t>(seconds / speed * 1e9));
}

}  // namespace

ReplayClock ReplayClock::real() {
  return {[] { return std::chrono::steady_clock::now(); }, [](Time time) { std::this_thread::sleep_until(time); }};
}

ReplayStream::ReplayStream(std::unique_ptr<Recording> recording, double speed, int passes, ReplayClock clock)
    : recording_(std::move(recording)),
      info_(recording_->info()),
      speed_(speed),
      passes_left_(passes),
      clock_(std::move(clock)) {
  if (!(speed > 0) || passes < 1) throw std::invalid_argument("ReplayStream: speed and passes must be positive");
  info_.path = "replay:" + info_.path;
}

ReplayStream::~ReplayStream() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

ReplayClock::Time ReplayStream::due(Stamp stamp) const {
  return *start_ + scaled(seconds_between(*start_stamp_, stamp), speed_);
}

Result<StreamRead> ReplayStream::read(nanoseconds timeout) {
  const ReplayClock::Time called = clock_.now();
  std::unique_lock lock(mutex_);
  if (!thread_.joinable()) thread_ = std::thread([this] { read_ahead(); });
  if (!changed_.wait_for(lock, timeout, [this] { return !ahead_.empty() || ended_; })) {
    lock.unlock();
    clock_.wait_until(called + timeout);
    return StreamRead{StreamRead::State::none_yet, {}, clock_.now()};
  }
  if (ahead_.empty() && !status_) return failure(status_);
  if (ahead_.empty()) return StreamRead{StreamRead::State::end, {}, clock_.now()};
  const Stamp stamp = stamp_of(ahead_.front());
  if (!start_) {
    start_ = clock_.now();
    start_stamp_ = stamp;
  }
  const ReplayClock::Time when = due(stamp), now = clock_.now();
  if (when > now && when > called + timeout) {
    lock.unlock();
    clock_.wait_until(called + timeout);
    return StreamRead{StreamRead::State::none_yet, {}, clock_.now()};
  }
  Sample sample = std::move(ahead_.front());
  ahead_.pop_front();
  if (is_image(sample)) --frames_ahead_;
  lock.unlock();
  changed_.notify_all();
  if (when > now) clock_.wait_until(when);
  return StreamRead{StreamRead::State::sample, std::move(sample), std::max(when, now)};
}

DiscardedSamples ReplayStream::discarded() const {
  const std::lock_guard lock(mutex_);
  return discarded_;
}

void ReplayStream::read_ahead() {
  const auto thread = static_cast<id_t>(::gettid());
  static_cast<void>(::setpriority(PRIO_PROCESS, thread, ::getpriority(PRIO_PROCESS, thread) + kNiceness));
  for (;;) {
    Result<std::optional<Sample>> sample;
    try {
      sample = fetch();
    } catch (const std::bad_alloc& exception) {
      sample = tl::unexpected(out_of_memory(exception));
    }
    std::unique_lock lock(mutex_);
    discarded_ = recording_->discarded();
    if (sample && *sample) {
      frames_ahead_ += is_image(**sample) ? 1 : 0;
      ahead_.push_back(std::move(**sample));
    } else {
      ended_ = true;
      if (!sample) status_ = failure(sample);
    }
    changed_.notify_all();
    changed_.wait(lock, [this] { return stopped_ || ended_ || has_room(); });
    if (stopped_ || ended_) return;
  }
}

// The next sample after `start_after_`; none at the end.
Result<std::optional<Sample>> ReplayStream::fetch() {
  for (;;) {
    auto sample = fetch_any();
    if (!sample || !*sample || !start_after_ || stamp_of(**sample) > *start_after_) return sample;
    const std::lock_guard lock(mutex_);
    if (stopped_) return std::nullopt;
  }
}

// The next sample, shifted; none at the end.
Result<std::optional<Sample>> ReplayStream::fetch_any() {
  auto sample = recording_->next();
  if (!sample) return sample;
  if (!*sample && passes_left_ > 1 && first_stamp_) {
    --passes_left_;
    if (Status again = recording_->seek(0); !again) return failure(again);
    const double step_s = recording_->info().sequence.median_step_s;
    const Stamp begin{last_.stamp.ns + Stamp::from_seconds(step_s > 0 ? step_s : kPause_s).ns};
    offset_ = last_;
    offset_.stamp = Stamp{begin.ns - first_stamp_->ns};
    offset_.frame_id = last_.frame_id + 1;
    offset_.position_id = last_.position_id + 1;
    if (first_wheels_) {
      offset_.left_m -= first_wheels_->left_m;
      offset_.right_m -= first_wheels_->right_m;
    }
    sample = recording_->next();
    if (!sample) return sample;
  }
  if (!*sample) return std::nullopt;
  if (!first_stamp_) first_stamp_ = stamp_of(**sample);
  const auto* const wheels = std::get_if<WheelSample>(&**sample);
  if (wheels != nullptr && !first_wheels_) first_wheels_ = *wheels;
  shift(**sample);
  note(**sample);
  return sample;
}

void ReplayStream::shift(Sample& sample) const {
  move_stamps(sample, offset_.stamp.ns);
  const auto number = [&](StereoFrame& frame) {
    frame.frame_id += offset_.frame_id;
    if (frame.position_id >= 0) frame.position_id += offset_.position_id;
  };
  if (auto* frame = std::get_if<StereoFrame>(&sample)) number(*frame);
  if (auto* missing = std::get_if<MissingFrame>(&sample)) {
    missing->frame_id += offset_.frame_id;
    if (missing->partial) number(*missing->partial);
  }
  if (auto* wheels = std::get_if<WheelSample>(&sample)) {
    wheels->left_m += offset_.left_m;
    wheels->right_m += offset_.right_m;
  }
}

void ReplayStream::note(const Sample& sample) {
  last_.stamp = std::max(last_.stamp, stamp_of(sample));
  if (const auto* frame = std::get_if<StereoFrame>(&sample)) {
    last_.frame_id = std::max(last_.frame_id, frame->frame_id);
    last_.position_id = std::max(last_.position_id, frame->position_id);
  }
  if (const auto* missing = std::get_if<MissingFrame>(&sample))
    last_.frame_id = std::max(last_.frame_id, missing->frame_id);
  if (const auto* wheels = std::get_if<WheelSample>(&sample)) {
    last_.left_m = wheels->left_m;
    last_.right_m = wheels->right_m;
  }
}

}  // namespace spartan::internal
