// Points on the ground of every stop of a recording, kept on the disk: matching is tried often, stereo is slow.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "mars_stops.h"
#include "spartan/core/archive.h"
#include "spartan/reconstruction/map_generator.h"

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
    values.insert(values.end(), {p.in_body.x(), p.in_body.y(), p.in_body.z(), p.sigma_m, p.along.x(), p.along.y(),
                                 p.along.z(), static_cast<float>(p.kind), p.cut ? 1.0F : 0.0F});
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

// In the order of the drive; made where they are not in `cache` yet. Empty where there is no such recording.
inline std::vector<StopPoints> points_of_stops(const std::string& recording, const std::string& cache) {
  std::vector<StopPoints> stops;
  std::optional<StopPoints> kept;
  while ((kept = read_points(fmt::format("{}/{}.points", cache, stops.size())))) stops.push_back(std::move(*kept));
  if (!stops.empty() && std::filesystem::exists(cache + "/complete")) return stops;
  auto drive = open_drive(recording);
  if (!drive) return {};
  auto imager = Imager::create(drive->rig, ImagingOptions(), Workers(2));
  if (!imager) return {};
  PositionMapper mapper({}, {}, Workers(2));
  std::filesystem::create_directories(cache);
  std::size_t number = 0;
  for (const auto& [position, shots] : drive->stops) {
    if (number++ < stops.size()) continue;
    const Stamp stamp = shots.front().left_stamp;
    look(*drive, *imager, mapper, shots);
    stops.push_back({stamp, true_pose(*drive, stamp), surface_points(mapper.merge())});
    const Bytes bytes = to_bytes(stops.back());
    const std::string path = fmt::format("{}/{}.points", cache, number - 1);
    std::ofstream(path + ".part", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    std::filesystem::rename(path + ".part", path);
  }
  std::ofstream(cache + "/complete") << stops.size();
  return stops;
}

}  // namespace spartan
