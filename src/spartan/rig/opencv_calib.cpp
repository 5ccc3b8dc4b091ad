// Reader of OpenCV's stereo calibration files.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core/persistence.hpp>

#include "spartan/core/files.h"
#include "spartan/rig/rig_files.h"

namespace spartan {
namespace {

using Names = std::vector<std::string>;

// One or two storages, asked in turn for a key under any of its usual names.
class Storages {
 public:
  Status open(const std::string& path) {
    auto text = read_file(path);
    if (!text) {
      text.error().code = ErrorCode::configuration;
      return failure(text);
    }
    paths_ += (paths_.empty() ? "" : " and ") + path;
    try {
      cv::FileStorage storage(*text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
      if (!storage.isOpened() || !storage.root().isMap()) {
        return failure(ErrorCode::configuration, "OpenCV cannot read this file", path);
      }
      storages_.push_back(std::move(storage));
    } catch (const std::exception& e) {
      return failure(ErrorCode::configuration, fmt::format("OpenCV cannot read this file: {}", e.what()), path);
    }
    return {};
  }

  /// The matrix as doubles, row by row, with `counts` elements; a key that is missing is a fault unless optional.
  Result<std::vector<double>> matrix(const Names& names, const std::vector<int>& counts) const {
    for (const cv::FileStorage& storage : storages_) {
      for (const std::string& name : names) {
        const cv::FileNode node = storage[name];
        if (!node.empty()) return read(node, name, counts);
      }
    }
    return failure(ErrorCode::configuration, fmt::format("the key {} is missing", fmt::join(names, " or ")), paths_);
  }

  std::optional<int> integer(const std::string& name) const {
    for (const cv::FileStorage& storage : storages_) {
      const cv::FileNode node = storage[name];
      if (!node.empty() && node.isInt()) return static_cast<int>(node);
    }
    return std::nullopt;
  }

  std::optional<ImageSize> size(const std::string& name) const {
    for (const cv::FileStorage& storage : storages_) {
      const cv::FileNode node = storage[name];
      if (node.isSeq() && node.size() == 2 && node[0].isInt() && node[1].isInt()) {
        return ImageSize{static_cast<int>(node[0]), static_cast<int>(node[1])};
      }
    }
    return std::nullopt;
  }
  const std::string& paths() const { return paths_; }

 private:
  Result<std::vector<double>> read(const cv::FileNode& node, const std::string& name,
                                   const std::vector<int>& counts) const {
    const auto fault = [&](const std::string& what) {
      return failure(ErrorCode::configuration, fmt::format("{}: {}", name, what), paths_);
    };
    // Read number by number: cv::Mat would trust rows and cols, and take any amount of memory for them.
    if (!node.isMap() || !node["rows"].isInt() || !node["cols"].isInt() || !node["data"].isSeq())
      return fault("is not a matrix");
    const cv::FileNode data = node["data"];
    const auto total = static_cast<std::int64_t>(data.size());
    if (std::int64_t{static_cast<int>(node["rows"])} * static_cast<int>(node["cols"]) != total)
      return fault("has other numbers than its rows and columns say");
    if (std::find(counts.begin(), counts.end(), total) == counts.end()) {
      return fault(fmt::format("has {} numbers, must have {}", total, fmt::join(counts, " or ")));
    }
    std::vector<double> values;
    values.reserve(data.size());
    for (const cv::FileNode& entry : data) {
      if (!entry.isInt() && !entry.isReal()) return fault("holds something that is not a number");
      values.push_back(static_cast<double>(entry));
      if (!std::isfinite(values.back())) return fault("holds a number that is not finite");
    }
    return values;
  }

  std::vector<cv::FileStorage> storages_;
  std::string paths_;
};

Result<Camera> read_eye(const Storages& files, const std::string& number, const std::string& name, ImageSize size) {
  const auto k = files.matrix({"M" + number, "K" + number, "cameraMatrix" + number, "camera_matrix_" + number}, {9});
  if (!k) return failure(k);
  const auto d = files.matrix({"D" + number, "distCoeffs" + number, "dist_coeffs_" + number}, {4, 5, 8, 12, 14});
  if (!d) return failure(d);
  const auto& m = *k;
  if (!(m[0] > 0 && m[4] > 0) || m[1] != 0 || m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1) {
    return failure(ErrorCode::configuration,
                   fmt::format("M{}: is not a camera matrix (fx 0 cx; 0 fy cy; 0 0 1)", number), files.paths());
  }
  RadialTangentialModel::Coefficients coefficients{};
  for (std::size_t i = 0; i < d->size(); ++i) {
    if (i < coefficients.size()) {
      coefficients[i] = (*d)[i];
    } else if ((*d)[i] != 0) {
      return failure(ErrorCode::configuration,
                     fmt::format("D{}: thin-prism and tilt coefficients (the 9th and on) are not supported", number),
                     files.paths());
    }
  }
  Camera camera;
  camera.name = name;
  camera.size = size;
  camera.model = RadialTangentialModel({m[0], m[4], m[2], m[5]}, coefficients);
  return camera;
}

// X_right = R X_left + T.
Result<Pose> read_right_from_left(const Storages& files) {
  const auto r = files.matrix({"R"}, {3, 9});
  if (!r) return failure(r);
  const auto t = files.matrix({"T"}, {3});
  if (!t) return failure(t);
  const Eigen::Vector3d translation((*t)[0], (*t)[1], (*t)[2]);
  if (r->size() == 3) return Pose(exp_so3({(*r)[0], (*r)[1], (*r)[2]}), translation);
  const Eigen::Matrix3d rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r->data());
  if (!is_rotation(rotation, 1e-4)) {
    return failure(ErrorCode::configuration, "R: is not a rotation matrix", files.paths());
  }
  return Pose(nearest_rotation(rotation), translation);
}

ImageSize size_in(const Storages& files, ImageSize otherwise) {
  for (const char* key : {"image_size", "imageSize"}) {
    if (const auto size = files.size(key)) return *size;
  }
  const auto width = files.integer("image_width"), height = files.integer("image_height");
  return width && height ? ImageSize{*width, *height} : otherwise;
}

}  // namespace

Result<Rig> read_opencv_calib(const std::string& intrinsics_path, const std::string& extrinsics_path, ImageSize size) {
  Storages files;
  for (const std::string& path : {intrinsics_path, extrinsics_path}) {
    if (path.empty()) continue;
    if (const Status status = files.open(path); !status) return failure(status);
  }
  const ImageSize known = size_in(files, size);
  if (known.empty()) {
    return failure(ErrorCode::configuration, "the image size is not known: image_width and image_height are missing",
                   files.paths());
  }
  auto left = read_eye(files, "1", "left", known);
  if (!left) return failure(left);
  auto right = read_eye(files, "2", "right", known);
  if (!right) return failure(right);
  const auto right_from_left = read_right_from_left(files);
  if (!right_from_left) return failure(right_from_left);
  Rig rig = rig_of_one_pair("opencv", std::move(*left), std::move(*right), *right_from_left);
  if (const Status status = rig.validate(files.paths()); !status) return failure(status);
  return rig;
}

}  // namespace spartan
