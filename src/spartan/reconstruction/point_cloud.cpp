#include "spartan/reconstruction/point_cloud.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "spartan/core/files.h"

namespace spartan {
namespace {

constexpr std::size_t kPointBytes = 3 * sizeof(float) + 3;

std::string header(std::size_t count) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      count);
}

}  // namespace

PointCloud to_point_cloud(ImageView<const float> disparity, ImageView<const std::uint8_t> left,
                          const RectifiedStereo& geometry, const Pose& target_from_left, int step_px,
                          double smallest_disparity_px) {
  PointCloud cloud;
  for (int y = 0; y < disparity.height(); y += step_px) {
    for (int x = 0; x < disparity.width(); x += step_px) {
      const float d = disparity(x, y);
      if (std::isnan(d) || d <= 0 || d < smallest_disparity_px) continue;
      const Eigen::Vector3d point = target_from_left * geometry.triangulate(x, y, d);
      const std::uint8_t gray = left(x, y);
      cloud.push_back({point.cast<float>(), {gray, gray, gray}});
    }
  }
  return cloud;
}

Status write_ply(const std::string& path, const PointCloud& cloud) {
  std::string content = header(cloud.size());
  content.reserve(content.size() + cloud.size() * kPointBytes);
  for (const ColouredPoint& point : cloud) {
    content.append(reinterpret_cast<const char*>(point.position.data()), 3 * sizeof(float));
    content.append(
        {static_cast<char>(point.colour.r), static_cast<char>(point.colour.g), static_cast<char>(point.colour.b)});
  }
  return write_file_atomically(path, content);
}

Result<PointCloud> read_ply(const std::string& path) {
  const auto content = read_file(path);
  if (!content) return failure(content);
  const std::string_view end = "end_header\n";
  const std::size_t at = content->find(end);
  if (at == std::string::npos) return failure(ErrorCode::input, "is not a PLY file of this program", path);
  const std::size_t count = (content->size() - at - end.size()) / kPointBytes;
  if (content->substr(0, at + end.size()) != header(count) ||
      at + end.size() + count * kPointBytes != content->size()) {
    return failure(ErrorCode::input, "is not a PLY file of this program, or is damaged", path);
  }
  PointCloud cloud(count);
  const char* data = content->data() + at + end.size();
  for (ColouredPoint& point : cloud) {
    std::memcpy(point.position.data(), data, 3 * sizeof(float));
    std::memcpy(&point.colour, data + 3 * sizeof(float), 3);
    data += kPointBytes;
  }
  return cloud;
}

}  // namespace spartan
