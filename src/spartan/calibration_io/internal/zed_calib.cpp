// SN….conf of ZED cameras: sections LEFT_CAM_HD, RIGHT_CAM_HD of each resolution and STEREO, in millimetres and radians.
// Source: the calibration that the maker's zed-open-capture makes of the file: cv::stereoRectify with the rotation by the
// rotation vector (RX, CV, RZ) and the translation (Baseline, TY, TZ). Its baseline is positive where that of
// OpenCV's convention x_right = R x_left + T is negative, and rectification is the same for T and −T: so T is minus that
// translation.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_readers.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/calibration_io/internal/text_matrices.h"
#include "spartan/core/files.h"

namespace spartan {

using namespace internal;

namespace {

constexpr double kMillimetre_m = 1e-3;
// A shorter baseline is one in metres.
constexpr double kLeastBaseline_mm = 1;

struct ZedResolution {
  const char* name;
  ImageSize size;
};
constexpr std::array<ZedResolution, 6> kResolutions{{{"2k", {2208, 1242}},
                                                     {"fhd1200", {1920, 1200}},
                                                     {"fhd", {1920, 1080}},
                                                     {"hd", {1280, 720}},
                                                     {"svga", {960, 600}},
                                                     {"vga", {672, 376}}}};

std::string text_of(ImageSize size) {
  return fmt::format("{}x{}", size.width, size.height);
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  return text;
}

// The lines of a section, on the lines where they are in the file; in lower case.
class ZedFile {
 public:
  ZedFile(const std::string& text, std::string path) : text_(lower_case(text)), path_(std::move(path)) {}

  bool has(const std::string& section) const { return section_text(section).has_value(); }

  Result<TextMatrices> section(const std::string& name) const {
    const auto text = section_text(name);
    if (text) return TextMatrices::parse(*text, path_, '=');
    return failure(ErrorCode::configuration, fmt::format("the section [{}] is missing", name), path_);
  }

 private:
  std::optional<std::string> section_text(const std::string& name) const {
    std::string lines;
    bool inside = false, found = false;
    for (std::size_t begin = 0; begin < text_.size();) {
      const std::size_t end = std::min(text_.find('\n', begin), text_.size());
      const std::string_view line = std::string_view(text_).substr(begin, end - begin);
      if (line.starts_with('[')) {
        inside = line.starts_with("[" + name + "]");
        found = found || inside;
      } else if (inside) {
        lines += line;
      }
      lines += '\n';
      begin = end + 1;
    }
    return found ? std::optional(lines) : std::nullopt;
  }

  std::string text_, path_;
};

Result<double> number(const TextMatrices& section, const std::string& key) {
  const auto numbers = section.numbers(key, 1);
  if (!numbers) return failure(numbers);
  return numbers->front();
}

// The first of the keys that is there; the last one must be.
Result<double> first_number(const TextMatrices& section, const std::vector<std::string>& keys) {
  for (const std::string& key : keys) {
    if (section.has(key)) return number(section, key);
  }
  return number(section, keys.back());
}

Result<Camera> read_zed_camera(const ZedFile& file, const char* side, const ZedResolution& resolution) {
  const auto section = file.section(fmt::format("{}_cam_{}", side, resolution.name));
  if (!section) return failure(section);
  std::array<double, 4> core{};
  const std::array<const char*, 4> keys{"fx", "fy", "cx", "cy"};
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto value = number(*section, keys[i]);
    if (!value) return failure(value);
    if (i < 2 && !(*value > 0)) return section->error_at(keys[i], "the focal length must be above zero");
    core[i] = *value;
  }
  RadialTangentialModel::Coefficients k{};
  const std::array<const char*, 5> names{"k1", "k2", "p1", "p2", "k3"};  // old files have k1 and k2 alone
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i >= 2 && !section->has(names[i])) continue;
    const auto value = number(*section, names[i]);
    if (!value) return failure(value);
    k[i] = *value;
  }
  if (section->has("k4"))
    return section->error_at("k4", "is of a fisheye lens or of a rational model, which is not supported");
  Camera camera;
  camera.name = side;
  camera.size = resolution.size;
  camera.model = RadialTangentialModel({core[0], core[1], core[2], core[3]}, k);
  return camera;
}

Result<Pose> read_right_from_left(const ZedFile& file, const std::string& resolution) {
  const auto stereo = file.section("stereo");
  if (!stereo) return failure(stereo);
  const auto baseline = number(*stereo, "baseline");
  if (!baseline) return failure(baseline);
  if (!(*baseline > kLeastBaseline_mm))
    return stereo->error_at("baseline", fmt::format("must be in millimetres, above {}", kLeastBaseline_mm));
  const auto ty = first_number(*stereo, {"ty_" + resolution, "ty"}), tz = first_number(*stereo, {"tz_" + resolution, "tz"});
  if (!ty) return failure(ty);
  if (!tz) return failure(tz);
  Eigen::Vector3d vector;
  for (const auto& [row, key] : {std::pair{0, "rx_"}, {1, "cv_"}, {2, "rz_"}}) {
    const auto angle = number(*stereo, key + resolution);
    if (!angle) return failure(angle);
    vector[row] = *angle;
  }
  const auto rotation = rotation_of_vector(vector);
  if (!rotation) return stereo->error_at("rx_" + resolution, "with cv and rz is not a rotation vector in radians");
  return Pose(*rotation, -kMillimetre_m * Eigen::Vector3d(*baseline, *ty, *tz));
}

