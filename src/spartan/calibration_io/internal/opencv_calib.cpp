// Reader of OpenCV's stereo calibration files (FileStorage, YAML or XML).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_readers.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/opencv_storage.h"

namespace spartan {

using namespace internal;

namespace {

using Names = std::vector<std::string>;

// One or two files, searched in order for a key under any of its common names.
class Storages {
 public:
  Status open(const std::string& path) {
    auto storage = OpencvStorage::read(path);
    if (!storage) return failure(std::move(storage));
    paths_ += (paths_.empty() ? "" : " and ") + path;
    storages_.push_back(std::move(*storage));
    return {};
  }

  /// The matrix in row-major order; its number of elements must be one of `counts`.
  Result<std::vector<double>> matrix(const Names& names, const std::vector<int>& counts) const {
    for (const OpencvStorage& storage : storages_) {
      for (const std::string& name : names) {
        if (storage.has(name)) return storage.matrix(name, counts);
      }
    }
    return failure(ErrorCode::configuration, fmt::format("the key {} is missing", fmt::join(names, " or ")), paths_);
  }

  bool has(const std::string& name) const { return holder(name) != nullptr; }
  std::string text(const std::string& name) const { return has(name) ? holder(name)->text(name) : ""; }
  std::optional<int> integer(const std::string& name) const {
    return has(name) ? holder(name)->integer(name) : std::nullopt;
  }
  std::optional<ImageSize> size(const std::string& name) const {
    return has(name) ? holder(name)->size(name) : std::nullopt;
  }
  /// An error "key: what" at the line of the first of the names that exists.
  tl::unexpected<Error> error_at(const Names& names, const std::string& what) const {
    for (const std::string& name : names) {
      if (has(name)) return holder(name)->error_at(name, what);
    }
    return failure(ErrorCode::configuration, what, paths_);
  }
  const std::string& paths() const { return paths_; }

 private:
  const OpencvStorage* holder(const std::string& name) const {
    const auto found =
        std::find_if(storages_.begin(), storages_.end(), [&](const OpencvStorage& s) { return s.has(name); });
    return found == storages_.end() ? nullptr : &*found;
  }

