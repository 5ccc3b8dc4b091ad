#include "spartan/camera/internal/cameras/camera_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace spartan::internal {
namespace {

using Clock = std::chrono::steady_clock;

// From the start of the threads to the first trigger.
constexpr std::chrono::milliseconds kFirstTrigger{50};
// A camera without an image for so long, while its partner has delivered more than so many, is silent.
constexpr std::chrono::milliseconds kAskToStop{100};
constexpr std::chrono::seconds kSilence{1};
constexpr int kAlone = 3;

bool has_driver(const Rig& rig, const std::string& camera) {
  return rig.find_camera(camera)->driver.has_value();
}

}  // namespace

CameraStream::CameraStream(const StreamInfo& info, const CameraStreamOptions& options, const Log& log)
    : info_(info), options_(options), log_(log), clock_(options.clock) {}

CameraStream::~CameraStream() {
  const std::lock_guard lock(mutex_);
  closing_ = true;
  changed_.notify_all();
}

Result<std::unique_ptr<CameraStream>> CameraStream::create(const StreamInfo& info, const OpenDevice& open,
                                                           const CameraStreamOptions& options, const Log& log) {
  std::unique_ptr<CameraStream> stream(new CameraStream(info, options, log));
  for (const StereoPair& pair : stream->info_.rig.pairs) {
    const bool left = has_driver(stream->info_.rig, pair.left), right = has_driver(stream->info_.rig, pair.right);
    if (left != right) {
      return failure(ErrorCode::configuration,
                     fmt::format("cameras.{}: has no driver, the other camera of pair {} has one",
                                 left ? pair.right : pair.left, pair.name),
                     info.rig_source);
    }
    if (!left) continue;
    if (Status opened = stream->open_pair(pair, open); !opened) return failure(opened);
  }
  if (stream->feeds_.empty()) {
    return failure(ErrorCode::configuration, "no camera has a driver", info.rig_source,
                   "add `driver: {source: aravis:ID}` to the cameras of a pair, see docs/reference/rig.md");
  }
  stream->start();
  if (Status waited = stream->wait_for_previews(); !waited) return failure(waited);
  return stream;
}

Status CameraStream::open_pair(const StereoPair& pair, const OpenDevice& open) {
  const Camera* const left = info_.rig.find_camera(pair.left);
  const Camera* const right = info_.rig.find_camera(pair.right);
  auto feed = std::make_unique<Feed>(options_);
  feed->pair = pair;
  feed->report.pair = pair.name;
  std::vector<DeviceRequest> requests;
  if (left->driver->source == right->driver->source) {
    requests = {{{left, right}}};
  } else {
    requests = {{{left}}, {{right}}};
  }
  for (DeviceRequest& request : requests) {
    auto source = ImageSource::create(std::move(request), open, clock_, log_,
                                      pair.for_odometry ? ImageSource::Opening::now : ImageSource::Opening::later);
    if (!source) return failure(source);
    feed->sources.push_back(std::move(*source));
  }
  feed->waits = feed->sources.front()->waits();
  feeds_.push_back(std::move(feed));
  return {};
}

void CameraStream::start() {
  const auto first_trigger = Clock::now() + kFirstTrigger;
  for (const auto& feed : feeds_) {
    for (std::size_t i = 0; i < feed->sources.size(); ++i) {
      const int first_side = static_cast<int>(i);
      feed->sources[i]->start(
          first_trigger,
          [this, f = feed.get(), first_side](int side, StampedImage image) {
            add(*f, first_side + side, std::move(image));
          },
          [this] {
            const std::lock_guard lock(mutex_);
            changed_.notify_all();
          });
    }
  }
}

void CameraStream::add(Feed& feed, int side, StampedImage image) {
  std::unique_lock lock(mutex_);
  if (feed.waits) {
    changed_.wait(lock, [&] { return has_room(feed, side) || closing_; });
  } else if (feed.pairing.waiting(side) >= kMostWaiting) {
    feed.pairing.drop_oldest(side);
    ++feed.report.not_taken;
  }
  feed.newest[side == 0 ? 0 : 1] = image.image.complete;
  feed.behind[side == 0 ? 0 : 1] = 0;
  ++feed.behind[side == 0 ? 1 : 0];
  feed.pairing.add(side, std::move(image));
  changed_.notify_all();
}

