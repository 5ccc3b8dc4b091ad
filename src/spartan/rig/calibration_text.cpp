#include "spartan/rig/calibration_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include "spartan/core/image_io.h"

namespace spartan::rig_detail {

namespace fs = std::filesystem;

Result<std::string> read_calibration_text(const std::string& path, std::size_t largest) {
  const auto error_at = [&](const std::string& what) { return failure(ErrorCode::configuration, what, path); };
  std::error_code error;
  if (fs::is_directory(path, error)) return error_at("is a folder, not a file");
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) {
    return error_at("is not a regular file: a calibration is read more than once, which a pipe does not allow");
  }
  const std::uintmax_t bytes = fs::file_size(path, error);
  if (!error && bytes > largest)
    return error_at(fmt::format("is larger than {} MB, so it is not a calibration file", largest >> 20U));
  std::ifstream file(path, std::ios::binary);
  if (!file) return error_at(std::string("cannot be read: ") + std::strerror(errno));
  std::string content;
  std::array<char, 65536> buffer{};
  while (file.read(buffer.data(), buffer.size()), file.gcount() > 0) {
    content.append(buffer.data(), static_cast<std::size_t>(file.gcount()));
    if (content.size() > largest)
      return error_at(fmt::format("is larger than {} MB, so it is not a calibration file", largest >> 20U));
  }
  if (file.bad()) return error_at("cannot be read completely");
  // Some editors write a UTF-8 byte order mark.
  if (content.starts_with("\xEF\xBB\xBF")) content.erase(0, 3);
  return content;
}

Result<Rig> validated(Rig rig, const std::string& where) {
  if (const Status status = rig.validate(where); !status) return failure(status);
  return rig;
}

tl::unexpected<Error> unknown_size(const std::string& where) {
  return failure(ErrorCode::configuration, "the image size is not known: this file format does not contain it", where,
                 "place the file beside its images, all of the same size (KITTI: beside image_0), or convert it with "
                 "--size-px 640,480");
}

std::optional<ImageSize> whole_size(double width, double height) {
  constexpr double kMaxSide = 1e6;
  for (const double side : {width, height}) {
    if (!(side >= 1 && side <= kMaxSide && std::floor(side) == side)) return std::nullopt;
  }
  return ImageSize{static_cast<int>(width), static_cast<int>(height)};
}

std::optional<PinholeModel> pinhole_of_rows(const std::vector<double>& rows) {
  const bool plain = rows.size() == 9 && rows[1] == 0 && rows[3] == 0 && rows[6] == 0 && rows[7] == 0 && rows[8] == 1;
  if (!plain) return std::nullopt;
  return PinholeModel{rows[0], rows[4], rows[2], rows[5]};
}

std::optional<Eigen::Quaterniond> rotation_of_vector(const Eigen::Vector3d& rotation_vector) {
  if (!(rotation_vector.norm() <= 1e3)) return std::nullopt;
  return exp_so3(rotation_vector);
}

std::string list_of(const Eigen::Ref<const Eigen::VectorXd>& numbers, const char* separator) {
  return fmt::format("{}", fmt::join(numbers.data(), numbers.data() + numbers.size(), separator));
}

std::string rows_of(const Eigen::Matrix3d& matrix, const char* separator) {
  const Eigen::Matrix3d rows = matrix.transpose();
  return fmt::format("{}", fmt::join(rows.data(), rows.data() + rows.size(), separator));
}

ImageSize size_of_images_in(const std::string& folder) {
  constexpr std::size_t kMaxImages = 8;
  static const std::set<std::string> endings{".png", ".jpg", ".jpeg", ".pgm", ".ppm"};
  std::error_code error;
  std::set<std::string> paths;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (endings.contains(entry.path().extension().string())) paths.insert(entry.path().string());
    if (paths.size() > kMaxImages) paths.erase(std::prev(paths.end()));
  }
  ImageSize common;
  for (const std::string& path : paths) {
    const auto image = read_image(path);
    if (!image) continue;
    if (!common.empty() && !(common == image->size())) return {};
    common = image->size();
  }
  return common;
}

}  // namespace spartan::rig_detail
