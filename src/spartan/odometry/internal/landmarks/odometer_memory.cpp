#include "spartan/odometry/internal/landmarks/odometer_memory.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace spartan::internal {
namespace {

constexpr std::uint32_t kVersion = 5;
constexpr const char* kWhat = "saved state of the odometry";

void put(ArchiveWriter& out, const RectifiedStereo& stereo) {
  out.put(stereo.size.width);
  out.put(stereo.size.height);
  out.put(stereo.focal_px);
  out.put(stereo.centre_px);
  out.put(stereo.baseline_m);
}

RectifiedStereo get_stereo(ArchiveReader& in) {
  RectifiedStereo stereo;
  stereo.size.width = in.get<int>();
  stereo.size.height = in.get<int>();
  stereo.focal_px = in.get_finite();
  stereo.centre_px = in.get_vector2();
  stereo.baseline_m = in.get_finite();
  return stereo;
}

void put(ArchiveWriter& out, ImageView<const std::uint16_t> image) {
  out.put(image.width());
  out.put(image.height());
  for (int y = 0; y < image.height(); ++y) out.put_array(image.row(y), static_cast<std::size_t>(image.width()));
}

/// None where a row has the wrong length or a side is not possible.
std::optional<Image<std::uint16_t>> get_image(ArchiveReader& in, std::size_t bytes) {
  const int width = in.get<int>(), height = in.get<int>();
  if (width < 0 || height < 0 || static_cast<std::size_t>(width) * static_cast<std::size_t>(height) > bytes)
    return std::nullopt;
  Image<std::uint16_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    const std::vector<std::uint16_t> row = in.get_array<std::uint16_t>();
    if (row.size() != static_cast<std::size_t>(width)) return std::nullopt;
    std::copy(row.begin(), row.end(), image.row(y));
  }
  return image;
}

void put(ArchiveWriter& out, const Landmark& landmark) {
  out.put(landmark.anchor_id);
  out.put(landmark.anchor_pixel);
  out.put(landmark.disparity);
  out.put(landmark.variance);
  out.put(landmark.slant);
  out.put_array(landmark.patch.data(), landmark.patch.size());
  out.put(landmark.pixel);
  out.put(landmark.scale);
  out.put(landmark.angle);
  out.put(landmark.sign);
  out.put_array(landmark.descriptor.bytes.data(), bytes_of(landmark.descriptor.kind));
  out.put(landmark.missed_frames);
  out.put(landmark.measured_frames);
}

template <class T, std::size_t N>
bool fill(std::array<T, N>& array, const std::vector<T>& values) {
  if (values.size() != N) return false;
  std::copy(values.begin(), values.end(), array.begin());
  return true;
}

/// The length tells the kind.
bool fill(Descriptor& descriptor, const std::vector<std::int8_t>& bytes) {
  const std::optional<DescriptorKind> kind = descriptor_kind_of(bytes.size());
  if (!kind) return false;
  descriptor.kind = *kind;
  std::copy(bytes.begin(), bytes.end(), descriptor.bytes.begin());
  return true;
}

/// Far beyond the side of an image and what a counter reaches, so that neither overflows.
constexpr double kMostPixels = 1e6;
constexpr std::int32_t kMostFrames = 1'000'000;

bool is_count(std::int32_t value) {
  return value >= 0 && value <= kMostFrames;
}

/// False where an array has the wrong length, or a value is not possible.
bool get(ArchiveReader& in, Landmark& landmark) {
  landmark.anchor_id = in.get<std::uint32_t>();
  landmark.anchor_pixel = in.get_vector2();
  landmark.disparity = in.get_finite();
  landmark.variance = in.get_finite();
  landmark.slant = in.get_vector2();
  bool complete = fill(landmark.patch, in.get_array<std::uint16_t>());
  landmark.pixel = in.get_vector2();
  landmark.scale = in.get<float>();
  landmark.angle = in.get<float>();
  landmark.sign = in.get<std::int8_t>();
  complete = fill(landmark.descriptor, in.get_array<std::int8_t>()) && complete;
  landmark.missed_frames = in.get<std::int32_t>();
  landmark.measured_frames = in.get<std::int32_t>();
  return complete && landmark.pixel.cwiseAbs().maxCoeff() < kMostPixels &&
         landmark.anchor_pixel.cwiseAbs().maxCoeff() < kMostPixels && landmark.variance >= 0 &&
         is_count(landmark.missed_frames) && is_count(landmark.measured_frames);
}

void put(ArchiveWriter& out, const LandmarkFrame& frame) {
  out.put(frame.stamp.ns);
  out.put(frame.map.next_anchor_id);
  out.put(static_cast<std::uint32_t>(frame.map.anchors.size()));
  for (const Anchor& anchor : frame.map.anchors) {
    out.put(anchor.id);
    out.put(anchor.latest_from_anchor);
  }
  out.put(static_cast<std::uint32_t>(frame.map.landmarks.size()));
  for (const Landmark& landmark : frame.map.landmarks) put(out, landmark);
  for (int level = 0; level < ImagePyramid::kLevels; ++level) put(out, frame.pyramid.level(level));
}