Status CameraStream::wait_for_previews() {
  const auto until = Clock::now() + options_.first_wait;
  for (const auto& feed : feeds_) {
    const CameraDriver& driver = feed->sources.front()->request().driver();
    if (driver.trigger == CameraDriver::kSoftware && !(driver.rate_hz > 0)) static_cast<void>(trigger(feed->pair.name));
  }
  std::map<std::string, Fault> faults;  // the last one of each pair
  std::unique_lock lock(mutex_);
  for (;;) {
    take_all(Clock::now());
    for (StreamRead& read : samples_) {
      auto* const frame = std::get_if<StereoFrame>(&*read.sample);
      if (frame != nullptr) previews_.try_emplace(frame->pair, *frame);
      const auto* const fault = std::get_if<MissingFrame>(&*read.sample);
      if (fault != nullptr) faults.insert_or_assign(fault->pair, Fault{fault->fault, fault->message, nullptr});
    }
    if (!waits()) samples_.clear();
    const auto lacks_preview = [&](const auto& feed) { return !previews_.contains(feed->pair.name); };
    auto missing = std::find_if(feeds_.begin(), feeds_.end(), lacks_preview);
    if (missing == feeds_.end()) return {};
    if (options_.should_stop && options_.should_stop())
      return failure(ErrorCode::interrupted, "the first frames were not waited for", info_.path);
    if (Clock::now() >= until || all_ended()) {
      missing = std::find_if(feeds_.begin(), feeds_.end(),
                             [&](const auto& feed) { return lacks_preview(feed) && feed->pair.for_odometry; });
      if (missing == feeds_.end()) return report_silent_pairs();
      const auto fault = faults.find((*missing)->pair.name);
      return no_preview(**missing, fault == faults.end() ? nullptr : &fault->second);
    }
    changed_.wait_until(lock, std::min(next_timeout(until), Clock::now() + kAskToStop));
  }
}

tl::unexpected<Error> CameraStream::no_preview(const Feed& feed, const Fault* fault) const {
  const CameraReport left = feed.sources.front()->camera_report(0),
                     right = feed.sources.back()->camera_report(feed.sources.size() == 1 ? 1 : 0);
  const bool has_wrong_size = fault != nullptr && fault->kind == FrameFault::wrong_size;
  return failure(ErrorCode::read_error,
                 fmt::format("pair {}: no frame within {:.0f} s ({} images by {}, {} by {}){}", feed.pair.name,
                             std::chrono::duration<double>(options_.first_wait).count(), left.images, feed.pair.left,
                             right.images, feed.pair.right, fault != nullptr ? ": " + fault->message : ""),
                 info_.path,
                 has_wrong_size ? "state the size of the images as size_px of the cameras in the rig, or let the "
                                  "driver ask for that size"
                                : "check that the cameras run and take their images together; --pair-tolerance allows "
                                  "larger differences of their times");
}

Status CameraStream::report_silent_pairs() const {
  for (const auto& feed : feeds_) {
    if (!previews_.contains(feed->pair.name))
      log_.error(fmt::format("pair {} delivers no frame; the run begins without it", feed->pair.name));
  }
  return {};
}

bool CameraStream::all_ended() const {
  return std::all_of(feeds_.begin(), feeds_.end(), [](const auto& feed) {
    return std::all_of(feed->sources.begin(), feed->sources.end(), [](const auto& source) { return source->ended(); });
  });
}

Result<StereoFrame> CameraStream::preview(const std::string& pair, std::size_t index) {
  const auto found = previews_.find(pair);
  if (found == previews_.end() || index > 0) return failure(ErrorCode::input, "no such frame", pair);
  return found->second;
}

Clock::time_point CameraStream::next_timeout(Clock::time_point latest) const {
  for (const auto& feed : feeds_) {
    const auto time = feed->waits ? std::nullopt : feed->pairing.next_timeout();
    if (time) latest = std::min(latest, *time);
  }
  return latest;
}

Result<StreamRead> CameraStream::read(std::chrono::nanoseconds timeout) {
  const auto until = Clock::now() + timeout;
  std::unique_lock lock(mutex_);
  if (!reading_) {
    // What cameras have taken meanwhile is old; of a file nothing is left out.
    if (!waits()) {
      take_all(Clock::now());
      samples_.clear();
      for (const auto& feed : feeds_) {
        feed->report = {};
        feed->report.pair = feed->pair.name;
        feed->skew_sum_ms = 0;
      }
    }
    reading_ = true;
  }
  for (;;) {
    const bool ended = all_ended();
    // Nothing can follow an image that waits for its partner.
    take_all(ended ? Clock::now() + options_.pair_wait : Clock::now());
    if (!samples_.empty()) {
      StreamRead read = std::move(samples_.front());
      samples_.pop_front();
      return read;
    }
    if (ended) return StreamRead{StreamRead::State::end, {}, Clock::now()};
    if (Clock::now() >= until) return StreamRead{StreamRead::State::none_yet, {}, Clock::now()};
    changed_.wait_until(lock, next_timeout(until));
  }
}

