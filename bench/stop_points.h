// Points on the ground of every stop of a recording, cached on disk: matching is benchmarked often, and stereo is slow.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mars_stops.h"
#include "spartan/core/archive.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/testing/real_data.h"

namespace spartan {

struct StopPoints {
  Stamp stamp;
  Pose world_from_body;  // the true one
  std::vector<SurfacePoint> points;
};

inline Bytes to_bytes(const StopPoints& stop) {
  std::vector<float> values;
  values.reserve(9 * stop.points.size());
  for (const SurfacePoint& p : stop.points) {
    values.insert(values.end(), {p.in_body.x(), p.in_body.y(), p.in_body.z(), p.sigma_m, p.ray.x(), p.ray.y(),
                                 p.ray.z(), static_cast<float>(p.kind), p.truncated ? 1.0F : 0.0F});
  }
  ArchiveWriter out;
  out.put(stop.stamp.ns);
  out.put(stop.world_from_body);
  out.put_array(values.data(), values.size());
  return out.take();
}

inline std::optional<StopPoints> read_points(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  const Bytes bytes{std::istreambuf_iterator<char>(file), {}};
  ArchiveReader in(bytes);
  StopPoints stop;
  stop.stamp.ns = in.get<std::int64_t>();
  stop.world_from_body = in.get_pose();
  const std::vector<float> v = in.get_array<float>();
  if (!in.finish(path)) return std::nullopt;
  for (std::size_t i = 0; i + 8 < v.size(); i += 9) {
    stop.points.push_back({{v[i], v[i + 1], v[i + 2]},
                           v[i + 3],
                           {v[i + 4], v[i + 5], v[i + 6]},
                           static_cast<GroundClass>(static_cast<int>(v[i + 7])),
                           v[i + 8] != 0});
  }
  return stop;
}

/// FNV-1a, 64 bits, continued from `hash`.
inline std::uint64_t hash_of(std::string_view bytes, std::uint64_t hash = 0xcbf29ce484222325U) {
  for (const char c : bytes) hash = (hash ^ static_cast<std::uint8_t>(c)) * 0x100000001b3U;
  return hash;
}

/// Hash of all sources that the points depend on (tests excluded); none where the source folder is not found. The
/// program must be up to date with them, as `make bench-…` ensures.
inline std::optional<std::uint64_t> hash_of_sources() {
  namespace fs = std::filesystem;
  const fs::path root = testing::source_folder();
  std::vector<fs::path> files{root / "bench/mars_stops.h", root / "bench/stop_points.h"};
  for (const char* module :
       {"core", "numerics", "image_io", "calibration_io", "rig", "camera", "imaging", "reconstruction"}) {
    std::error_code error;
    const auto before = files.size();
    for (const auto& entry : fs::recursive_directory_iterator(root / "src/spartan" / module, error)) {
      const std::string name = entry.path().filename().string();
      const bool source = name.ends_with(".h") || name.ends_with(".cpp");
      if (source && name.find("_test.") == std::string::npos) files.push_back(entry.path());
    }
    if (error || files.size() == before) return std::nullopt;
  }
  std::sort(files.begin(), files.end());
  std::uint64_t hash = hash_of("");
  for (const fs::path& file : files) {
    const auto content = read_file(file.string());
    if (!content) return std::nullopt;
    hash = hash_of(*content, hash_of(file.lexically_relative(root).string(), hash));
  }
  return hash;
}

/// The cache folder of a recording's points: its name is a hash of the recording, the options and the sources. None
/// where one of them cannot be read.
inline std::optional<std::string> cache_folder(const std::string& recording, const std::string& cache,
                                               const std::string& options) {
  std::optional<std::uint64_t> hash = hash_of_sources();
  if (!hash) return std::nullopt;
  // The images themselves are too large; the scenario has the seeds that they depend on.
  for (const char* file : {"recording.yaml", "rig.yaml", "frames.csv", "truth/poses.tum", "truth/scenario.yaml"}) {
    const auto content = read_file(recording + "/" + file);
    if (!content) return std::nullopt;
    hash = hash_of(*content, *hash);
  }
  return fmt::format("{}/{:016x}", cache, hash_of(options, *hash));
}

/// In the order of the drive. Computes the points that are not in `cache` yet. Empty where there is no such recording.
inline std::vector<StopPoints> points_of_stops(const std::string& recording, const std::string& cache) {
  const ImagingOptions imaging;
  const DisparityOptions disparity;
  const MappingOptions mapping;
  const auto folder =
      cache_folder(recording, cache, dump_options(imaging) + dump_options(disparity) + dump_options(mapping));
  std::vector<StopPoints> stops;
  if (folder) {
    std::optional<StopPoints> cached;
    while ((cached = read_points(fmt::format("{}/{}.points", *folder, stops.size())))) {
      stops.push_back(std::move(*cached));
    }
    if (!stops.empty() && std::filesystem::exists(*folder + "/complete")) return stops;
  }
  auto drive = open_drive(recording);
  if (!drive) return {};
  auto imager = Imager::create(drive->rig, imaging, ThreadPool(2));
  if (!imager) return {};
  StopMapper mapper = StopMapper::create(disparity, mapping, ThreadPool(2)).value();
  if (folder) std::filesystem::create_directories(*folder);
  std::size_t number = 0;
  for (const auto& [position, frames] : drive->stops) {
    if (number++ < stops.size()) continue;
    const Stamp stamp = frames.front().left_stamp;
    add_views(*drive, *imager, mapper, frames);
    stops.push_back({stamp, true_pose(*drive, stamp), surface_points(mapper.merge())});
    if (!folder) continue;
    const Bytes bytes = to_bytes(stops.back());
    const std::string path = fmt::format("{}/{}.points", *folder, number - 1);
    std::ofstream(path + ".part", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    std::filesystem::rename(path + ".part", path);
  }
  if (folder) std::ofstream(*folder + "/complete") << stops.size();
  return stops;
}

}  // namespace spartan
