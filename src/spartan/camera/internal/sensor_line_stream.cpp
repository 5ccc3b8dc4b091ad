#include "spartan/camera/internal/sensor_line_stream.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace spartan::internal {

Result<std::unique_ptr<SampleStream>> SensorLineStream::open(std::unique_ptr<SampleStream> cameras,
                                                             const std::string& fifo) {
  auto opened = Fifo::open(fifo);
  if (!opened) return failure(opened);
  return std::unique_ptr<SampleStream>(new SensorLineStream(std::move(cameras), std::move(*opened), fifo));
}

SensorLineStream::SensorLineStream(std::unique_ptr<SampleStream> cameras, Fifo fifo, const std::string& name)
    : StreamDecorator(*cameras),
      cameras_(std::move(cameras)),
      fifo_(std::move(fifo)),
      lines_(name, info().rig.imu.body_from_imu.rotation()) {}

void SensorLineStream::receive() {
  std::array<char, 4096> bytes{};
  if (const std::size_t n = fifo_.read(bytes); n > 0) lines_.add({bytes.data(), n}, clock_.now());
}

Result<StreamRead> SensorLineStream::read(std::chrono::nanoseconds timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  std::chrono::nanoseconds wait{0};  // none before the lines that are there were read
  for (;;) {
    if (auto sample = lines_.take())
      return StreamRead{StreamRead::State::sample, std::move(sample), std::chrono::steady_clock::now()};
    // New lines are taken after the cameras were asked, so that neither has to wait for a rest of the other.
    auto read = behind().read(wait);
    receive();
    if (!read || read->state != StreamRead::State::none_yet) return read;
    const auto left = until - std::chrono::steady_clock::now();
    if (wait.count() > 0 && left.count() <= 0) return read;
    wait = std::clamp<std::chrono::nanoseconds>(left, std::chrono::nanoseconds(1), kPoll);
  }
}

}  // namespace spartan::internal
