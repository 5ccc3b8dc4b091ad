// Readers of KITTI's calibration files (Geiger et al., "Vision meets robotics: the KITTI dataset", IJRR 2013, §IV).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <utility>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_readers.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/text_matrices.h"

namespace spartan {

using namespace internal;

namespace {

namespace fs = std::filesystem;

constexpr const char *kColour = "a colour camera, which is not read", *kGray = "a gray camera, which is not read",
                     *kScanner = "the place of the laser scanner, which is not read";

using Projection = Eigen::Matrix<double, 3, 4>;

template <class Matrix>
Result<Matrix> read_matrix(const TextMatrices& file, const std::string& key) {
  const auto numbers = file.numbers(key, Matrix::SizeAtCompileTime);
  if (!numbers) return failure(numbers);
  using RowMajor = Eigen::Matrix<double, Matrix::RowsAtCompileTime, Matrix::ColsAtCompileTime,
                                 (Matrix::ColsAtCompileTime == 1 ? Eigen::ColMajor : Eigen::RowMajor)>;
  return Matrix(Eigen::Map<const RowMajor>(numbers->data()));
}

Result<Eigen::Matrix3d> read_rotation(const TextMatrices& file, const std::string& key) {
  const auto matrix = read_matrix<Eigen::Matrix3d>(file, key);
  if (!matrix) return failure(matrix);
  // The files have seven digits.
  if (!is_rotation(*matrix, 1e-4)) {
    return failure(ErrorCode::configuration, key + ": is not a rotation matrix", file.where(key));
  }
  return nearest_rotation(*matrix);
}

// The rectified cameras of a pair.
struct RectifiedPair {
  PinholeModel left, right;
  Eigen::Vector3d left_m = Eigen::Vector3d::Zero();           ///< position of the left camera in the reference camera
  Eigen::Vector3d left_to_right_m = Eigen::Vector3d::Zero();  ///< from the left to the right camera
  std::vector<RigDifference> ignored;
};

struct PairKeys {
  const char *left, *right;
};

PinholeModel pinhole_of(const Projection& p) {
  return {p(0, 0), p(1, 1), p(0, 2), p(1, 2)};
}

// P = K [I | t]: the camera is at −t.
Eigen::Vector3d position_of(const Projection& p) {
  const double z = p(2, 3);
  return -Eigen::Vector3d((p(0, 3) - p(0, 2) * z) / p(0, 0), (p(1, 3) - p(1, 2) * z) / p(1, 1), z);
}

// The colour cameras are parallel, but at slightly different heights and depths.
RectifiedPair colour_pair(const Projection& left, const Projection& right) {
  RectifiedPair pair;
  pair.left = pinhole_of(left);
  pair.right = pinhole_of(right);
  pair.left_m = position_of(left);
  pair.left_to_right_m = position_of(right) - pair.left_m;
  return pair;
}

// P = K [I | t] with t = (−x, 0, 0): a camera at x along the common row direction.
Result<RectifiedPair> read_projections(const TextMatrices& file, const PairKeys& keys, KittiPair kind) {
  const std::string left_key = keys.left, right_key = keys.right;
  const auto left = read_matrix<Projection>(file, left_key);
  if (!left) return failure(left);
  const auto right = read_matrix<Projection>(file, right_key);
  if (!right) return failure(right);
  const auto error_at = [&](const std::string& key, const std::string& what) {
    return failure(ErrorCode::configuration, fmt::format("{}: {}", key, what), file.where(key));
  };
  for (const auto& [key, p] : {std::pair{left_key, *left}, std::pair{right_key, *right}}) {
    if (!(p(0, 0) > 0) || !(p(1, 1) > 0)) return error_at(key, "the focal lengths must be above zero");
    if (p(0, 1) != 0 || p(1, 0) != 0 || p(2, 0) != 0 || p(2, 1) != 0 || p(2, 2) != 1) {
      return error_at(key, "is not the projection of a rectified camera (fx 0 cx −fx·x; 0 fy cy 0; 0 0 1 0)");
    }
  }
  if (kind == KittiPair::colour) {
    RectifiedPair pair = colour_pair(*left, *right);
    if (pair.left_to_right_m.x() > 1e-6) return pair;
    return error_at(right_key, "gives a baseline that is not above zero");
  }
  // Tolerances for rounded files: 1e-6 of the focal length, 1e-3 px for the row, 1e-3 m for height and depth.
  const double f = (*left)(0, 0);
  const bool same_rows =
      std::abs((*right)(0, 0) - f) <= 1e-6 * f && std::abs((*right)(1, 1) - (*left)(1, 1)) <= 1e-6 * f &&
      std::abs((*right)(1, 2) - (*left)(1, 2)) <= 1e-3 && std::abs((*right)(1, 3) - (*left)(1, 3)) <= 1e-3 * f &&
      std::abs((*right)(2, 3) - (*left)(2, 3)) <= 1e-3;
  if (!same_rows) {
    return error_at(right_key, fmt::format("does not have the rows of {}: the pair is not rectified", left_key));
  }
  RectifiedPair pair;
  pair.left = pinhole_of(*left);
  pair.right = pinhole_of(*right);
  pair.left_m.x() = -(*left)(0, 3) / (*left)(0, 0);
  const double baseline_m = -(*right)(0, 3) / (*right)(0, 0) - pair.left_m.x();
  pair.left_to_right_m.x() = baseline_m;
  if (!(baseline_m > 1e-6)) {
    return error_at(right_key, fmt::format("gives a baseline of {:.6g} m, must be above zero", baseline_m));
  }
  // Below the tolerance above, but not zero.
  const Eigen::Vector2d residual = (*left - *right).col(3).tail<2>();
  if (residual != Eigen::Vector2d::Zero()) {
    pair.ignored = {{right_key, fmt::format("the last numbers of its rows 2 and 3, {:.6g} and {:.6g}, are set to 0: "
                                            "cameras at the same height and depth",
                                            -residual.x(), -residual.y())}};
  }
  return pair;
}

Camera pinhole_camera(const std::string& name, ImageSize size, const PinholeModel& model) {
  Camera camera;
  camera.name = name;
  camera.size = size;
  camera.model = model;
  return camera;
}

// R and T of a file beside calib_cam_to_cam.txt.
Result<Pose> read_transform(const std::string& path) {
  const auto file = TextMatrices::read(path);
  if (!file) return failure(file);
  const auto rotation = read_rotation(*file, "R");
  if (!rotation) return failure(rotation);
  const auto translation = read_matrix<Eigen::Vector3d>(*file, "T");
  if (!translation) return failure(translation);
  return Pose(*rotation, *translation);
}

// rectified_camera_0_from_imu = R_rect_00 · velodyne to camera 0 · IMU to velodyne.
Result<Pose> read_rectified_from_imu(const TextMatrices& file, const fs::path& folder) {
  const auto rectified_from_camera = read_rotation(file, "R_rect_00");
  if (!rectified_from_camera) return failure(rectified_from_camera);
  const auto velo_from_imu = read_transform((folder / "calib_imu_to_velo.txt").string());
  if (!velo_from_imu) return failure(velo_from_imu);
  const auto camera_from_velo = read_transform((folder / "calib_velo_to_cam.txt").string());
  if (!camera_from_velo) return failure(camera_from_velo);
  return Pose(*rectified_from_camera, Eigen::Vector3d::Zero()) * *camera_from_velo * *velo_from_imu;
}

Result<ImageSize> read_size(const TextMatrices& file, const std::string& key) {
  const auto size = read_matrix<Eigen::Vector2d>(file, key);
  if (!size) return failure(size);
  const auto known = whole_size(size->x(), size->y());
  if (!known) return file.error_at(key, "must be two whole numbers above zero");
  return *known;
}

// Lines that a Rig cannot represent. Their numbers must be valid too: a file with a NaN is rejected as a whole.
Result<std::vector<RigDifference>> read_other_cameras(const TextMatrices& file,
                                                      std::initializer_list<std::pair<const char*, const char*>> keys) {
  std::vector<RigDifference> ignored;
  for (const auto& [key, what] : keys) {
    if (!file.has(key)) continue;
    if (const auto valid = read_matrix<Projection>(file, key); !valid) return failure(valid);
    ignored.push_back({key, what});
  }
  return ignored;
}

// Whether the file contains an unrectified camera: K and D that differ from the rectified pinhole.
Result<bool> has_raw_camera(const TextMatrices& file, const std::string& number, const PinholeModel& rectified) {
  if (!file.has("K_" + number) || !file.has("D_" + number)) return false;
  const auto k = read_matrix<Eigen::Matrix3d>(file, "K_" + number);
  if (!k) return failure(k);
  const auto d = file.numbers("D_" + number, 5);
  if (!d) return failure(d);
  const PinholeModel raw{(*k)(0, 0), (*k)(1, 1), (*k)(0, 2), (*k)(1, 2)};
  return !(raw == rectified) || std::any_of(d->begin(), d->end(), [](double v) { return v != 0; });
}

LoadedRig make_read_rig(Rig rig, CalibrationFormat format, const std::string& path,
                        std::vector<RigDifference> ignored) {
  const bool left = rig.convention == PoseConvention::left_optical;
  return {std::move(rig),    format, {path}, {}, left ? kBodyIsLeftCamera : "the IMU of calib_imu_to_velo.txt",
          std::move(ignored)};
}

}  // namespace

Result<Rig> read_kitti_calib(const std::string& path, ImageSize size, KittiPair pair) {
  return rig_of(read_kitti(path, size, pair));
}

Result<Rig> read_kitti_raw_calib(const std::string& path, KittiPair pair) {
  return rig_of(read_kitti_raw(path, pair));
}

Result<LoadedRig> internal::read_kitti(const std::string& path, ImageSize size, KittiPair pair) {
  const auto file = TextMatrices::read(path);
  if (!file) return failure(file);
  const bool gray = pair == KittiPair::gray;
  const auto cameras = read_projections(*file, gray ? PairKeys{"P0", "P1"} : PairKeys{"P2", "P3"}, pair);
  if (!cameras) return failure(cameras);
  auto ignored = gray ? read_other_cameras(*file, {{"P2", kColour}, {"P3", kColour}, {"Tr", kScanner}})
                      : read_other_cameras(*file, {{"P0", kGray}, {"P1", kGray}, {"Tr", kScanner}});
  if (!ignored) return failure(ignored);
  if (size.empty()) return unknown_size(path);
  auto rig = validated(
      rig_of_one_pair("kitti", pinhole_camera("cam0", size, cameras->left),
                      pinhole_camera("cam1", size, cameras->right), Pose::from_translation(-cameras->left_to_right_m)),
      path);
  if (!rig) return failure(std::move(rig));
  ignored->insert(ignored->begin(), cameras->ignored.begin(), cameras->ignored.end());
  return make_read_rig(std::move(*rig), CalibrationFormat::kitti, path, std::move(*ignored));
}

Result<LoadedRig> internal::read_kitti_raw(const std::string& path, KittiPair pair) {
  const auto file = TextMatrices::read(path);
  if (!file) return failure(file);
  const bool gray = pair == KittiPair::gray;
  const auto cameras =
      read_projections(*file, gray ? PairKeys{"P_rect_00", "P_rect_01"} : PairKeys{"P_rect_02", "P_rect_03"}, pair);
  if (!cameras) return failure(cameras);
  auto ignored = gray ? read_other_cameras(*file, {{"P_rect_02", kColour}, {"P_rect_03", kColour}})
                      : read_other_cameras(*file, {{"P_rect_00", kGray}, {"P_rect_01", kGray}});
  if (!ignored) return failure(ignored);
  ignored->insert(ignored->begin(), cameras->ignored.begin(), cameras->ignored.end());
  const std::string left_number = gray ? "00" : "02", right_number = gray ? "01" : "03";
  for (const auto& [number, rectified] : {std::pair{left_number, cameras->left}, {right_number, cameras->right}}) {
    const auto raw = has_raw_camera(*file, number, rectified);
    if (!raw) return failure(raw);
    if (*raw) {
      ignored->push_back({"K_" + number, "the camera before rectification (K, D, R, T) is not kept"});
    }
  }
  const auto left_size = read_size(*file, "S_rect_" + left_number);
  if (!left_size) return failure(left_size);
  const std::string right_key = "S_rect_" + right_number;
  const auto right_size = file->has(right_key) ? read_size(*file, right_key) : left_size;
  if (!right_size) return failure(right_size);
  Rig rig = rig_of_one_pair("kitti_raw", pinhole_camera("cam0", *left_size, cameras->left),
                            pinhole_camera("cam1", *right_size, cameras->right),
                            Pose::from_translation(-cameras->left_to_right_m));

  const fs::path folder = fs::path(path).parent_path();
  std::error_code missing;
  if (fs::exists(folder / "calib_imu_to_velo.txt", missing) && fs::exists(folder / "calib_velo_to_cam.txt", missing)) {
    const auto rectified_from_imu = read_rectified_from_imu(*file, folder);
    if (!rectified_from_imu) return failure(rectified_from_imu);
    const Pose imu_from_rectified = rectified_from_imu->inverse();
    rig.convention = PoseConvention::body;
    rig.cameras[0].mount_from_camera = imu_from_rectified * Pose::from_translation(cameras->left_m);
    rig.cameras[1].mount_from_camera =
        imu_from_rectified * Pose::from_translation(cameras->left_m + cameras->left_to_right_m);
  }
  auto valid = validated(std::move(rig), path);
  if (!valid) return failure(std::move(valid));
  return make_read_rig(std::move(*valid), CalibrationFormat::kitti_raw, path, std::move(*ignored));
}

}  // namespace spartan
