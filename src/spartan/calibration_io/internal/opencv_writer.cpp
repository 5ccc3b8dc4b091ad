// Writer of OpenCV's stereo calibration files.
#include <fmt/format.h>

#include <opencv2/core/persistence.hpp>

#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan::internal {
namespace {

struct OpencvLens {
  PinholeModel pinhole;
  std::vector<double> coefficients;
};

Result<OpencvLens> opencv_lens(const Camera& camera, bool fisheye) {
  if (fisheye) {
    if (const auto m = converted_to<EquidistantModel>(camera.model)) {
      return OpencvLens{m->pinhole(), {m->coefficients().begin(), m->coefficients().end()}};
    }
  } else if (const auto m = converted_to<RadialTangentialModel>(camera.model)) {
    const auto& k = m->coefficients();
    return OpencvLens{m->pinhole(), {k.begin(), k.begin() + (is_rational(*m) ? 8 : 5)}};
  }
  if (fisheye) {
    return cannot_hold(
        camera, fmt::format("the other camera is a fisheye, this one is {}; OpenCV files have one model for both",
                            name_of(camera.model)));
  }
  return cannot_hold(camera, fmt::format("OpenCV files do not support the model {}", name_of(camera.model)));
}

// OpenCV writes 17 digits, so values round-trip exactly.
cv::Mat matrix(const std::vector<double>& numbers, int rows) {
  return cv::Mat(numbers, true).reshape(1, rows);
}

}  // namespace

Result<CalibrationFiles> write_opencv_calib(const Rig& rig, const std::string& path) {
  const auto cameras = single_pair(rig, CalibrationFormat::opencv);
  if (!cameras) return failure(cameras);
  if (!(cameras->left->size == cameras->right->size)) {
    return cannot_hold(*cameras->right,
                       "OpenCV files have one image size for both cameras, this one differs from the left one");
  }
  const bool fisheye = converted_to<EquidistantModel>(cameras->left->model).has_value() ||
                       converted_to<EquidistantModel>(cameras->right->model).has_value();
  const auto left = opencv_lens(*cameras->left, fisheye), right = opencv_lens(*cameras->right, fisheye);
  if (!left) return failure(left);
  if (!right) return failure(right);
  const Pose right_from_left = rig.right_from_left(*cameras->pair);
  const Eigen::Matrix3d rows = right_from_left.rotation_matrix().transpose();
  const Eigen::Vector3d& t = right_from_left.translation();
  try {
    cv::FileStorage file(path.ends_with(".xml") ? "memory.xml" : "memory.yml",
                         cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    file << "image_width" << cameras->left->size.width << "image_height" << cameras->left->size.height;
    if (fisheye) file << "fisheye_model" << 1;
    for (const auto& [number, lens] : {std::pair{"1", &*left}, std::pair{"2", &*right}}) {
      const PinholeModel& p = lens->pinhole;
      file << std::string("M") + number << matrix({p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1}, 3);
      file << std::string("D") + number << matrix(lens->coefficients, 1);
    }
    file << "R" << matrix({rows.data(), rows.data() + rows.size()}, 3) << "T" << matrix({t.x(), t.y(), t.z()}, 3);
    return CalibrationFiles{{path, file.releaseAndGetString()}};
  } catch (const std::exception& e) {
    return failure(ErrorCode::internal, fmt::format("OpenCV cannot write this rig: {}", e.what()), path);
  }
}

}  // namespace spartan::internal
