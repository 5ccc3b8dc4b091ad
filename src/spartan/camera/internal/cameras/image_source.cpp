#include "spartan/camera/internal/cameras/image_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace spartan::internal {
namespace {

using Clock = std::chrono::steady_clock;

// A frame id that is lower by more, or higher by more, is that of a camera which counts from a new start.
constexpr std::int64_t kMostLeftOut = 1000;

// Of a stamp that follows from the arrival alone.
constexpr double kArrivalSigma_s = 5e-3;

std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(std::llround(seconds * 1e9));
}

}  // namespace

std::string DeviceRequest::names() const {
  std::string text;
  for (const Camera* camera : cameras) text += (text.empty() ? "" : ", ") + camera->name;
  return text;
}

ImageSource::ImageSource(DeviceRequest request, OpenDevice open, const HostClock& clock, const Log& log)
    : request_(std::move(request)), open_(std::move(open)), host_(clock), log_(log) {
  for (std::size_t side = 0; side < request_.cameras.size(); ++side)
    reports_[side].camera = request_.cameras[side]->name;
}

Result<std::unique_ptr<ImageSource>> ImageSource::create(DeviceRequest request, OpenDevice open, const HostClock& clock,
                                                         const Log& log, Opening opening) {
  std::unique_ptr<ImageSource> source(new ImageSource(std::move(request), std::move(open), clock, log));
  auto device = source->open_(source->request_);
  if (device) {
    source->use(std::move(*device));
  } else if (opening == Opening::now) {
    return failure(device);
  } else {
    log.error(device.error().message() + "; trying again");
  }
  return source;
}

void ImageSource::use(std::unique_ptr<CameraDevice> device) {
  const std::lock_guard lock(mutex_);
  device_ = std::move(device);
  has_controls_ = device_->has_controls();
  waits_ = device_->waits();
  exposure_bounds_ = device_->exposure_bounds();
  pending_exposure_ = exposure_;
  stop_changed_.notify_all();
}

ImageSource::~ImageSource() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stop_changed_.notify_all();
  if (command_thread_.joinable()) command_thread_.join();
  if (thread_.joinable()) thread_.join();
}

void ImageSource::start(Clock::time_point first_trigger, Deliver deliver, std::function<void()> changed) {
  deliver_ = std::move(deliver);
  changed_ = std::move(changed);
  thread_ = std::thread([this] { run(); });
  command_thread_ = std::thread([this, first_trigger] { run_commands(first_trigger); });
}

bool ImageSource::wait(Clock::time_point until) {
  std::unique_lock lock(mutex_);
  stop_changed_.wait_until(lock, until, [this] { return stop_; });
  return !stop_;
}

std::shared_ptr<CameraDevice> ImageSource::device() const {
  const std::lock_guard lock(mutex_);
  return device_;
}

bool ImageSource::is_lost() const {
  return device() == nullptr;
}

CameraReport ImageSource::camera_report(std::size_t side) const {
  const std::lock_guard lock(mutex_);
  return reports_[side];
}

ExposureBounds ImageSource::exposure_bounds() const {
  const std::lock_guard lock(mutex_);
  return exposure_bounds_;
}

Status ImageSource::command(const std::function<void()>& note) {
  const std::lock_guard lock(mutex_);
  if (!has_controls_) return failure(ErrorCode::configuration, "cannot be controlled", request_.names());
  note();
  stop_changed_.notify_all();
  return device_ ? Status() : failure(ErrorCode::read_error, "does not answer", request_.names());
}

Status ImageSource::trigger(std::int64_t number) {
  return command([&] {
    if (device_) pending_triggers_.push_back(number);
  });
}

Status ImageSource::set_exposure(const ExposureSettings& settings) {
  return command([&] { exposure_ = pending_exposure_ = settings; });
}