Result<ZedResolution> choose_resolution(const ZedFile& file, const std::string& path, ImageSize size) {
  std::vector<ZedResolution> there;
  for (const ZedResolution& resolution : kResolutions) {
    if (file.has(fmt::format("left_cam_{}", resolution.name))) there.push_back(resolution);
  }
  for (const ZedResolution& resolution : there) {
    if (resolution.size == size || (size.empty() && there.size() == 1)) return resolution;
  }
  std::vector<std::string> sizes;
  for (const ZedResolution& resolution : there) sizes.push_back(text_of(resolution.size));
  if (!size.empty()) {
    return failure(ErrorCode::configuration,
                   fmt::format("has no cameras of {} pixels, but of {}", text_of(size), fmt::join(sizes, ", ")), path);
  }
  return failure(ErrorCode::configuration,
                 fmt::format("has cameras of several image sizes: {}", fmt::join(sizes, ", ")), path,
                 "state the size of your images (rig convert --size-px)");
}

std::string camera_section(const char* side, const char* resolution, const RadialTangentialModel& model) {
  const PinholeModel& p = model.pinhole();
  const auto& k = model.coefficients();
  return fmt::format("[{}_CAM_{}]\nfx={}\nfy={}\ncx={}\ncy={}\nk1={}\nk2={}\np1={}\np2={}\nk3={}\n\n", side, resolution,
                     p.fx, p.fy, p.cx, p.cy, k[0], k[1], k[2], k[3], k[4]);
}

std::string upper_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) { return c >= 'a' && c <= 'z' ? c - 32 : c; });
  return text;
}

Result<RadialTangentialModel> zed_model(const Camera& camera) {
  const auto model = converted_to<RadialTangentialModel>(camera.model);
  if (!model) return cannot_hold(camera, fmt::format("zed does not support the model {}", name_of(camera.model)));
  if (is_rational(*model)) return cannot_hold(camera, "zed does not support the coefficients k4, k5, k6");
  return *model;
}

}  // namespace

Result<LoadedRig> read_zed_calib(const std::string& path, ImageSize size) {
  const auto text = read_calibration_text(path);
  if (!text) return failure(text);
  const ZedFile file(*text, path);
  const auto resolution = choose_resolution(file, path, size);
  if (!resolution) return failure(resolution);
  const auto left = read_zed_camera(file, "left", *resolution), right = read_zed_camera(file, "right", *resolution);
  if (!left) return failure(left);
  if (!right) return failure(right);
  const auto right_from_left = read_right_from_left(file, resolution->name);
  if (!right_from_left) return failure(right_from_left);
  auto rig = validated(rig_of_one_pair("zed", *left, *right, *right_from_left), path);
  if (!rig) return failure(std::move(rig));
  return LoadedRig{std::move(*rig), CalibrationFormat::zed, {path}, {}, kBodyIsLeftCamera, {}};
}

Result<CalibrationFiles> internal::write_zed_calib(const Rig& rig, const std::string& path) {
  const auto pair = single_pair(rig, CalibrationFormat::zed);
  if (!pair) return failure(pair);
  const Camera &left = *pair->left, &right = *pair->right;
  const auto* const resolution = std::find_if(kResolutions.begin(), kResolutions.end(), [&](const ZedResolution& r) {
    return r.size == left.size && r.size == right.size;
  });
  if (resolution == kResolutions.end()) {
    return cannot_hold(left, fmt::format("zed holds both cameras in one image size of a ZED, this one has {}",
                                         text_of(left.size)));
  }
  const auto left_model = zed_model(left), right_model = zed_model(right);
  if (!left_model) return failure(left_model);
  if (!right_model) return failure(right_model);
  const Pose right_from_left = rig.right_from_left(*pair->pair);
  const Eigen::Vector3d t = -right_from_left.translation() / kMillimetre_m, r = log_so3(right_from_left.rotation());
  if (!(t.x() > kLeastBaseline_mm)) return cannot_hold(right, "zed holds a right camera to the right of the left one only");
  const std::string name = upper_case(resolution->name);
  return CalibrationFiles{
      {path, camera_section("LEFT", name.c_str(), *left_model) + camera_section("RIGHT", name.c_str(), *right_model) +
                 fmt::format("[STEREO]\nBaseline={}\nTY={}\nTZ={}\nCV_{name}={}\nRX_{name}={}\nRZ_{name}={}\n", t.x(), t.y(), t.z(),
                             r.y(), r.x(), r.z(), fmt::arg("name", name))}};
}

}  // namespace spartan
