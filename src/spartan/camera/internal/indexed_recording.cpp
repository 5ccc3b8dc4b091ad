#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <functional>
#include <string_view>
#include <variant>
#include <vector>

#include "spartan/camera/internal/content_hash.h"
#include "spartan/camera/internal/increasing_stream.h"
#include "spartan/camera/internal/recording_index.h"
#include "spartan/camera/recording.h"
#include "spartan/core/archive.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

// A sensor stream with its next sample.
class SensorHead {
 public:
  explicit SensorHead(SensorStreamFactory open) : open_(std::move(open)) {}

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
  DiscardedSamples discarded() const { return stream_ ? stream_->discarded() : DiscardedSamples{}; }

 private:
  SensorStreamFactory open_;
  std::optional<IncreasingStream> stream_;
  std::optional<Sample> head_;
};

MissingFrame missing(const FrameEntry& entry, FrameFault fault, std::string message) {
  return {entry.frame_id, entry.pair, entry.left_stamp, fault, std::move(message), {}};
}

// The bytes of the image files of a frame, or why a file has none (code `input`: missing, not a regular file); of a
// video, the images.
struct FrameFiles {
  Result<std::string> left, right;
  std::optional<Result<StereoVideo::Images>> video;
};

// Codes `read_error` and `resources`: the files may be good, but cannot be read now.
Result<FrameFiles> read_files(const FrameEntry& entry, StereoVideo* video) {
  FrameFiles files;
  // A frame whose stamps are wrong is never delivered.
  if (entry.fault == FrameFault::stamp_reversed || entry.fault == FrameFault::stamps_apart) return files;
  if (video != nullptr) {
    files.video = video->read(entry.video_frame);
    if (!*files.video && files.video->error().code != ErrorCode::input) return failure(*files.video);
    return files;
  }
  files.left = read_file(entry.left_file);
  files.right = read_file(entry.right_file);
  for (const Result<std::string>& content : {std::cref(files.left), std::cref(files.right)}) {
    if (!content && content.error().code != ErrorCode::input) return failure(content);
  }
  return files;
}

std::string_view row_of(const FrameImage& image, int y) {
  const ImageView<const std::uint8_t> view = image.as<std::uint8_t>();
  return {reinterpret_cast<const char*>(&view(0, y)), static_cast<std::size_t>(view.width())};
}

void add(ContentHash& hash, const FrameFiles& files) {
  if (files.video) {
    if (!*files.video) return;
    for (const FrameImage* image : {&(*files.video)->left, &(*files.video)->right}) {
      for (int y = 0; y < image->height(); ++y) hash.add(row_of(*image, y));
    }
    return;
  }
  hash.add(std::string_view(files.left ? *files.left : ""));
  hash.add(std::string_view(files.right ? *files.right : ""));
}

Status add_content(Hash64& hash, const std::string& path) {
  auto file = InputFile::open(path);
  if (!file) return failure(file);
  std::vector<char> block(std::size_t{64} << 10U);
  for (;;) {
    const auto count = file->read(block);
    if (!count) return failure(count);
    if (*count == 0) return {};
    hash.add(block.data(), *count);
  }
}

class IndexedRecording : public Recording {
 public:
  explicit IndexedRecording(RecordingIndex index) : index_(std::move(index)) {
    if (index_.imu) sensors_.emplace_back(index_.imu);
    for (const SensorStreamFactory& open : index_.other_sensors) sensors_.emplace_back(open);
  }

  const RecordingInfo& info() const override { return index_.info; }

  Result<std::optional<Sample>> next() override {
    auto taken = take();
    if (!taken) return failure(taken);
    if (taken->sensor) return std::move(taken->sensor);
    if (!taken->entry) return std::nullopt;
    const auto files = read_files(*taken->entry, index_.video.get());
    auto sample = files ? decode(*taken->entry, *files) : Result<Sample>(failure(files));
    if (!sample) {
      --next_frame_;
      return failure(sample);
    }
    add(content_hash_, *files);
    return std::move(*sample);
  }