// A camera that no longer answers holds up its commands for seconds, so they have a thread.
void ImageSource::run_commands(Clock::time_point first_trigger) {
  const CameraDriver& driver = request_.driver();
  const bool by_rate = driver.trigger == CameraDriver::kSoftware && driver.rate_hz > 0;
  const auto period = std::chrono::nanoseconds(by_rate ? nanoseconds(1 / driver.rate_hz) : 0);
  Clock::time_point next = by_rate ? first_trigger : Clock::time_point::max();
  std::int64_t number = 0;
  for (;;) {
    std::optional<ExposureSettings> exposure;
    std::deque<std::int64_t> triggers;
    {
      std::unique_lock lock(mutex_);
      const auto wanted = [this] { return stop_ || pending_exposure_ || !pending_triggers_.empty(); };
      if (by_rate) {
        stop_changed_.wait_until(lock, next, wanted);
      } else {
        stop_changed_.wait(lock, wanted);
      }
      if (stop_) return;
      std::swap(exposure, pending_exposure_);
      std::swap(triggers, pending_triggers_);
    }
    if (by_rate && Clock::now() >= next) {
      // After a pause of the process: no burst of triggers for the times that have passed.
      for (; next <= Clock::now(); next += period) ++number;
      triggers.push_back(number);
    }
    const auto device = this->device();
    if (!device || !has_controls_) continue;
    if (exposure) report(device->set_exposure(*exposure));
    for (const std::int64_t trigger : triggers) report(send_trigger(*device, trigger));
  }
}

// Once for errors in a row.
void ImageSource::report(const Status& status) {
  if (!status && !refused_) log_.warning(status.error().message());
  refused_ = !status;
}

Status ImageSource::send_trigger(CameraDevice& device, std::int64_t number) {
  const Stamp now = host_.now();
  {
    // Before the trigger, so that an image which comes at once finds it.
    const std::lock_guard lock(mutex_);
    open_triggers_.push_back({number, now});
    ++reports_[0].triggers;
  }
  Status triggered = device.trigger();
  if (triggered) return {};
  const std::lock_guard lock(mutex_);
  const auto open = std::find_if(open_triggers_.begin(), open_triggers_.end(),
                                 [&](const Trigger& trigger) { return trigger.number == number; });
  if (open != open_triggers_.end()) {
    open_triggers_.erase(open);
    ++reports_[0].unanswered;
  }
  return triggered;
}

// The image belongs to the trigger that is nearest to its stamp, of those before its arrival; earlier ones have none.
// The number of the trigger; −1: none.
std::int64_t ImageSource::answer_trigger(CameraReport& report, Stamp stamp, Stamp arrival) {
  const auto end = std::find_if(open_triggers_.begin(), open_triggers_.end(),
                                [&](const Trigger& trigger) { return trigger.time > arrival; });
  const auto answered = std::min_element(open_triggers_.begin(), end, [&](const Trigger& a, const Trigger& b) {
    return std::abs(seconds_between(stamp, a.time)) < std::abs(seconds_between(stamp, b.time));
  });
  if (answered == end) {
    report.untriggered += request_.driver().trigger == CameraDriver::kSoftware;
    return -1;
  }
  const std::int64_t number = answered->number;
  report.unanswered += answered - open_triggers_.begin();
  open_triggers_.erase(open_triggers_.begin(), answered + 1);
  return number;
}

void ImageSource::give_up_triggers() {
  const std::lock_guard lock(mutex_);
  while (!open_triggers_.empty() && seconds_between(open_triggers_.front().time, host_.now()) > kAnswer_s) {
    open_triggers_.pop_front();
    ++reports_[0].unanswered;
  }
}

void ImageSource::run() {
  while (wait(Clock::now())) {
    give_up_triggers();
    const auto device = this->device();
    if (!device) {
      reopen();
      continue;
    }
    DeviceRead read = device->read(kPoll);
    if (read.state == DeviceRead::State::image) {
      deliver(std::move(read.image));
    } else if (read.state == DeviceRead::State::end) {
      break;
    } else if (read.state == DeviceRead::State::lost) {
      log_.error(
          fmt::format("camera {} ({}): {}; trying again", request_.names(), request_.driver().source, read.reason));
      const std::lock_guard lock(mutex_);
      device_ = nullptr;
      ++reports_[0].losses;
    }
  }
  ended_ = true;
  changed_();
}

