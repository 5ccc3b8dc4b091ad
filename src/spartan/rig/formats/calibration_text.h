// Reading and writing the text of calibration files. Internal to rig.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan::rig_detail {

/// What is larger is no calibration; nothing above is read into memory.
constexpr std::size_t kLargestCalibration_bytes = std::size_t{4} << 20U;
/// mrcal's files carry the whole optimisation that they come from.
constexpr std::size_t kLargestModelFile_bytes = std::size_t{64} << 20U;

/// The whole of a file; code `configuration` where it cannot be read or is too large.
Result<std::string> read_calibration_text(const std::string& path, std::size_t largest = kLargestCalibration_bytes);

/// A rig that is sound, or its faults.
Result<Rig> validated(Rig rig, const std::string& where);

/// The error of a file that does not hold the image size where nothing else tells it.
tl::unexpected<Error> unknown_size(const std::string& where);

/// Width and height where they are whole numbers above zero, and no more than a picture can have.
std::optional<ImageSize> whole_size(double width, double height);
/// The pinhole of a camera matrix in nine numbers, row by row; none where it has another form than fx 0 cx; 0 fy cy;
/// 0 0 1. Focal lengths are not looked at.
std::optional<PinholeModel> pinhole_of_rows(const std::vector<double>& rows);
/// The rotation of a rotation vector, rad; none where it goes round so often that its digits are lost.
std::optional<Eigen::Quaterniond> rotation_of_vector(const Eigen::Vector3d& turn);

/// Numbers with all their digits, separated; of a matrix row by row.
std::string list_of(const Eigen::Ref<const Eigen::VectorXd>& numbers, const char* separator = " ");
std::string rows_of(const Eigen::Matrix3d& matrix, const char* separator = " ");

/// The size that all pictures in a folder have; empty where there is none or sizes differ. Looks at the first few.
ImageSize size_of_pictures_in(const std::string& folder);

}  // namespace spartan::rig_detail
