#include "spartan/calibration_io/internal/calibration_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"

namespace spartan::internal {

namespace fs = std::filesystem;

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

std::string trimmed(const std::string& text) {
  constexpr const char* kBlanks = " \t\r\v\f";
  const std::size_t first = text.find_first_not_of(kBlanks);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<std::string> split_words(const std::string& text) {
  constexpr const char* kSpace = " \t\n\v\f\r";
  std::vector<std::string> words;
  for (std::size_t at = text.find_first_not_of(kSpace); at != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSpace, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(kSpace, end);
  }
  return words;
}

Result<ImageSize> size_of_images_in(const std::string& folder) {
  constexpr std::size_t kMaxImages = 8;
  static const std::set<std::string> endings{".png", ".jpg", ".jpeg", ".pgm", ".ppm"};
  std::vector<std::string> paths;
  const auto names = list_folder(folder);
  if (!names && names.error().code == ErrorCode::resources) return failure(names);
  for (const std::string& name : names.value_or(std::vector<std::string>())) {
    if (paths.size() == kMaxImages) break;
    if (endings.contains(fs::path(name).extension().string())) paths.push_back((folder / fs::path(name)).string());
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

}  // namespace spartan::internal
