#include "spartan/reconstruction/point_cloud.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "spartan/core/files.h"

namespace spartan {
namespace {

constexpr std::size_t kFormerPointBytes = 3 * sizeof(float) + 3;
constexpr std::size_t kPointBytes = kFormerPointBytes + sizeof(float) + sizeof(double);

std::string ply_header(std::size_t count, std::size_t point_bytes) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n{}end_header\n",
      count, point_bytes == kPointBytes ? "property float sigma_m\nproperty double time_s\n" : "");
}

// The bytes of a value as they are in memory: little-endian on the supported machines.
template <class Value>
void append(std::string& content, const Value& value) {
  content.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

template <class Value>
void take(const char*& data, Value& value) {
  std::memcpy(&value, data, sizeof(value));
  data += sizeof(value);
}

void append_position(std::string& content, const ColouredPoint& point) {
  content.append(reinterpret_cast<const char*>(point.position.data()), 3 * sizeof(float));
}

}  // namespace

PointCloud to_point_cloud(ImageView<const float> disparity, ImageView<const float> sigma,
                          ImageView<const std::uint8_t> left, const RectifiedStereo& geometry,
                          const Pose& target_from_left, const Stamp& stamp, const CloudSampling& sampling) {
  PointCloud cloud;
  for (int y = 0; y < disparity.height(); y += sampling.step_px) {
    for (int x = 0; x < disparity.width(); x += sampling.step_px) {
      const float d = disparity(x, y);
      if (std::isnan(d) || d <= 0 || d < sampling.min_disparity_px || std::isnan(sigma(x, y))) continue;
      const Eigen::Vector3d in_left = geometry.triangulate(x, y, d);
      const double range = in_left.norm();
      if (sampling.max_range_m > 0 && range > sampling.max_range_m) continue;
      const std::uint8_t gray = left(x, y);
      // σ of the range / range = σ of the depth / depth = σ_d / d.
      cloud.push_back({(target_from_left * in_left).cast<float>(),
                       {gray, gray, gray},
                       static_cast<float>(range) * sigma(x, y) / d,
                       stamp.seconds()});
    }
  }
  return cloud;
}

Status write_ply(const std::string& path, const PointCloud& cloud) {
  std::string content = ply_header(cloud.size(), kPointBytes);
  content.reserve(content.size() + cloud.size() * kPointBytes);
  for (const ColouredPoint& point : cloud) {
    append_position(content, point);
    append(content, point.colour);
    append(content, point.sigma_m);
    append(content, point.time_s);
  }
  return write_file_atomically(path, content);
}

Result<PointCloud> read_ply(const std::string& path) {
  const auto content = read_file(path);
  if (!content) return failure(content);
  const std::string_view end = "end_header\n";
  const std::size_t at = content->find(end);
  if (at == std::string::npos) return failure(ErrorCode::input, "is not a PLY file of this program", path);
  const std::size_t start = at + end.size(), bytes = content->size() - start;
  const std::string header = content->substr(0, start);
  for (const std::size_t point_bytes : {kPointBytes, kFormerPointBytes}) {
    const std::size_t count = bytes / point_bytes;
    if (count * point_bytes != bytes || header != ply_header(count, point_bytes)) continue;
    PointCloud cloud(count);
    const char* data = content->data() + start;
    for (ColouredPoint& point : cloud) {
      for (float& coordinate : point.position) take(data, coordinate);
      take(data, point.colour);
      if (point_bytes == kFormerPointBytes) continue;
      take(data, point.sigma_m);
      take(data, point.time_s);
    }
    return cloud;
  }
  return failure(ErrorCode::input, "is not a PLY file of this program, or is damaged", path);
}

Status write_pcd(const std::string& path, const PointCloud& cloud) {
  std::string content = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb sigma_m time_s\nSIZE 4 4 4 4 4 8\n"
      "TYPE F F F F F F\nCOUNT 1 1 1 1 1 1\nWIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      cloud.size());
  for (const ColouredPoint& point : cloud) {
    append_position(content, point);
    const auto [r, g, b] = point.colour;
    append(content, std::uint32_t{r} << 16U | std::uint32_t{g} << 8U | std::uint32_t{b});
    append(content, point.sigma_m);
    append(content, point.time_s);
  }
  return write_file_atomically(path, content);
}

}  // namespace spartan