/// What is damaged; empty where nothing is.
std::string get(ArchiveReader& in, std::size_t bytes, LandmarkFrame& frame) {
  frame.stamp = in.get_stamp();
  LandmarkMemory& map = frame.map;
  map.next_anchor_id = in.get<std::uint32_t>();
  const auto anchors = in.get<std::uint32_t>();
  if (anchors > bytes) return "is damaged: more anchors than bytes";
  for (std::uint32_t i = 0; i < anchors; ++i) {
    Anchor anchor;
    anchor.id = in.get<std::uint32_t>();
    if (!map.anchors.empty() && anchor.id <= map.anchors.back().id)
      return "is damaged: the anchors are not in the order of their ids";
    anchor.latest_from_anchor = in.get_pose();
    map.anchors.push_back(anchor);
  }
  const auto landmarks = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < landmarks; ++i) {
    Landmark landmark;
    if (!get(in, landmark)) return "is damaged: a landmark is not possible";
    const auto is_its_anchor = [&](const Anchor& anchor) { return anchor.id == landmark.anchor_id; };
    if (std::none_of(map.anchors.begin(), map.anchors.end(), is_its_anchor))
      return "is damaged: a landmark has no anchor";
    map.landmarks.push_back(landmark);
  }
  for (int level = 0; level < ImagePyramid::kLevels; ++level) {
    auto image = get_image(in, bytes);
    if (!image) return "is damaged: a level of the pyramid is not possible";
    frame.pyramid.set_level(level, *std::move(image));
  }
  return {};
}

void put(ArchiveWriter& out, const MeasuredVelocity& velocity) {
  out.put_array(velocity.motion.data(), 6);
  out.put(velocity.span_s);
}

/// False where it is not possible.
bool get(ArchiveReader& in, MeasuredVelocity& velocity) {
  const std::vector<double> motion = in.get_array<double>();
  velocity.span_s = in.get_finite();
  if (motion.size() != 6) return false;
  std::copy(motion.begin(), motion.end(), velocity.motion.data());
  return velocity.motion.allFinite();
}

void put(ArchiveWriter& out, const KeptFrame& kept) {
  put(out, kept.frame);
  out.put(kept.reference_stamp.ns);
  out.put(kept.kept_from_reference.pose);
  out.put(kept.kept_from_reference.covariance);
  out.put(kept.age);
  out.put(kept.searches);
}

/// What is damaged; empty where nothing is.
std::string get(ArchiveReader& in, std::size_t bytes, KeptFrame& kept) {
  if (std::string what = get(in, bytes, kept.frame); !what.empty()) return what;
  kept.reference_stamp = in.get_stamp();
  kept.kept_from_reference.pose = in.get_pose();
  kept.kept_from_reference.covariance = in.get_matrix6();
  kept.age = in.get<std::int32_t>();
  kept.searches = in.get<std::int32_t>();
  return is_count(kept.age) && is_count(kept.searches) ? std::string()
                                                       : "is damaged: the number of frames is not possible";
}

tl::unexpected<Error> damaged(const std::string& what) {
  return failure(ErrorCode::store_damaged, what, kWhat, "run again into a new folder");
}

}  // namespace

Bytes OdometerMemory::save() const {
  ArchiveWriter out;
  out.put(kVersion);
  out.put(started);
  put(out, geometry);
  put(out, latest_velocity);
  put(out, steady_velocity);
  out.put(ambiguous_frames);
  out.put(offset.value);
  out.put(offset.variance);
  put(out, reference);
  out.put(frames_since_reference);
  put(out, latest);
  out.put(reference_from_latest);
  out.put(sharpness.along_x);
  out.put(sharpness.along_y);
  put(out, kept);
  return out.take();
}

Result<OdometerMemory> OdometerMemory::restore(const Bytes& bytes) {
  ArchiveReader in(bytes);
  if (Status s = in.expect_version(kVersion, kWhat); !s) return failure(s);
  OdometerMemory memory;
  memory.started = in.get<bool>();
  memory.geometry = get_stereo(in);
  if (!get(in, memory.latest_velocity) || !get(in, memory.steady_velocity))
    return damaged("is damaged: the latest motion is not possible");
  memory.ambiguous_frames = in.get<std::int32_t>();
  memory.offset.value = in.get_finite();
  memory.offset.variance = in.get_finite();
  if (!is_count(memory.ambiguous_frames) || !(memory.offset.variance >= 0))
    return damaged("is damaged: the disparity offset or a number of frames is not possible");
  if (std::string what = get(in, bytes.size(), memory.reference); !what.empty()) return damaged(what);
  memory.frames_since_reference = in.get<std::int32_t>();
  if (!is_count(memory.frames_since_reference)) return damaged("is damaged: the number of frames is not possible");
  if (std::string what = get(in, bytes.size(), memory.latest); !what.empty()) return damaged(what);
  memory.reference_from_latest = in.get_pose();
  memory.sharpness.along_x = in.get<float>();
  memory.sharpness.along_y = in.get<float>();
  if (std::string what = get(in, bytes.size(), memory.kept); !what.empty()) return damaged(what);
  if (Status status = in.finish(kWhat); !status) return failure(status);
  return memory;
}

}  // namespace spartan::internal