  std::vector<OpencvStorage> storages_;
  std::string paths_;
};

// Four coefficients are ambiguous: a file of cv::fisheye must be marked as such.
bool is_fisheye(const Storages& files) {
  const std::string model_name = files.text("camera_model") + files.text("distortion_model");
  return files.integer("fisheye_model").value_or(0) != 0 || model_name.find("fisheye") != std::string::npos ||
         model_name.find("equidistant") != std::string::npos;
}

Result<PinholeModel> read_opencv_matrix(const Storages& files, const Names& names) {
  const auto values = files.matrix(names, {9});
  if (!values) return failure(values);
  const auto pinhole = pinhole_of_rows(*values);
  if (!pinhole || !(pinhole->fx > 0 && pinhole->fy > 0)) {
    return files.error_at(names, "is not a camera matrix (fx 0 cx; 0 fy cy; 0 0 1)");
  }
  return *pinhole;
}

Result<CameraModel> read_opencv_model(const Storages& files, const std::string& number) {
  const auto pinhole =
      read_opencv_matrix(files, {"M" + number, "K" + number, "cameraMatrix" + number, "camera_matrix_" + number});
  if (!pinhole) return failure(pinhole);
  const Names names{"D" + number, "distCoeffs" + number, "dist_coeffs_" + number};
  if (is_fisheye(files)) {
    const auto d = files.matrix(names, {4});
    if (!d) return failure(d);
    return EquidistantModel(*pinhole, {(*d)[0], (*d)[1], (*d)[2], (*d)[3]});
  }
  const auto d = files.matrix(names, {4, 5, 8, 12, 14});
  if (!d) return failure(d);
  RadialTangentialModel::Coefficients coefficients{};
  for (std::size_t i = 0; i < d->size(); ++i) {
    if (i < coefficients.size()) {
      coefficients[i] = (*d)[i];
    } else if ((*d)[i] != 0) {
      return files.error_at(names, "thin-prism and tilt coefficients (the 9th and on) are not supported");
    }
  }
  return RadialTangentialModel(*pinhole, coefficients);
}

Result<Eigen::Quaterniond> read_rotation(const Storages& files, const std::string& name) {
  const auto r = files.matrix({name}, {3, 9});
  if (!r) return failure(r);
  if (r->size() == 3) {
    const auto rotation = rotation_of_vector({(*r)[0], (*r)[1], (*r)[2]});
    if (!rotation) return files.error_at({name}, "is not a rotation");
    return *rotation;
  }
  const Eigen::Matrix3d rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r->data());
  constexpr double kTolerance = 1e-4;  // for matrices rounded to a few digits
  if (!is_rotation(rotation, kTolerance)) return files.error_at({name}, "is not a rotation matrix");
  return Eigen::Quaterniond(nearest_rotation(rotation));
}

// A rectified camera: its pinhole and its position in the rectified frame.
struct RectifiedCamera {
  PinholeModel pinhole;
  Eigen::Vector3d position_m;
};
Result<RectifiedCamera> read_projection(const Storages& files, const std::string& name) {
  const auto values = files.matrix({name}, {12});
  if (!values) return failure(values);
  const auto& p = *values;
  const bool rectified =
      p[0] > 0 && p[5] > 0 && p[1] == 0 && p[4] == 0 && p[8] == 0 && p[9] == 0 && p[10] == 1 && p[11] == 0;
  if (!rectified) {
    return files.error_at({name}, "is not the projection of a rectified camera (fx 0 cx tx; 0 fy cy ty; 0 0 1 0)");
  }
  return RectifiedCamera{{p[0], p[5], p[2], p[6]}, {-p[3] / p[0], -p[7] / p[5], 0}};
}

// The position of the right camera relative to the left one in the rectified frame.
Result<Eigen::Vector3d> read_rectified_baseline(const Storages& files) {
  const auto left = read_projection(files, "P1"), right = read_projection(files, "P2");
  if (!left) return failure(left);
  if (!right) return failure(right);
  return Eigen::Vector3d(right->position_m - left->position_m);
}

// X_right = R X_left + T; or from the rectification, R2 X_right = R1 X_left − baseline.
Result<Pose> read_right_from_left(const Storages& files) {
  if (files.has("R") || files.has("T") || !files.has("P2")) {
    const auto rotation = read_rotation(files, "R");
    if (!rotation) return failure(rotation);
    const auto t = files.matrix({"T"}, {3});
    if (!t) return failure(t);
    return Pose(*rotation, {(*t)[0], (*t)[1], (*t)[2]});
  }
  const auto left = read_rotation(files, "R1"), right = read_rotation(files, "R2");
  if (!left) return failure(left);
  if (!right) return failure(right);
  const auto baseline = read_rectified_baseline(files);
  if (!baseline) return failure(baseline);
  return Pose(right->conjugate() * *left, right->conjugate() * -*baseline);
}

Camera camera_of(const char* name, ImageSize size, CameraModel model) {
  Camera camera;
  camera.name = name;
  camera.size = size;
  camera.model = std::move(model);
  return camera;
}

Result<Rig> read_unrectified(const Storages& files, ImageSize size) {
  auto left = read_opencv_model(files, "1");
  if (!left) return failure(std::move(left));
  auto right = read_opencv_model(files, "2");
  if (!right) return failure(std::move(right));
  const auto right_from_left = read_right_from_left(files);
  if (!right_from_left) return failure(right_from_left);
  return rig_of_one_pair("opencv", camera_of("left", size, std::move(*left)),
                         camera_of("right", size, std::move(*right)), *right_from_left);
}

// A file with P1 and P2 but without camera matrices describes rectified images.
Result<Rig> read_rectified(const Storages& files, ImageSize size) {
  const auto left = read_projection(files, "P1"), right = read_projection(files, "P2");
  if (!left) return failure(left);
  if (!right) return failure(right);
  return rig_of_one_pair("opencv", camera_of("left", size, left->pinhole), camera_of("right", size, right->pinhole),
                         Pose::from_translation(left->position_m - right->position_m));
}

Result<int> read_side(const Storages& files, const char* key, const char* other) {
  const auto pixels = files.integer(key);
  if (!pixels || *pixels < 1) return files.error_at({key}, "must be a whole number above zero");
  if (!files.has(other)) return files.error_at({key}, fmt::format("is given without {}", other));
  return *pixels;
}

// The image size in the files, which must be valid; `fallback` if they do not contain it.
Result<ImageSize> size_in(const Storages& files, ImageSize fallback) {
  for (const char* key : {"image_size", "imageSize"}) {
    if (!files.has(key)) continue;
    const auto size = files.size(key);
    if (!size || size->empty()) return files.error_at({key}, "must be two whole numbers above zero");
    return *size;
  }
  const char *width_key = "image_width", *height_key = "image_height";
  if (!files.has(width_key) && !files.has(height_key)) return fallback;
  const auto width = read_side(files, files.has(width_key) ? width_key : height_key, height_key);
  const auto height = read_side(files, files.has(height_key) ? height_key : width_key, width_key);
  if (!width) return failure(width);
  if (!height) return failure(height);
  return ImageSize{*width, *height};
}

// The rectification of the file, which a Rig does not represent. For rectified images P1 and P2 are the cameras
// themselves.
std::vector<RigDifference> rectification_in(const Storages& files, bool raw) {
  std::vector<RigDifference> ignored;
  for (const char* key : raw ? std::vector{"R1", "R2", "P1", "P2", "Q"} : std::vector{"R1", "R2"}) {
    if (files.has(key)) ignored.push_back({key, "the rectification of the file is not kept"});
  }
  return ignored;
}

}  // namespace

Result<Rig> read_opencv_calib(const std::string& intrinsics_path, const std::string& extrinsics_path, ImageSize size) {
  return rig_of(read_opencv(intrinsics_path, extrinsics_path, size));
}

Result<LoadedRig> internal::read_opencv(const std::string& intrinsics_path, const std::string& extrinsics_path,
                                        ImageSize size) {
  Storages files;
  for (const std::string& path : {intrinsics_path, extrinsics_path}) {
    if (path.empty()) continue;
    if (const Status status = files.open(path); !status) return failure(status);
  }
  const auto image_size = size_in(files, size);
  if (!image_size) return failure(image_size);
  if (image_size->empty()) return unknown_size(files.paths());
  const bool raw = files.has("M1") || files.has("K1") || files.has("cameraMatrix1") || files.has("camera_matrix_1");
  auto rig = raw || !files.has("P1") ? read_unrectified(files, *image_size) : read_rectified(files, *image_size);
  if (!rig) return failure(std::move(rig));
  auto valid = validated(std::move(*rig), files.paths());
  if (!valid) return failure(std::move(valid));
  std::vector<std::string> paths{intrinsics_path};
  if (!extrinsics_path.empty()) paths.push_back(extrinsics_path);
  return LoadedRig{std::move(*valid), CalibrationFormat::opencv,   std::move(paths), {},
                   kBodyIsLeftCamera, rectification_in(files, raw)};
}

}  // namespace spartan
