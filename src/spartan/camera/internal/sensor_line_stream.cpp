#include "spartan/camera/internal/sensor_line_stream.h"

#include <algorithm>
#include <array>
#include <utility>

namespace spartan::internal {
namespace {

constexpr std::chrono::milliseconds kEndPoll{50};  // the thread looks so often whether it should end

Stamp system_now() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return Stamp{std::chrono::duration_cast<std::chrono::nanoseconds>(since).count()};
}

}  // namespace

Result<std::unique_ptr<SensorLineReader>> SensorLineReader::open(const std::string& fifo,
                                                                 const Eigen::Quaterniond& body_from_imu,
                                                                 const HostClock& clock) {
  auto opened = Fifo::open(fifo);
  if (!opened) return failure(opened);
  return std::unique_ptr<SensorLineReader>(
      new SensorLineReader(std::move(*opened), SensorLines(fifo, body_from_imu), clock));
}

SensorLineReader::SensorLineReader(Fifo fifo, SensorLines lines, const HostClock& clock)
    : fifo_(std::move(fifo)), clock_(clock), lines_(std::move(lines)), thread_([this] { run(); }) {}

SensorLineReader::~SensorLineReader() {
  ended_ = true;
  thread_.join();
}

void SensorLineReader::run() {
  std::array<char, 4096> bytes{};
  while (!ended_) {
    const std::size_t n = fifo_.read(bytes, kEndPoll);
    if (n == 0) continue;
    const std::lock_guard lock(mutex_);
    lines_.add({bytes.data(), n}, {clock_.now(), system_now()});
  }
}

std::optional<Sample> SensorLineReader::take() {
  const std::lock_guard lock(mutex_);
  return lines_.take();
}

DiscardedSamples SensorLineReader::discarded() const {
  const std::lock_guard lock(mutex_);
  return lines_.discarded();
}

Result<StreamRead> SensorLineStream::read(std::chrono::nanoseconds timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  std::chrono::nanoseconds wait{0};  // none before the lines that are there were taken
  for (;;) {
    // Where both have something they take turns.
    if (!std::exchange(cameras_turn_, false)) {
      if (auto sample = lines_->take()) {
        cameras_turn_ = true;
        return StreamRead{StreamRead::State::sample, std::move(sample), std::chrono::steady_clock::now()};
      }
    }
    auto read = behind().read(wait);
    if (!read || read->state != StreamRead::State::none_yet) return read;
    const auto left = until - std::chrono::steady_clock::now();
    if (wait.count() > 0 && left.count() <= 0) return read;
    wait = std::clamp<std::chrono::nanoseconds>(left, std::chrono::nanoseconds(1), kPoll);
  }
}

}  // namespace spartan::internal
