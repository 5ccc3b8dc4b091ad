// SN….conf of ZED cameras: sections LEFT_CAM_HD, RIGHT_CAM_HD of each resolution, LEFT_DISTO, RIGHT_DISTO and STEREO,
// in millimetres and radians. Source: the programs of Stereolabs that write and read it (zed-opencv-calibration:
// StereoCalib, saveCalibZED). x_right = R x_left + T with R by the rotation vector (RX, CV, RZ) and T = (−Baseline, TY,
// TZ), in optical axes. The sample of zed-open-capture takes T = (Baseline, TY, TZ), which turns the sign of TY and TZ,
// some tenths of a millimetre, against the baseline.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
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
// Beyond these the units are others.
constexpr double kLeastBaseline_mm = 1, kFarthest_mm = 1e4, kLargestRotation_rad = 1;

struct ZedResolution {
  const char* name;
  ImageSize size;
};
constexpr std::array<ZedResolution, 8> kResolutions{{{"4k", {3840, 2160}},
                                                     {"qhdplus", {3200, 1800}},
                                                     {"2k", {2208, 1242}},
                                                     {"fhd1200", {1920, 1200}},
                                                     {"fhd", {1920, 1080}},
                                                     {"hd", {1280, 720}},
                                                     {"svga", {960, 600}},
                                                     {"vga", {672, 376}}}};
// As in the files; the first five are those of a section of one resolution.
constexpr std::array<const char*, 8> kCoefficients{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};

std::string text_of(ImageSize size) {
  return fmt::format("{}x{}", size.width, size.height);
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  return text;
}
std::string upper_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) { return c >= 'a' && c <= 'z' ? c - 32 : c; });
  return text;
}

using ZedSections = std::map<std::string, TextMatrices>;

// The sections by their names, in lower case as their keys. Each is parsed behind as many empty lines as the file has
// lines before it, so that the numbers of its lines are those of the file.
Result<ZedSections> sections_of(const std::string& path) {
  const auto text = read_calibration_text(path);
  if (!text) return failure(text);
  std::map<std::string, std::string> lines;
  std::string name, above;  // `above`: as many ends of lines as there are lines above this one
  for (std::size_t begin = 0; begin < text->size(); above += '\n') {
    const std::size_t end = std::min(text->find('\n', begin), text->size());
    const std::string line = lower_case(trimmed(text->substr(begin, end - begin)));
    begin = end + 1;
    if (line.starts_with('[') && line.ends_with(']')) {
      name = trimmed(line.substr(1, line.size() - 2));
      if (!lines.try_emplace(name, above + '\n').second) {
        return failure(ErrorCode::configuration, fmt::format("the section [{}] is there twice", upper_case(name)),
                       fmt::format("{}:{}", path, above.size() + 1));
      }
    } else if (!name.empty()) {
      lines[name] += line + '\n';
    }
  }
  ZedSections sections;
  for (const auto& [key, content] : lines) sections.emplace(key, TextMatrices::parse(content, path, '='));
  return sections;
}

Result<const TextMatrices*> section_named(const ZedSections& sections, const std::string& name,
                                          const std::string& path) {
  const auto found = sections.find(name);
  if (found != sections.end()) return &found->second;
  return failure(ErrorCode::configuration, fmt::format("the section [{}] is missing", upper_case(name)), path);
}

Result<double> number(const TextMatrices& section, const std::string& key) {
  const auto numbers = section.numbers(key, 1);
  if (!numbers) return failure(numbers);
  return numbers->front();
}

// The first `count` of kCoefficients; 0 for those that are not there, but for k1 and k2.
Result<RadialTangentialModel::Coefficients> read_coefficients(const TextMatrices& section, std::size_t count) {
  RadialTangentialModel::Coefficients k{};
  for (std::size_t i = 0; i < count; ++i) {
    if (i >= 2 && !section.has(kCoefficients[i])) continue;
    const auto value = number(section, kCoefficients[i]);
    if (!value) return failure(value);
    k[i] = *value;
  }
  return k;
}

// Stereolabs marks the coefficients of cv::fisheye, k1 to k4, by p1 = p2 = 0.
bool is_fisheye(const RadialTangentialModel::Coefficients& k) {
  return k[2] == 0 && k[3] == 0 && k[4] != 0 && k[5] != 0;
}