void CameraStream::take_all(Clock::time_point now) {
  const Clock::time_point never, at_once = now + options_.pair_wait;
  for (const auto& feed : feeds_) {
    const bool silent = is_one_camera_silent(*feed, now);
    const auto time_for_single_images = [&] {
      if (feed->waits) return lacks_partners(*feed) ? at_once : never;
      return silent ? at_once : now;
    };
    while (auto pair = feed->pairing.take(time_for_single_images())) take_pair(*feed, *pair);
  }
  changed_.notify_all();
}

// Of a file: one device delivers the images of both cameras, so it is read on where one of them has none yet.
bool CameraStream::has_room(const Feed& feed, int side) {
  const bool partner_follows = feed.sources.size() == 1 && feed.pairing.waiting(1 - side) == 0;
  return feed.pairing.waiting(side) < (partner_follows ? kMostAhead : kMostWaiting);
}

// Whether images of a file, all of one camera, need no longer wait for those of the other one. How long they have
// waited says nothing: the files are not read while the run is prepared.
bool CameraStream::lacks_partners(const Feed& feed) {
  const int side = feed.pairing.waiting(0) > 0 ? 0 : 1;
  const bool one_device = feed.sources.size() == 1;
  const ImageSource& other = *feed.sources[one_device || side == 1 ? 0 : 1];
  return other.ended() || other.is_lost() || (one_device && !has_room(feed, side));
}

// Whether one of the cameras no longer delivers, so that its images are not waited for. One that was lost is waited for
// from the first image of its partner after its return.
bool CameraStream::is_one_camera_silent(Feed& feed, Clock::time_point now) {
  const bool lost =
      std::any_of(feed.sources.begin(), feed.sources.end(), [](const auto& source) { return source->is_lost(); });
  if (lost) feed.behind = {};
  bool silent = lost;
  for (std::size_t side = 0; side < 2; ++side)
    silent = silent || (feed.behind[side] > kAlone && now - feed.newest[side] > kSilence);
  return silent;
}

bool CameraStream::waits() const {
  return std::all_of(feeds_.begin(), feeds_.end(), [](const auto& feed) {
    return std::all_of(feed->sources.begin(), feed->sources.end(), [](const auto& source) { return source->waits(); });
  });
}

void CameraStream::take_pair(Feed& feed, const ImagePair& pair) {
  Clock::time_point complete = pair.first().image.complete;
  if (pair.is_complete()) complete = std::max(complete, pair.images[1]->image.complete);
  push(sample_of(feed, pair), complete);
}

void CameraStream::push(Sample sample, Clock::time_point arrived) {
  samples_.push_back({StreamRead::State::sample, std::move(sample), arrived});
}

StereoFrame CameraStream::frame_of(const Feed& feed, const ImagePair& pair) const {
  StereoFrame frame;
  frame.pair = feed.pair.name;
  const Stamp stamp = pair.first().stamp;
  frame.left_stamp = pair.images[0] ? pair.images[0]->stamp : stamp;
  frame.right_stamp = pair.images[1] ? pair.images[1]->stamp : stamp;
  if (pair.images[0]) frame.left = pair.images[0]->image.image;
  if (pair.images[1]) frame.right = pair.images[1]->image.image;
  frame.exposure_us = pair.first().image.exposure_us;
  frame.gain = pair.first().image.gain;
  const std::string& mount = info_.rig.find_camera(feed.pair.left)->mount;
  for (const PanTiltUnit& unit : info_.rig.pan_tilt_units) {
    if (unit.name != mount) continue;
    frame.pan_rad = unit.rest_pan_rad;
    frame.tilt_rad = unit.rest_tilt_rad;
  }
  return frame;
}

Sample CameraStream::sample_of(Feed& feed, const ImagePair& pair) {
  StereoFrame frame = frame_of(feed, pair);
  frame.frame_id = next_frame_id_++;
  if (const auto fault = fault_of(feed, pair, frame)) {
    ++(feed.report.*fault->count);
    MissingFrame missing{frame.frame_id, frame.pair, frame.left_stamp, fault->kind, fault->message, {}};
    const bool one_image = frame.left.empty() != frame.right.empty();
    if (one_image && fault->kind != FrameFault::stamp_reversed) missing.partial = std::move(frame);
    return missing;
  }
  feed.last_stamp = frame.left_stamp;
  ++feed.report.pairs;
  const double skew_ms = seconds_between(frame.left_stamp, frame.right_stamp) * 1e3;
  feed.skew_sum_ms += skew_ms;
  if (std::abs(skew_ms) > std::abs(feed.report.largest_skew_ms)) feed.report.largest_skew_ms = skew_ms;
  return frame;
}

