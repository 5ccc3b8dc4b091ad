// Helpers for reading and writing the text of calibration files. Internal to calibration_io.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// The rig if Rig::validate() accepts it, otherwise its error.
Result<Rig> validated(Rig rig, const std::string& where);

/// The error for a file without image size if the size is not known otherwise.
tl::unexpected<Error> unknown_size(const std::string& where);

/// Width and height if they are positive integers of at most 10⁶; nullopt otherwise.
std::optional<ImageSize> whole_size(double width, double height);
/// The pinhole of a row-major 3×3 camera matrix; nullopt if it is not of the form fx 0 cx; 0 fy cy; 0 0 1. Focal
/// lengths are not checked.
std::optional<PinholeModel> pinhole_of_rows(const std::vector<double>& rows);
/// The rotation of a rotation vector in rad; nullopt if its angle exceeds 1000 rad, where its precision is lost.
std::optional<Eigen::Quaterniond> rotation_of_vector(const Eigen::Vector3d& rotation_vector);

/// Numbers in full precision (they parse to the same bits), separated; a matrix in row-major order.
std::string list_of(const Eigen::Ref<const Eigen::VectorXd>& numbers, const char* separator = " ");
std::string rows_of(const Eigen::Matrix3d& matrix, const char* separator = " ");

/// Part of a line without the white space around it.
std::string trimmed(const std::string& text);
/// The words of a text, which are separated by white space. Not by a stream: in a stream, a failed allocation looks
/// like the end of the text.
std::vector<std::string> split_words(const std::string& text);

/// The common size of the first 8 images of a folder in alphabetical order; empty if there are none or their sizes
/// differ. Code: `resources`.
Result<ImageSize> size_of_images_in(const std::string& folder);

}  // namespace spartan::internal