Result<CameraModel> read_zed_model(const ZedSections& sections, const TextMatrices& camera, const std::string& side) {
  std::array<double, 4> core{};
  const std::array<const char*, 4> keys{"fx", "fy", "cx", "cy"};
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto value = number(camera, keys[i]);
    if (!value) return failure(value);
    if (i < 2 && !(*value > 0)) return camera.error_at(keys[i], "the focal length must be above zero");
    core[i] = *value;
  }
  const PinholeModel pinhole{core[0], core[1], core[2], core[3]};
  const auto all = sections.find(side + "_disto");
  const auto k = all == sections.end() ? read_coefficients(camera, 5) : read_coefficients(all->second, 8);
  if (!k) return failure(k);
  const auto& c = *k;
  if (is_fisheye(c)) return EquidistantModel(pinhole, {c[0], c[1], c[4], c[5]});
  return RadialTangentialModel(pinhole, c);
}

Result<Camera> read_zed_camera(const ZedSections& sections, const std::string& path, const std::string& side,
                               const ZedResolution& resolution) {
  const auto section = section_named(sections, fmt::format("{}_cam_{}", side, resolution.name), path);
  if (!section) return failure(section);
  auto model = read_zed_model(sections, **section, side);
  if (!model) return failure(std::move(model));
  Camera camera;
  camera.name = side;
  camera.size = resolution.size;
  camera.model = std::move(*model);
  return camera;
}

// TY and TZ of one resolution or of all; 0 where the file has none.
Result<double> read_offset_mm(const TextMatrices& stereo, const std::string& key, const std::string& resolution) {
  for (const std::string& name : {fmt::format("{}_{}", key, resolution), key}) {
    if (!stereo.has(name)) continue;
    auto value = number(stereo, name);
    if (value && std::abs(*value) > kFarthest_mm) return stereo.error_at(name, "must be in millimetres");
    return value;
  }
  return 0.0;
}

Result<Pose> read_right_from_left(const TextMatrices& stereo, const std::string& resolution) {
  const auto baseline = number(stereo, "baseline");
  if (!baseline) return failure(baseline);
  if (!(*baseline > kLeastBaseline_mm) || *baseline > kFarthest_mm) {
    return stereo.error_at("baseline",
                           fmt::format("must be in millimetres, {} to {}", kLeastBaseline_mm, kFarthest_mm));
  }
  const auto ty = read_offset_mm(stereo, "ty", resolution), tz = read_offset_mm(stereo, "tz", resolution);
  if (!ty) return failure(ty);
  if (!tz) return failure(tz);
  Eigen::Vector3d vector;
  for (const auto& [row, key] : {std::pair{0, "rx_"}, {1, "cv_"}, {2, "rz_"}}) {
    const auto angle = number(stereo, key + resolution);
    if (!angle) return failure(angle);
    vector[row] = *angle;
  }
  const auto rotation = rotation_of_vector(vector);
  if (!rotation || vector.norm() > kLargestRotation_rad) {
    return stereo.error_at("rx_" + resolution, fmt::format("with CV and RZ must be a rotation vector of at most {} rad",
                                                           kLargestRotation_rad));
  }
  return Pose(*rotation, kMillimetre_m * Eigen::Vector3d(-*baseline, *ty, *tz));
}

Result<ZedResolution> choose_resolution(const ZedSections& sections, const std::string& path, ImageSize size) {
  std::vector<ZedResolution> there;
  for (const ZedResolution& resolution : kResolutions) {
    if (sections.contains(fmt::format("left_cam_{}", resolution.name))) there.push_back(resolution);
  }
  if (there.empty())
    return failure(ErrorCode::configuration, "is no calibration of a ZED: it has no section as [LEFT_CAM_HD]", path);
  for (const ZedResolution& resolution : there) {
    if (resolution.size == size || (size.empty() && there.size() == 1)) return resolution;
  }
  std::vector<std::string> sizes;
  sizes.reserve(there.size());
  for (const ZedResolution& resolution : there) sizes.push_back(text_of(resolution.size));
  if (!size.empty()) {
    return failure(ErrorCode::configuration,
                   fmt::format("has no cameras of {} pixels, but of {}", text_of(size), fmt::join(sizes, ", ")), path);
  }
  return failure(ErrorCode::configuration,
                 fmt::format("has cameras of several image sizes: {}", fmt::join(sizes, ", ")), path,
                 "state the size of your images: rig convert --size-px");
}