std::string CameraStream::why_missing(const Feed& feed, std::size_t side) const {
  const std::string& camera = side == 0 ? feed.pair.left : feed.pair.right;
  const ImageSource& source = *feed.sources[std::min(side, feed.sources.size() - 1)];
  return source.is_lost() ? fmt::format("camera {} does not answer", camera)
                          : fmt::format("camera {} delivered no image at the time of the other one", camera);
}

std::optional<CameraStream::Fault> CameraStream::fault_of(const Feed& feed, const ImagePair& pair,
                                                          const StereoFrame& frame) const {
  constexpr FrameFault kMissing[] = {FrameFault::left_missing, FrameFault::right_missing};
  constexpr std::int64_t CameraPairReport::*kOtherAlone[] = {&CameraPairReport::right_alone,
                                                             &CameraPairReport::left_alone};
  const std::string* const names[] = {&feed.pair.left, &feed.pair.right};
  for (std::size_t side = 0; side < 2; ++side) {
    if (!pair.images[side]) return Fault{kMissing[side], why_missing(feed, side), kOtherAlone[side]};
  }
  for (std::size_t side = 0; side < 2; ++side) {
    if (pair.images[side]->image.image.empty()) {
      return Fault{kMissing[side],
                   fmt::format("the image of camera {} is not complete: packets were lost", *names[side]),
                   &CameraPairReport::incomplete};
    }
  }
  for (std::size_t side = 0; side < 2; ++side) {
    const ImageSize size = info_.rig.find_camera(*names[side])->size, is = pair.images[side]->image.image.size();
    if (is != size) {
      return Fault{FrameFault::wrong_size,
                   fmt::format("camera {} delivers images of {} × {}, the rig has {} × {}", *names[side], is.width,
                               is.height, size.width, size.height),
                   &CameraPairReport::wrong_size};
    }
  }
  if (feed.pairing.is_apart(pair)) {
    const double apart_ms = 1e3 * std::abs(seconds_between(frame.left_stamp, frame.right_stamp));
    return Fault{FrameFault::stamps_apart,
                 fmt::format("the images of one trigger were taken {:.1f} ms apart", apart_ms),
                 &CameraPairReport::apart};
  }
  if (feed.last_stamp && frame.left_stamp <= *feed.last_stamp) {
    const double before_s = seconds_between(frame.left_stamp, *feed.last_stamp);
    return Fault{FrameFault::stamp_reversed,
                 fmt::format("its time is {:.6f} s before that of the frame before it", before_s),
                 &CameraPairReport::stamps_reversed};
  }
  return std::nullopt;
}

Result<CameraStream::Feed*> CameraStream::feed_of(const std::string& pair) {
  for (const auto& feed : feeds_) {
    if (feed->pair.name == pair) return feed.get();
  }
  return failure(ErrorCode::configuration, "has no cameras that run now", pair);
}

CameraControl* CameraStream::control() {
  const bool any = std::any_of(feeds_.begin(), feeds_.end(), [](const auto& feed) {
    return std::any_of(feed->sources.begin(), feed->sources.end(),
                       [](const auto& source) { return source->has_controls(); });
  });
  return any ? this : nullptr;
}

Status CameraStream::trigger(const std::string& pair) {
  const auto feed = feed_of(pair);
  if (!feed) return failure(feed);
  std::int64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = next_trigger_++;
  }
  Status all;
  for (const auto& source : (*feed)->sources) {
    if (Status triggered = source->trigger(number); !triggered) all = triggered;
  }
  return all;
}

Status CameraStream::set_exposure(const std::string& pair, const ExposureSettings& settings) {
  const auto feed = feed_of(pair);
  if (!feed) return failure(feed);
  Status all;
  for (const auto& source : (*feed)->sources) {
    if (Status set = source->set_exposure(settings); !set) all = set;
  }
  return all;
}

ExposureBounds CameraStream::exposure_bounds(const std::string& pair) const {
  ExposureBounds bounds;
  for (const auto& feed : feeds_) {
    if (feed->pair.name != pair) continue;
    for (const auto& source : feed->sources) bounds = limit(bounds, source->exposure_bounds());
  }
  return bounds;
}

std::vector<CameraPairReport> CameraStream::camera_reports() const {
  const std::lock_guard lock(mutex_);
  std::vector<CameraPairReport> reports;
  for (const auto& feed : feeds_) {
    CameraPairReport report = feed->report;
    if (report.pairs > 0) report.mean_skew_ms = feed->skew_sum_ms / static_cast<double>(report.pairs);
    for (const auto& source : feed->sources) {
      for (std::size_t side = 0; side < source->request().cameras.size(); ++side)
        report.cameras.push_back(source->camera_report(side));
    }
    reports.push_back(std::move(report));
  }
  return reports;
}

}  // namespace spartan::internal
