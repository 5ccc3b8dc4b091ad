#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "spartan/camera/increasing_stream.h"
#include "spartan/camera/interpretation.h"
#include "spartan/camera/recording_index.h"
#include "spartan/core/image_io.h"

namespace spartan {
namespace {

// One sensor with the sample that it would hand out next.
class SensorHead {
 public:
  explicit SensorHead(OpenStream open) : open_(std::move(open)) {}

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
  std::int64_t left_out() const { return stream_ ? stream_->left_out() : 0; }

 private:
  OpenStream open_;
  std::optional<IncreasingStream> stream_;
  std::optional<Sample> head_;
};

MissingFrame missing(const Shot& shot, FrameFault fault, std::string message) {
  return {shot.frame_id, shot.pair, shot.left_stamp, fault, std::move(message)};
}

class IndexedSource : public FrameSource {
 public:
  explicit IndexedSource(RecordingIndex index) : index_(std::move(index)) {
    if (index_.imu) sensors_.emplace_back(index_.imu);
    for (const OpenStream& open : index_.other_sensors) sensors_.emplace_back(open);
  }

  const RecordingInfo& info() const override { return index_.info; }

  Result<std::optional<Sample>> next() override {
    auto taken = take();
    if (!taken) return failure(taken);
    if (taken->sensor) return std::move(taken->sensor);
    if (!taken->shot) return std::nullopt;
    return load(*taken->shot);
  }

  Status seek(std::int64_t samples_taken) override {
    started_ = false;
    for (std::int64_t i = 0; i < samples_taken; ++i) {
      const auto taken = take();
      if (!taken) return failure(taken);
      if (!taken->sensor && !taken->shot) {
        return failure(ErrorCode::input, fmt::format("holds {} samples, not {}", i, samples_taken), index_.info.path);
      }
    }
    return {};
  }

  Result<StereoFrame> frame_at(const std::string& pair, Stamp left_stamp) override {
    for (const Shot& shot : index_.shots) {
      if (shot.pair != pair || shot.left_stamp != left_stamp || shot.fault == FrameFault::stamp_reversed) continue;
      Sample sample = load(shot);
      if (auto* frame = std::get_if<StereoFrame>(&sample)) return std::move(*frame);
      return failure(ErrorCode::input, std::get<MissingFrame>(sample).message);
    }
    return failure(ErrorCode::input,
                   fmt::format("has no shot of pair '{}' at {} s", pair, to_decimal_seconds(left_stamp)),
                   index_.info.path);
  }

  std::vector<Stamp> announced_stamps(const std::string& pair) const override {
    std::vector<Stamp> stamps;
    for (const Shot& shot : index_.shots) {
      if (shot.pair == pair) stamps.push_back(shot.left_stamp);
    }
    return stamps;
  }

  std::vector<ShotName> shots_at(std::int64_t position_id) const override {
    std::vector<ShotName> names;
    for (const Shot& shot : index_.shots) {
      if (shot.position_id == position_id && !shot.fault) names.push_back({shot.pair, shot.left_stamp});
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

  std::int64_t sensor_samples_left_out() const override {
    std::int64_t sum = 0;
    for (const SensorHead& sensor : sensors_) sum += sensor.left_out();
    return sum;
  }

 private:
  // Neither: the end.
  struct Taken {
    std::optional<Sample> sensor;
    const Shot* shot = nullptr;
  };

  // Takes what comes next and decodes nothing.
  Result<Taken> take() {
    if (!started_) {
      next_shot_ = 0;
      for (SensorHead& sensor : sensors_) {
        if (Status status = sensor.rewind(); !status) return failure(status);
      }
      started_ = true;
    }
    SensorHead* first = nullptr;
    for (SensorHead& sensor : sensors_) {
      if (sensor.head() && (!first || stamp_of(*sensor.head()) < stamp_of(*first->head()))) first = &sensor;
    }
    const Shot* shot = next_shot_ < index_.shots.size() ? &index_.shots[next_shot_] : nullptr;
    if (first && (!shot || stamp_of(*first->head()) <= shot->played_at)) {
      Taken taken{*first->head(), nullptr};
      if (Status status = first->advance(); !status) return failure(status);
      return taken;
    }
    if (shot) ++next_shot_;
    return Taken{std::nullopt, shot};
  }

  Sample load(const Shot& shot) const {
    if (shot.fault) return missing(shot, *shot.fault, shot.message);
    const StereoPair* pair = index_.info.rig.find_pair(shot.pair);
    const Camera* left_camera = index_.info.rig.find_camera(pair->left);
    const Camera* right_camera = index_.info.rig.find_camera(pair->right);
    auto left = load_eye(shot, shot.left_file, *left_camera, FrameFault::left_missing);
    if (!left) return left.error();
    auto right = load_eye(shot, shot.right_file, *right_camera, FrameFault::right_missing);
    if (!right) return right.error();
    return StereoFrame{shot.frame_id,    shot.position_id, shot.pair,         shot.left_stamp,
                       shot.right_stamp, std::move(*left), std::move(*right), shot.pan_rad,
                       shot.tilt_rad,    shot.exposure_us, shot.gain};
  }

  static tl::expected<FrameImage, MissingFrame> load_eye(const Shot& shot, const std::string& file,
                                                         const Camera& camera, FrameFault when_missing) {
    auto image = read_image(file);
    if (!image) {
      std::error_code error;
      const bool there = std::filesystem::exists(file, error);
      return tl::unexpected(missing(shot, there ? FrameFault::unreadable : when_missing, image.error().message()));
    }
    if (image->size() != camera.size) {
      return tl::unexpected(missing(shot, FrameFault::wrong_size,
                                    fmt::format("{}: is {}x{}, camera '{}' takes {}x{}", file, image->width(),
                                                image->height(), camera.name, camera.size.width, camera.size.height)));
    }
    return interpret(*image, camera.pixel_format, shot.bits);
  }

  RecordingIndex index_;
  std::vector<SensorHead> sensors_;
  std::size_t next_shot_ = 0;
  bool started_ = false;
};

}  // namespace

std::unique_ptr<FrameSource> make_indexed_source(RecordingIndex index) {
  return std::make_unique<IndexedSource>(std::move(index));
}

}  // namespace spartan
