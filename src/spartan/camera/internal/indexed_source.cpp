#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "spartan/camera/frame_source.h"
#include "spartan/camera/internal/increasing_stream.h"
#include "spartan/camera/internal/recording_index.h"
#include "spartan/image_io/image_io.h"

namespace spartan::internal {
namespace {

// A sensor stream with its next sample.
class SensorHead {
 public:
  explicit SensorHead(SampleStreamFactory open) : open_(std::move(open)) {}

  Status rewind() {
    auto stream = open_();
    if (!stream) return failure(stream);
    stream_.emplace(std::move(*stream));
    return advance();
  }
  Status advance() {
    auto sample = stream_->next();
    if (!sample) return failure(sample);
    head_ = std::move(*sample);
    return {};
  }
  const std::optional<Sample>& head() const { return head_; }
  std::int64_t discarded() const { return stream_ ? stream_->discarded() : 0; }

 private:
  SampleStreamFactory open_;
  std::optional<IncreasingStream> stream_;
  std::optional<Sample> head_;
};

MissingFrame missing(const FrameEntry& entry, FrameFault fault, std::string message) {
  return {entry.frame_id, entry.pair, entry.left_stamp, fault, std::move(message)};
}

class IndexedSource : public FrameSource {
 public:
  explicit IndexedSource(RecordingIndex index) : index_(std::move(index)) {
    if (index_.imu) sensors_.emplace_back(index_.imu);
    for (const SampleStreamFactory& open : index_.other_sensors) sensors_.emplace_back(open);
  }

  const RecordingInfo& info() const override { return index_.info; }

  Result<std::optional<Sample>> next() override {
    auto taken = take();
    if (!taken) return failure(taken);
    if (taken->sensor) return std::move(taken->sensor);
    if (!taken->entry) return std::nullopt;
    return load(*taken->entry);
  }

  Status seek(std::int64_t samples_taken) override {
    started_ = false;
    for (std::int64_t i = 0; i < samples_taken; ++i) {
      const auto taken = take();
      if (!taken) return failure(taken);
      if (!taken->sensor && !taken->entry) {
        return failure(ErrorCode::input,
                       fmt::format("the recording holds only {} samples, cannot seek to sample {}", i, samples_taken),
                       index_.info.path);
      }
    }
    return {};
  }

  Result<StereoFrame> frame_at(const std::string& pair, Stamp left_stamp) override {
    for (const FrameEntry& entry : index_.frames) {
      if (entry.pair != pair || entry.left_stamp != left_stamp || entry.fault == FrameFault::stamp_reversed) continue;
      Sample sample = load(entry);
      if (auto* frame = std::get_if<StereoFrame>(&sample)) return std::move(*frame);
      return failure(ErrorCode::input, std::get<MissingFrame>(sample).message);
    }
    return failure(ErrorCode::input,
                   fmt::format("has no frame of pair '{}' at {} s", pair, to_decimal_seconds(left_stamp)),
                   index_.info.path);
  }

  std::vector<Stamp> listed_stamps(const std::string& pair) const override {
    std::vector<Stamp> stamps;
    for (const FrameEntry& entry : index_.frames) {
      if (entry.pair == pair) stamps.push_back(entry.left_stamp);
    }
    return stamps;
  }

  std::vector<FrameKey> frames_at(std::int64_t position_id) const override {
    std::vector<FrameKey> names;
    for (const FrameEntry& entry : index_.frames) {
      if (entry.position_id == position_id && !entry.fault) names.push_back({entry.pair, entry.left_stamp});
    }
    return names;
  }

  Result<std::vector<ImuSample>> imu_samples(std::optional<Stamp> from, double seconds) override {
    std::vector<ImuSample> samples;
    if (!index_.imu) return samples;
    SensorHead imu(index_.imu);
    Status status = imu.rewind();
    while (status && imu.head()) {
      const auto& sample = std::get<ImuSample>(*imu.head());
      if (!from) from = sample.stamp;
      if (seconds_between(*from, sample.stamp) > seconds) break;
      if (sample.stamp >= *from) samples.push_back(sample);
      status = imu.advance();
    }
    if (!status) return failure(status);
    return samples;
  }

  std::int64_t sensor_samples_discarded() const override {
    std::int64_t sum = 0;
    for (const SensorHead& sensor : sensors_) sum += sensor.discarded();
    return sum;
  }

 private:
  // The next item: a sensor sample or a listed frame; neither at the end.
  struct Taken {
    std::optional<Sample> sensor;
    const FrameEntry* entry = nullptr;
  };

  // Advances to the next item without decoding an image.
  Result<Taken> take() {
    if (!started_) {
      next_frame_ = 0;
      for (SensorHead& sensor : sensors_) {
        if (Status status = sensor.rewind(); !status) return failure(status);
      }
      started_ = true;
    }
    SensorHead* first = nullptr;
    for (SensorHead& sensor : sensors_) {
      if (sensor.head() && (!first || stamp_of(*sensor.head()) < stamp_of(*first->head()))) first = &sensor;
    }
    const FrameEntry* entry = next_frame_ < index_.frames.size() ? &index_.frames[next_frame_] : nullptr;
    if (first && (!entry || stamp_of(*first->head()) <= entry->playback_stamp)) {
      Taken taken{*first->head(), nullptr};
      if (Status status = first->advance(); !status) return failure(status);
      return taken;
    }
    if (entry) ++next_frame_;
    return Taken{std::nullopt, entry};
  }

  Sample load(const FrameEntry& entry) const {
    if (entry.fault) return missing(entry, *entry.fault, entry.message);
    const StereoPair* pair = index_.info.rig.find_pair(entry.pair);
    const Camera* left_camera = index_.info.rig.find_camera(pair->left);
    const Camera* right_camera = index_.info.rig.find_camera(pair->right);
    auto left = load_image(entry, entry.left_file, *left_camera, FrameFault::left_missing);
    if (!left) return left.error();
    auto right = load_image(entry, entry.right_file, *right_camera, FrameFault::right_missing);
    if (!right) return right.error();
    return StereoFrame{entry.frame_id,    entry.position_id, entry.pair,        entry.left_stamp,
                       entry.right_stamp, std::move(*left),  std::move(*right), entry.pan_rad,
                       entry.tilt_rad,    entry.exposure_us, entry.gain};
  }

  static tl::expected<FrameImage, MissingFrame> load_image(const FrameEntry& entry, const std::string& file,
                                                           const Camera& camera, FrameFault when_missing) {
    auto image = read_image(file);
    if (!image) {
      std::error_code error;
      const bool there = std::filesystem::exists(file, error);
      return tl::unexpected(missing(entry, there ? FrameFault::unreadable : when_missing, image.error().message()));
    }
    if (image->size() != camera.size) {
      return tl::unexpected(
          missing(entry, FrameFault::wrong_size,
                  fmt::format("{}: the image is {}x{}, but camera '{}' in the rig is {}x{}", file, image->width(),
                              image->height(), camera.name, camera.size.width, camera.size.height)));
    }
    return interpret(*image, camera.pixel_format, entry.bits);
  }

  RecordingIndex index_;
  std::vector<SensorHead> sensors_;
  std::size_t next_frame_ = 0;
  bool started_ = false;
};

}  // namespace

std::unique_ptr<FrameSource> make_indexed_source(RecordingIndex index) {
  return std::make_unique<IndexedSource>(std::move(index));
}

}  // namespace spartan::internal