// What a camera has in the files: k1 k2 p1 p2 k3 k4 k5 k6. `all`: in a section of its own.
struct ZedCoefficients {
  PinholeModel pinhole;
  RadialTangentialModel::Coefficients k{};
  bool all = false;
};

Result<ZedCoefficients> zed_coefficients(const Camera& camera) {
  if (const auto model = converted_to<RadialTangentialModel>(camera.model)) {
    const auto& k = model->coefficients();
    if (is_fisheye(k)) return cannot_hold(camera, "zed would hold these coefficients as those of a fisheye lens");
    return ZedCoefficients{model->pinhole(), k, is_rational(*model)};
  }
  const auto fisheye = converted_to<EquidistantModel>(camera.model);
  if (!fisheye) return cannot_hold(camera, fmt::format("zed does not support the model {}", name_of(camera.model)));
  const auto& k = fisheye->coefficients();
  const ZedCoefficients held{fisheye->pinhole(), {k[0], k[1], 0, 0, k[2], k[3], 0, 0}, true};
  if (!is_fisheye(held.k)) return cannot_hold(camera, "zed holds fisheye lenses whose k3 and k4 are not 0 only");
  return held;
}

std::string coefficients_text(const ZedCoefficients& camera, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += fmt::format("{}={}\n", kCoefficients[i], camera.k[i]);
  return text + "\n";
}

std::string camera_text(const char* side, const std::string& resolution, const ZedCoefficients& camera) {
  const PinholeModel& p = camera.pinhole;
  const std::string text =
      fmt::format("[{}_CAM_{}]\nfx={}\nfy={}\ncx={}\ncy={}\n", side, resolution, p.fx, p.fy, p.cx, p.cy);
  if (!camera.all) return text + coefficients_text(camera, 5);
  return text + fmt::format("\n[{}_DISTO]\n", side) + coefficients_text(camera, kCoefficients.size());
}

}  // namespace

Result<LoadedRig> read_zed_calib(const std::string& path, ImageSize size) {
  const auto sections = sections_of(path);
  if (!sections) return failure(sections);
  const auto resolution = choose_resolution(*sections, path, size);
  if (!resolution) return failure(resolution);
  const auto left = read_zed_camera(*sections, path, "left", *resolution);
  if (!left) return failure(left);
  const auto right = read_zed_camera(*sections, path, "right", *resolution);
  if (!right) return failure(right);
  const auto stereo = section_named(*sections, "stereo", path);
  if (!stereo) return failure(stereo);
  const auto right_from_left = read_right_from_left(**stereo, resolution->name);
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
    return cannot_hold(
        left, fmt::format("zed holds two cameras of one image size of a ZED, this one has {}", text_of(left.size)));
  }
  const auto left_held = zed_coefficients(left), right_held = zed_coefficients(right);
  if (!left_held) return failure(left_held);
  if (!right_held) return failure(right_held);
  const Pose right_from_left = rig.right_from_left(*pair->pair);
  const Eigen::Vector3d t = right_from_left.translation() / kMillimetre_m, r = log_so3(right_from_left.rotation());
  if (!(-t.x() > kLeastBaseline_mm) || t.cwiseAbs().maxCoeff() > kFarthest_mm || r.norm() > kLargestRotation_rad)
    return cannot_hold(right, "zed holds a right camera to the right of the left one, within 10 m and 1 rad, only");
  const std::string name = upper_case(resolution->name);
  const std::string stereo =
      fmt::format("[STEREO]\nBaseline={}\nTY={}\nTZ={}\nCV_{name}={}\nRX_{name}={}\nRZ_{name}={}\n", -t.x(), t.y(),
                  t.z(), r.y(), r.x(), r.z(), fmt::arg("name", name));
  return CalibrationFiles{
      {path, camera_text("LEFT", name, *left_held) + camera_text("RIGHT", name, *right_held) + stereo}};
}

}  // namespace spartan