  Result<std::optional<SampleKey>> peek() override {
    const auto following = find_next();
    if (!following) return failure(following);
    if (following->sensor) {
      const Sample& sample = *following->sensor->head();
      return SampleKey{source_of(sample), stamp_of(sample), {}};
    }
    if (!following->entry) return std::nullopt;
    return SampleKey{following->entry->pair, following->entry->left_stamp, following->entry->frame_id};
  }

  Status skip() override {
    const auto taken = take();
    return taken ? Status() : failure(taken);
  }

  Status seek(std::int64_t samples_taken) override {
    started_ = false;
    content_hash_ = {};
    for (std::int64_t i = 0; i < samples_taken; ++i) {
      const auto taken = take();
      if (!taken) return failure(taken);
      if (taken->entry) {
        const auto files = read_files(*taken->entry, index_.video.get());
        if (!files) return failure(files);
        add(content_hash_, *files);
      }
      if (!taken->sensor && !taken->entry) {
        return failure(ErrorCode::input,
                       fmt::format("the recording holds only {} samples, cannot seek to sample {}", i, samples_taken),
                       index_.info.path);
      }
    }
    return {};
  }

  Result<Sample> sample_at(const std::string& pair, Stamp left_stamp) override {
    for (const FrameEntry& entry : index_.frames) {
      if (entry.pair != pair || entry.left_stamp != left_stamp || entry.fault == FrameFault::stamp_reversed) continue;
      const auto files = read_files(entry, index_.video.get());
      if (!files) return failure(files);
      return decode(entry, *files);
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

  DiscardedSamples discarded() const override {
    DiscardedSamples all;
    for (const SensorHead& sensor : sensors_) {
      const DiscardedSamples of = sensor.discarded();
      if (all.unreadable == 0) all.first_unreadable = of.first_unreadable;
      all.unreadable += of.unreadable;
      all.reversed += of.reversed;
    }
    return all;
  }

  Result<std::uint64_t> listing_hash() const override {
    Hash64 hash;
    const auto add = [&hash](std::string_view text) { hash.add(text.data(), text.size()); };
    const auto inside = [this](const std::string& file) {
      return fs::path(file).lexically_relative(index_.info.path).string();
    };
    add(name_of(index_.info.format));
    for (const FrameEntry& entry : index_.frames) {
      add(entry.pair);
      for (const Stamp stamp : {entry.left_stamp, entry.right_stamp}) hash.add(static_cast<std::uint64_t>(stamp.ns));
      for (const std::string* file : {&entry.left_file, &entry.right_file}) add(file->empty() ? "" : inside(*file));
      if (index_.video) hash.add(static_cast<std::uint64_t>(entry.video_frame));
      for (const double value : {entry.pan_rad, entry.tilt_rad, entry.exposure_us, entry.gain})
        hash.add(std::bit_cast<std::uint64_t>(value));
    }
    for (const std::string& file : index_.sensor_files) {
      add(inside(file));
      if (Status added = add_content(hash, file); !added) return failure(added);
    }
    return hash.value();
  }

  std::uint64_t content_hash() const override { return content_hash_.value(); }

 private:
  // The next item: a sensor sample or a listed frame; neither at the end.
  struct Taken {
    std::optional<Sample> sensor;
    const FrameEntry* entry = nullptr;
  };

  // What take() will take; neither at the end.
  struct Following {
    SensorHead* sensor = nullptr;
    const FrameEntry* entry = nullptr;
  };

  Result<Following> find_next() {
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
    const bool is_sensor = first && (!entry || stamp_of(*first->head()) <= entry->playback_stamp);
    return is_sensor ? Following{first, nullptr} : Following{nullptr, entry};
  }

  // Advances to the next item without decoding an image.
  Result<Taken> take() {
    const auto following = find_next();
    if (!following) return failure(following);
    if (following->sensor) {
      Taken taken{*following->sensor->head(), nullptr};
      if (Status status = following->sensor->advance(); !status) return failure(status);
      content_hash_.add(*taken.sensor);
      return taken;
    }
    if (following->entry) ++next_frame_;
    return Taken{std::nullopt, following->entry};
  }

  // The frame, or a MissingFrame that says why there is none. Code `resources`: no memory to decode an image.
  Result<Sample> decode(const FrameEntry& entry, const FrameFiles& files) const {
    const bool not_there = entry.fault == FrameFault::left_missing || entry.fault == FrameFault::right_missing;
    if (entry.fault && !not_there) return missing(entry, *entry.fault, entry.message);
    const StereoPair* pair = index_.info.rig.find_pair(entry.pair);
    const Camera* left_camera = index_.info.rig.find_camera(pair->left);
    const Camera* right_camera = index_.info.rig.find_camera(pair->right);
    if (files.video && !*files.video) return missing(entry, FrameFault::unreadable, files.video->error().message());
    if (files.video) return frame_of(entry, (*files.video)->left, (*files.video)->right);
    auto left = decode_image_of(entry, entry.left_file, files.left, *left_camera, FrameFault::left_missing);
    if (!left) return failure(left);
    auto right = decode_image_of(entry, entry.right_file, files.right, *right_camera, FrameFault::right_missing);
    if (!right) return failure(right);
    auto* const left_fault = std::get_if<MissingFrame>(&*left);
    auto* const right_fault = std::get_if<MissingFrame>(&*right);
    if (left_fault == nullptr && right_fault == nullptr)
      return frame_of(entry, std::get<FrameImage>(std::move(*left)), std::get<FrameImage>(std::move(*right)));
    MissingFrame fault = left_fault != nullptr ? std::move(*left_fault) : std::move(*right_fault);
    if (entry.fault) fault = missing(entry, *entry.fault, entry.message);
    if (left_fault == nullptr) fault.partial = frame_of(entry, std::get<FrameImage>(std::move(*left)), {});
    if (right_fault == nullptr) fault.partial = frame_of(entry, {}, std::get<FrameImage>(std::move(*right)));
    return fault;
  }

  static StereoFrame frame_of(const FrameEntry& entry, FrameImage left, FrameImage right) {
    return {entry.frame_id,   entry.position_id, entry.pair,     entry.left_stamp,  entry.right_stamp, std::move(left),
            std::move(right), entry.pan_rad,     entry.tilt_rad, entry.exposure_us, entry.gain};
  }

  static Result<std::variant<FrameImage, MissingFrame>> decode_image_of(const FrameEntry& entry,
                                                                        const std::string& file,
                                                                        const Result<std::string>& content,
                                                                        const Camera& camera, FrameFault when_missing) {
    auto image = content ? decode_image(*content, file) : Result<FrameImage>(failure(content));
    if (!image && image.error().code != ErrorCode::input) return failure(image);
    if (!image) {
      std::error_code error;
      const bool there = fs::exists(file, error);
      return missing(entry, there ? FrameFault::unreadable : when_missing, image.error().message());
    }
    if (image->size() != camera.size) {
      return missing(entry, FrameFault::wrong_size,
                     fmt::format("{}: the image is {}x{}, but camera '{}' in the rig is {}x{}", file, image->width(),
                                 image->height(), camera.name, camera.size.width, camera.size.height));
    }
    return interpret(*image, camera.pixel_format, entry.bits);
  }

  RecordingIndex index_;
  std::vector<SensorHead> sensors_;
  ContentHash content_hash_;
  std::size_t next_frame_ = 0;
  bool started_ = false;
};

}  // namespace

std::unique_ptr<Recording> make_indexed_recording(RecordingIndex index) {
  return std::make_unique<IndexedRecording>(std::move(index));
}

}  // namespace spartan::internal
