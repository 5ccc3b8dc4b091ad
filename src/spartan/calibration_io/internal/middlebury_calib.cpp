// calib.txt of the Middlebury (2014) and ETH3D two-view stereo benchmarks: rectified pinhole cameras.
// Source: Scharstein et al., "High-resolution stereo datasets with subpixel-accurate ground truth", GCPR 2014.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_readers.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/text_matrices.h"

namespace spartan {

using namespace internal;

namespace {

constexpr double kMillimetre_m = 1e-3;
constexpr double kRounding_px = 1e-2;  // of doffs, which has three decimals

// cam0=[f 0 cx; 0 f cy; 0 0 1]
Result<PinholeModel> read_camera(const TextMatrices& file, const std::string& key) {
  const auto text = file.text(key);
  if (!text) return failure(text);
  std::string plain = *text;
  std::replace_if(
      plain.begin(), plain.end(), [](char c) { return c == '[' || c == ']' || c == ';' || c == ','; }, ' ');
  const auto m = TextMatrices::parse(key + "=" + plain, file.name(), '=').numbers(key, 9);
  if (!m) return file.error_at(key, "must be a matrix of nine numbers, [f 0 cx; 0 f cy; 0 0 1]");
  const std::vector<double>& k = *m;
  if (!(k[0] > 0) || !(k[4] > 0) || k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    return file.error_at(key, "is not the matrix of a rectified camera, [f 0 cx; 0 f cy; 0 0 1]");
  return PinholeModel{k[0], k[4], k[2], k[5]};
}

Result<double> read_number(const TextMatrices& file, const std::string& key) {
  const auto number = file.numbers(key, 1);
  if (!number) return failure(number);
  return number->front();
}

Camera rectified_camera(const std::string& name, ImageSize size, const PinholeModel& model) {
  Camera camera;
  camera.name = name;
  camera.size = size;
  camera.model = model;
  return camera;
}

std::string matrix(const PinholeModel& m) {
  return fmt::format("[{} 0 {}; 0 {} {}; 0 0 1]", m.fx, m.cx, m.fy, m.cy);
}

}  // namespace

Result<LoadedRig> read_middlebury_calib(const std::string& path) {
  const auto file = TextMatrices::read(path, '=');
  if (!file) return failure(file);
  const auto left = read_camera(*file, "cam0"), right = read_camera(*file, "cam1");
  if (!left) return failure(left);
  if (!right) return failure(right);
  const auto baseline_mm = read_number(*file, "baseline");
  if (!baseline_mm) return failure(baseline_mm);
  if (!(*baseline_mm > 0)) return file->error_at("baseline", "must be above zero");
  if (file->has("doffs")) {
    const auto doffs = read_number(*file, "doffs");
    if (!doffs) return failure(doffs);
    if (std::abs(*doffs - (right->cx - left->cx)) > kRounding_px)
      return file->error_at("doffs", fmt::format("must be cx of cam1 minus cx of cam0, {:.6g}", right->cx - left->cx));
  }
  const auto width = read_number(*file, "width"), height = read_number(*file, "height");
  if (!width) return failure(width);
  if (!height) return failure(height);
  const auto size = whole_size(*width, *height);
  if (!size) return file->error_at("width", "width and height must be whole numbers above zero");
  auto rig = validated(
      rig_of_one_pair("middlebury", rectified_camera("cam0", *size, *left), rectified_camera("cam1", *size, *right),
                      Pose::from_translation({-kMillimetre_m * *baseline_mm, 0, 0})),
      path);
  if (!rig) return failure(std::move(rig));
  return LoadedRig{std::move(*rig), CalibrationFormat::middlebury, {path}, {}, kBodyIsLeftCamera, {}};
}

Result<CalibrationFiles> internal::write_middlebury_calib(const Rig& rig, const std::string& path) {
  const auto pair = rectified_pinholes(rig, CalibrationFormat::middlebury);
  if (!pair) return failure(pair);
  const Camera &left = *pair->cameras.left, &right = *pair->cameras.right;
  if (left.size != right.size) return cannot_hold(right, "middlebury holds cameras of one image size only");
  return CalibrationFiles{{path, fmt::format("cam0={}\ncam1={}\ndoffs={}\nbaseline={}\nwidth={}\nheight={}\n",
                                             matrix(pair->left), matrix(pair->right), pair->right.cx - pair->left.cx,
                                             pair->baseline_m / kMillimetre_m, left.size.width, left.size.height)}};
}

}  // namespace spartan