void ImageSource::reopen() {
  if (!wait(Clock::now() + kRetry)) return;
  auto device = open_(request_);
  if (!device) {
    log_.debug(device.error().message());
    return;
  }
  log_.warning(fmt::format("camera {} ({}) answers again", request_.names(), request_.driver().source));
  last_ = {};
  clocks_ = {};
  mapped_ = {};
  use(std::move(*device));
}

void ImageSource::deliver(CameraImage image) {
  const int side = image.side == 0 ? 0 : 1;
  if (!is_new(image)) return;
  StampedImage stamped = this->stamped(std::move(image));
  {
    const std::lock_guard lock(mutex_);
    CameraReport& report = reports_[static_cast<std::size_t>(side)];
    ++(stamped.image.image.empty() ? report.incomplete : report.images);
    stamped.trigger = answer_trigger(report, stamped.stamp, host_.stamp_of(stamped.image.complete));
    if (!stamped.trusted) ++report.wrong_stamps;
    report.clock_sigma_ms = 1e3 * stamped.sigma_s;
    report.clock_rate_ppm = 1e6 * (clocks_[static_cast<std::size_t>(side)].rate() - 1);
  }
  deliver_(side, std::move(stamped));
}

// Counts what the camera has left out; false of an image that came before.
bool ImageSource::is_new(const CameraImage& image) {
  const std::size_t side = image.side == 0 ? 0 : 1;
  Last& last = last_[side];
  const std::lock_guard lock(mutex_);
  CameraReport& report = reports_[side];
  if (image.frame_id >= 0 && last.frame_id >= 0) {
    const std::int64_t step = image.frame_id - last.frame_id;
    if (step == 0) {
      ++report.duplicates;
      return false;
    }
    if (step < 0 && step > -kMostLeftOut) {
      ++report.reversed;
      return false;
    }
    if (step > 1 && step <= kMostLeftOut) report.not_received += step - 1;
  } else if (image.camera_ns >= 0 && image.camera_ns == last.camera_ns) {
    ++report.duplicates;
    return false;
  }
  last = {image.frame_id, image.camera_ns};
  return true;
}

// An earlier arrival than all before moves the line back, at first by more than an interval between images: at least
// half of the camera's interval remains between two stamps.
void ImageSource::keep_increasing(StampedImage& stamped, const CameraImage& image) {
  std::optional<Mapped>& last = mapped_[image.side == 0 ? 0 : 1];
  if (stamped.trusted && last && image.camera_ns > last->camera_ns) {
    const Stamp least{last->stamp.ns + (image.camera_ns - last->camera_ns) / 2};
    if (stamped.stamp < least) {
      stamped.sigma_s = std::hypot(stamped.sigma_s, seconds_between(stamped.stamp, least));
      stamped.stamp = least;
    }
  }
  if (stamped.trusted) last = Mapped{image.camera_ns, stamped.stamp};
}

// The middle of the exposure: of a stamp at its begin, half an exposure later; an image is noticed after its end.
StampedImage ImageSource::stamped(CameraImage image) {
  const CameraDriver& driver = request_.driver();
  const double exposure_s = image.exposure_us * 1e-6;
  const double after_middle_s = driver.stamp_at == StampAt::exposure_start ? -exposure_s / 2
                                : driver.stamp_at == StampAt::exposure_end ? exposure_s / 2
                                                                           : 0;
  const Stamp end{host_.stamp_of(image.began).ns - nanoseconds(driver.latency_ms * 1e-3)};
  StampedImage stamped;
  if (image.camera_ns >= 0) {
    // What the clock maps is the moment of the stamp, which is `after_middle_s − exposure_s / 2` before the end.
    const Stamp moment{end.ns + nanoseconds(after_middle_s - exposure_s / 2)};
    const MappedStamp mapped = clocks_[image.side == 0 ? 0 : 1].add(image.camera_ns, moment);
    stamped.stamp = Stamp{mapped.host.ns - nanoseconds(after_middle_s)};
    stamped.trusted = mapped.trusted;
    stamped.sigma_s = mapped.sigma_s;
    keep_increasing(stamped, image);
  } else {
    stamped.stamp = Stamp{end.ns - nanoseconds(exposure_s / 2)};
    stamped.sigma_s = kArrivalSigma_s;
  }
  stamped.image = std::move(image);
  return stamped;
}

}  // namespace spartan::internal
