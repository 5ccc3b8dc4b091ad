#include "spartan/testing/tiny_recordings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "spartan/camera/recording_writer.h"
#include "spartan/image_io/image_io.h"
#include "spartan/numerics/random.h"

namespace spartan::testing {
namespace {

void must(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message());
}

constexpr const char* kProjections = "{0}: 20 0 12 0 0 20 8 0 0 0 1 0\n{1}: 20 0 12 -10 0 20 8 0 0 0 1 0\n";

std::string euroc_sensor(double x_m) {
  return fmt::format(
      "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [0, 0, 1, 0, -1, 0, 0, {}, 0, -1, 0, 0, 0, 0, 0, 1]\n"
      "rate_hz: 20\nresolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: [20, 20, 12, 8]\n"
      "distortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n",
      -x_m, kTinySize.width, kTinySize.height);
}

void write_euroc_camera(const TemporaryFolder& folder, const std::string& name, double x_m,
                        const std::vector<std::int64_t>& stamps) {
  std::string table = "#timestamp [ns],filename\n";
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    table += fmt::format("{0},{0}.png\n", stamps[i]);
    write_tiny_png(folder.file(fmt::format("mav0/{}/data/{}.png", name, stamps[i])), i);
  }
  folder.write("mav0/" + name + "/data.csv", table);
  folder.write("mav0/" + name + "/sensor.yaml", euroc_sensor(x_m));
}

}  // namespace

Image<std::uint8_t> tiny_image(std::uint64_t seed, ImageSize size) {
  Random random(seed);
  Image<std::uint8_t> image(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) image(x, y) = static_cast<std::uint8_t>(random.below(256));
  }
  return image;
}

void write_tiny_png(const std::string& path, std::uint64_t seed, ImageSize size) {
  must(write_png(path, tiny_image(seed, size)));
}

Rig tiny_rig() {
  Camera left, right;
  left.name = "left";
  right.name = "right";
  left.size = right.size = kTinySize;
  left.model = right.model = PinholeModel{20, 20, 12, 8};
  Rig rig = rig_of_one_pair("tiny", left, right, Pose::from_translation({-0.5, 0, 0}));
  rig.pairs.front().name = "stereo";
  return rig;
}

void write_tiny_kitti(const TemporaryFolder& folder, int frames, double period_s) {
  std::string times;
  for (int i = 0; i < frames; ++i) {
    const auto seed = static_cast<std::uint64_t>(2 * i);
    write_tiny_png(folder.file(fmt::format("image_0/{:06}.png", i)), seed);
    write_tiny_png(folder.file(fmt::format("image_1/{:06}.png", i)), seed + 1);
    times += fmt::format("{:.9f}\n", period_s * i);
  }
  folder.write("times.txt", times);
  folder.write("calib.txt", fmt::format(fmt::runtime(kProjections), "P0", "P1"));
}

void write_tiny_kitti_raw(const TemporaryFolder& folder, int frames) {
  std::string times;
  for (int i = 0; i < frames; ++i) {
    const auto seed = static_cast<std::uint64_t>(2 * i);
    write_tiny_png(folder.file(fmt::format("image_00/data/{:010}.png", i)), seed);
    write_tiny_png(folder.file(fmt::format("image_01/data/{:010}.png", i)), seed + 1);
    times += fmt::format("2011-09-26 13:02:{:02}.{:09}\n", 25 + i / 10, i % 10 * 100'000'000);
  }
  folder.write("image_00/timestamps.txt", times);
  folder.write("image_01/timestamps.txt", times);
  folder.write("calib_cam_to_cam.txt",
               fmt::format("S_rect_00: {0} {1}\nS_rect_01: {0} {1}\n", kTinySize.width, kTinySize.height) +
                   fmt::format(fmt::runtime(kProjections), "P_rect_00", "P_rect_01"));
}

void write_tiny_euroc(const TemporaryFolder& folder, const std::vector<std::int64_t>& left_ns,
                      const std::vector<std::int64_t>& right_ns) {
  write_euroc_camera(folder, "cam0", 0, left_ns);
  write_euroc_camera(folder, "cam1", 0.5, right_ns);
}

void write_tiny_spartan(const TemporaryFolder& folder, int frames, double period_s) {
  auto writer = RecordingWriter::create(folder.path(), tiny_rig(), {.name = "tiny", .description = "for tests"});
  must(writer ? Status{} : failure(writer));
  for (int i = 0; i < frames; ++i) {
    const auto seed = static_cast<std::uint64_t>(2 * i);
    StereoFrame frame;
    frame.frame_id = i;
    frame.pair = "stereo";
    frame.left_stamp = frame.right_stamp = Stamp::from_seconds(period_s * i);
    frame.left = FrameImage::own(tiny_image(seed), {});
    frame.right = FrameImage::own(tiny_image(seed + 1), {});
    must(writer->add(frame));
  }
  must(writer->finish());
}

CollectedSamples collect_samples(Recording& source) {
  CollectedSamples played;
  for (;;) {
    auto sample = source.next();
    if (!sample) {
      played.error = sample.error().message();
      return played;
    }
    if (!*sample) return played;
    if (const auto* frame = std::get_if<StereoFrame>(&**sample)) played.frames.push_back(*frame);
    if (const auto* missing = std::get_if<MissingFrame>(&**sample)) played.missing.push_back(*missing);
    played.all.push_back(std::move(**sample));
  }
}

std::vector<std::int64_t> ids_of(const std::vector<StereoFrame>& frames) {
  std::vector<std::int64_t> ids;
  ids.reserve(frames.size());
  for (const StereoFrame& frame : frames) ids.push_back(frame.frame_id);
  return ids;
}
std::vector<std::int64_t> ids_of(const std::vector<MissingFrame>& missing) {
  std::vector<std::int64_t> ids;
  ids.reserve(missing.size());
  for (const MissingFrame& frame : missing) ids.push_back(frame.frame_id);
  return ids;
}

bool same_image(const FrameImage& a, const FrameImage& b) {
  if (a.format() != b.format() || a.size() != b.size()) return false;
  const auto same = [&]<class Pixel>(ImageView<const Pixel> x, ImageView<const Pixel> y) {
    for (int row = 0; row < x.height(); ++row) {
      const std::size_t bytes = static_cast<std::size_t>(x.width()) * sizeof(Pixel);
      if (std::memcmp(&x(0, row), &y(0, row), bytes) != 0) return false;
    }
    return true;
  };
  if (a.format().layout == PixelLayout::rgb) {
    return a.format().bits > 8 ? same(a.as<Rgb16>(), b.as<Rgb16>()) : same(a.as<Rgb8>(), b.as<Rgb8>());
  }
  return a.format().bits > 8 ? same(a.as<std::uint16_t>(), b.as<std::uint16_t>())
                             : same(a.as<std::uint8_t>(), b.as<std::uint8_t>());
}

}  // namespace spartan::testing
