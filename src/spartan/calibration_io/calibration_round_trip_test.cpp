// Random rigs through every format that supports them, and through chains of two formats: nothing is lost.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <set>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/rig/describe.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using testing::TemporaryFolder;
using Format = CalibrationFormat;

struct FormatCase {
  Format format;
  const char* path;
  std::vector<const char*> models;  // names of any_model()
  bool body, left_camera;           // which body frames it supports: any, the left camera
  bool sizes;                       // an image size for each camera
  std::vector<ImageSize> only{};    // the image sizes that it supports; empty: any
};
const std::vector<FormatCase> kFormatCases{
    {Format::rig_yaml,
     "rig.yaml",
     {"pinhole", "radtan4", "radtan5", "radtan8", "equidistant", "two_terms", "double_sphere", "cahv", "cahvor",
      "cahvore"},
     true,
     true,
     true},
    {Format::kitti, "calib.txt", {"pinhole"}, false, true, false},
    {Format::kitti_raw, "calib_cam_to_cam.txt", {"pinhole"}, true, true, false},
    {Format::euroc, "mav0", {"pinhole", "radtan4", "two_terms", "equidistant", "double_sphere"}, true, false, true},
    {Format::kalibr,
     "camchain.yaml",
     {"pinhole", "radtan4", "two_terms", "equidistant", "double_sphere"},
     true,
     true,
     true},
    {Format::opencv,
     "stereo.yml",
     {"pinhole", "radtan4", "two_terms", "radtan5", "radtan8", "equidistant"},
     false,
     true,
     false},
    {Format::opencv,
     "stereo.xml",
     {"pinhole", "radtan4", "two_terms", "radtan5", "radtan8", "equidistant"},
     false,
     true,
     false},
    {Format::ros,
     "camera_info.yaml",
     {"pinhole", "radtan4", "two_terms", "radtan5", "radtan8", "equidistant"},
     false,
     true,
     true},
    {Format::mrcal,
     "pair.cameramodel",
     {"pinhole", "radtan4", "two_terms", "radtan5", "radtan8", "cahvor", "cahvore"},
     true,
     true,
     true},
    {Format::tsai, "pair.tsai", {"pinhole", "radtan4", "two_terms", "radtan5"}, true, true, false},
    {Format::middlebury, "calib.txt", {"pinhole"}, false, true, false},
    {Format::zed,
     "SN1234.conf",
     {"pinhole", "radtan4", "two_terms", "radtan5", "radtan8", "equidistant"},
     false,
     true,
     false,
     {{3840, 2160}, {3200, 1800}, {2208, 1242}, {1920, 1200}, {1920, 1080}, {1280, 720}, {960, 600}, {672, 376}}},
    {Format::cahvor,
     "pair.cahvor",
     {"pinhole", "radtan4", "two_terms", "radtan5", "radtan8", "cahv", "cahvor", "cahvore"},
     true,
     true,
     true},
};

// Formats of rectified pairs only.
bool is_rectified(Format format) {
  return format == Format::kitti || format == Format::kitti_raw || format == Format::middlebury;
}

double between(double low, double high) {
  constexpr int kSteps = 1 << 30;
  return low + (high - low) * *rc::gen::inRange(0, kSteps) / kSteps;
}

Eigen::Vector3d any_vector(double most) {
  return {between(-most, most), between(-most, most), between(-most, most)};
}

// Only "cahv" has a skew, because mrcal's files do not support it.
CameraModel any_model(const std::string& kind) {
  const PinholeModel pinhole{between(300, 1500), between(300, 1500), between(0, 1300), between(0, 1000)};
  const auto k = [] { return between(-0.1, 0.1); };
  const Eigen::Vector3d axis = Eigen::Vector3d(between(-0.05, 0.05), between(-0.05, 0.05), 1).normalized();
  if (kind == "radtan4") return RadialTangentialModel(pinhole, {k(), k(), k() / 10, k() / 10});
  if (kind == "two_terms") return RadialTangentialModel(pinhole, {k(), k()});
  if (kind == "radtan5") return RadialTangentialModel(pinhole, {k(), k(), k() / 10, k() / 10, k()});
  if (kind == "radtan8") return RadialTangentialModel(pinhole, {k(), k(), k() / 10, k() / 10, k(), k(), k(), k()});
  if (kind == "equidistant") return EquidistantModel(pinhole, {k(), k(), k(), k()});
  if (kind == "double_sphere") return DoubleSphereModel{pinhole, between(-0.5, 0.9), between(0, 1)};
  if (kind == "cahv") return CahvModel{pinhole, between(0.001, 2)};
  if (kind == "cahvor") return CahvorModel({pinhole, 0}, axis, {k(), k(), k()});
  if (kind == "cahvore") {
    const double linearity = *rc::gen::element(1.0, 0.0, between(-1, 1));
    return CahvoreModel({pinhole, 0}, axis, {k(), k(), k()}, {k() / 10, k() / 10, k() / 10}, linearity);
  }
  return pinhole;
}

Camera any_camera(const char* name, const std::string& kind, ImageSize size) {
  Camera camera;
  camera.name = name;
  camera.size = size;
  camera.model = any_model(kind);
  camera.pixel_format.layout = *rc::gen::element(PixelLayout::gray, PixelLayout::rgb, PixelLayout::bayer_gbrg);
  camera.pixel_format.bits = *rc::gen::element(8, 12);
  camera.pixel_format.alignment = *rc::gen::element(BitAlignment::low, BitAlignment::high);
  if (*rc::gen::arbitrary<bool>()) camera.vignetting.coefficients = {between(-0.3, -0.1), between(0.01, 0.1)};
  if (*rc::gen::arbitrary<bool>()) camera.vignetting.centre_px = {between(0, 1300), between(0, 1000)};
  if (*rc::gen::arbitrary<bool>()) camera.self_mask = "masks/" + camera.name + ".png";
  return camera;
}

ImageSize any_size() {
  return {*rc::gen::inRange(2, 5000), *rc::gen::inRange(2, 5000)};
}

// The keys that only rig.yaml supports and whose values differ from their defaults.
std::set<std::string> native_only_keys(const Rig& rig) {
  std::set<std::string> keys;
  for (const Camera& camera : rig.cameras) {
    const auto add = [&](bool differs, const char* key) {
      if (differs) keys.insert("cameras." + camera.name + "." + key);
    };
    add(camera.pixel_format.layout != PixelLayout::gray, "pixel_layout");
    add(camera.pixel_format.bits != 8, "bits");
    add(camera.pixel_format.alignment != BitAlignment::low, "bit_alignment");
    add(!camera.vignetting.coefficients.empty(), "vignetting");
    add(camera.vignetting.centre_px.has_value(), "vignetting_centre_px");
    add(!camera.self_mask.empty(), "self_mask");
  }
  return keys;
}

// A rig of one pair, optionally rectified. With `body`, the left camera looks roughly forward in a REP-103 body frame.
Rig any_rig(const std::string& kind, bool body, bool rectified, bool sizes, const std::vector<ImageSize>& only = {}) {
  const ImageSize size = only.empty() ? any_size() : *rc::gen::elementOf(only);
  Camera left = any_camera("left", kind, size), right = any_camera("right", kind, sizes ? any_size() : size);
  Pose right_from_left = Pose::from_translation({-between(0.01, 2), 0, 0});
  if (rectified) {
    const auto of_right = std::get<PinholeModel>(right.model);
    auto same_rows = std::get<PinholeModel>(left.model);
    same_rows.cx = of_right.cx;
    right.model = same_rows;
  } else {
    right_from_left =
        Pose(exp_so3(any_vector(0.3)), {right_from_left.translation().x(), between(-1, 1), between(-1, 1)});
  }
  Rig rig = rig_of_one_pair("any", left, right, right_from_left);
  if (!body) return rig;
  const Pose moved(exp_so3(any_vector(0.4)), any_vector(3));
  for (Camera& camera : rig.cameras) camera.mount_from_camera = moved * camera.mount_from_camera;
  rig.convention = PoseConvention::body;
  return rig;
}

Result<LoadedRig> round_trip(const Rig& rig, const FormatCase& format_case, const TemporaryFolder& folder) {
  const auto files = to_calibration_files(rig, format_case.format, folder.path() + "/" + format_case.path);
  if (!files) return failure(files);
  for (const CalibrationFile& file : *files) folder.write(file.path.substr(folder.path().size() + 1), file.content);
  const bool two = has_file_per_camera(format_case.format);
  const std::string path = two ? (*files)[0].path + "," + (*files)[1].path : (*files)[0].path;
  return read_calibration(path, rig.cameras[0].size);
}

// Differences that are reported but not expected, and expected ones that are not reported.
std::string unexpected_differences(const Rig& wanted, const Rig& got, Format format) {
  std::string text;
  std::set<std::string> expected = format == Format::rig_yaml ? std::set<std::string>() : native_only_keys(wanted);
  for (const RigDifference& each : describe_differences(wanted, got)) {
    if (each.key.ends_with("name") || expected.erase(each.key) > 0) continue;
    text += each.key + ": " + each.text + "\n";
  }
  for (const std::string& key : expected) text += key + ": lost without a report\n";
  return text;
}

// Compares the extrinsics of the pair and the parameters of the models, independent of describe_differences().
void expect_same(const Rig& wanted, const Rig& got) {
  const Pose was = wanted.right_from_left(wanted.pairs[0]), is = got.right_from_left(got.pairs[0]);
  RC_ASSERT((was.translation() - is.translation()).norm() <= 1e-12);
  RC_ASSERT(rotation_angle(was.inverse() * is) <= 1e-12);
  const std::vector<std::pair<std::string, std::string>> names{{wanted.pairs[0].left, got.pairs[0].left},
                                                               {wanted.pairs[0].right, got.pairs[0].right}};
  for (const auto& [a, b] : names) {
    const ModelParameters numbers = parameters(simplest_equivalent(wanted.find_camera(a)->model));
    const ModelParameters others = parameters(simplest_equivalent(got.find_camera(b)->model));
    RC_ASSERT(numbers.size() == others.size());
    for (std::size_t list = 0; list < numbers.size(); ++list) {
      for (std::size_t i = 0; i < std::max(numbers[list].size(), others[list].size()); ++i) {
        const double x = i < numbers[list].size() ? numbers[list][i] : 0;
        const double y = i < others[list].size() ? others[list][i] : 0;
        // H and V combine principal point, focal length and skew: rounding is relative to their norm.
        const double scale = list < 3 && numbers[0][0] > 100 ? 2000 : 1;
        RC_ASSERT(std::abs(x - y) <= 1e-12 * scale);
      }
    }
  }
}

RC_GTEST_PROP(CalibrationRoundTrip, EveryFormatPreservesWhatItSupports, ()) {
  const FormatCase format_case = *rc::gen::elementOf(kFormatCases);
  const std::string kind = *rc::gen::elementOf(format_case.models);
  const bool body = format_case.body && (!format_case.left_camera || *rc::gen::arbitrary<bool>());
  const bool rectified = is_rectified(format_case.format);
  const Rig rig = any_rig(kind, body, rectified, format_case.sizes, format_case.only);
  RC_PRE(rig.validation_errors().empty());
  RC_CLASSIFY(true, std::string(format_case.path) + " " + kind);
  const TemporaryFolder folder;
  const auto read = round_trip(rig, format_case, folder);
  if (!read) RC_FAIL(std::string(format_case.path) + ", " + kind + ": " + read.error().message());
  RC_ASSERT(read->format == format_case.format);
  const std::string lost = unexpected_differences(rig, read->rig, format_case.format);
  if (!lost.empty()) RC_FAIL(std::string(format_case.path) + ", " + kind + ": " + lost);
  expect_same(rig, read->rig);
}

// A → B → A, if both support the model and the body frame.
RC_GTEST_PROP(CalibrationRoundTrip, ChainsLoseNothing, ()) {
  const FormatCase a = *rc::gen::elementOf(kFormatCases), b = *rc::gen::elementOf(kFormatCases);
  const std::string kind = *rc::gen::elementOf(a.models);
  const bool held = std::any_of(b.models.begin(), b.models.end(), [&](const char* m) { return kind == m; });
  const bool by_body = a.body && b.body, by_left = a.left_camera && b.left_camera;
  RC_PRE(held && (by_body || by_left));
  const Rig rig =
      any_rig(kind, by_body && (!by_left || *rc::gen::arbitrary<bool>()),
              is_rectified(a.format) || is_rectified(b.format), a.sizes && b.sizes, a.only.empty() ? b.only : a.only);
  RC_PRE(rig.validation_errors().empty());
  const TemporaryFolder first, second, third;
  const auto of_a = round_trip(rig, a, first);
  if (!of_a) RC_FAIL(of_a.error().message());
  const auto of_b = round_trip(of_a->rig, b, second);
  if (!of_b) RC_FAIL(of_b.error().message());
  const auto again = round_trip(of_b->rig, a, third);
  if (!again) RC_FAIL(again.error().message());
  const std::string lost =
      unexpected_differences(of_a->rig, again->rig, b.format == Format::rig_yaml ? a.format : b.format);
  if (!lost.empty()) RC_FAIL(std::string(a.path) + " → " + b.path + ", " + kind + ": " + lost);
  expect_same(of_a->rig, again->rig);
}

PixelFormat any_pixel_format() {
  PixelFormat format;
  format.layout = *rc::gen::element(PixelLayout::gray, PixelLayout::rgb, PixelLayout::bayer_rggb,
                                    PixelLayout::bayer_grbg, PixelLayout::bayer_gbrg, PixelLayout::bayer_bggr);
  format.bits = *rc::gen::inRange(8, 17);
  if (format.bits > 8 && *rc::gen::arbitrary<bool>()) format.alignment = BitAlignment::high;
  return format;
}

// Mounts the pair on a mast, with random pixel formats and flags.
void put_on_mast(Rig& rig) {
  PanTiltUnit mast;
  mast.body_from_base = Pose(exp_so3(any_vector(0.1)), any_vector(1));
  mast.rest_pan_rad = between(-0.2, 0.2);
  mast.rest_tilt_rad = between(-0.2, 0.2);
  rig.pan_tilt_units.push_back(mast);
  for (Camera& camera : rig.cameras) {
    camera.mount = mast.name;
    camera.pixel_format = any_pixel_format();
    camera.self_mask = *rc::gen::element("", "masks/one.png");
  }
  rig.pairs[0].nearest_m = between(0, 3);
  rig.pairs[0].for_odometry = *rc::gen::arbitrary<bool>();
}

// Every property of a rig, bit for bit.
RC_GTEST_PROP(CalibrationRoundTrip, RigYamlPreservesEverything, ()) {
  Rig rig = any_rig(*rc::gen::elementOf(kFormatCases[0].models), true, false, true);
  put_on_mast(rig);
  for (const char* name : {"below_left", "below_right"}) {
    Camera camera = any_camera(name, *rc::gen::elementOf(kFormatCases[0].models), any_size());
    camera.mount_from_camera = Pose(exp_so3(any_vector(2)), any_vector(3));
    camera.pixel_format = any_pixel_format();
    camera.vignetting.coefficients = {between(-0.3, 0), between(-0.1, 0.1)};
    if (*rc::gen::arbitrary<bool>()) {
      camera.vignetting.centre_px =
          Eigen::Vector2d(between(0, camera.size.width - 1), between(0, camera.size.height - 1));
    }
    rig.cameras.push_back(camera);
  }
  rig.pairs.push_back({"below", "below_left", "below_right", between(0, 1), *rc::gen::arbitrary<bool>()});
  RC_PRE(rig.validation_errors().empty());
  const TemporaryFolder folder;
  const auto read = round_trip(rig, kFormatCases[0], folder);
  if (!read) RC_FAIL(read.error().message());
  RC_ASSERT(read->rig == rig);
}

// Other formats do not support pan-tilt units, pixel formats and minimum distances: they are dropped and reported.
// Camera poses are those at the rest angles.
RC_GTEST_PROP(CalibrationRoundTrip, DroppedPropertiesAreReported, ()) {
  const FormatCase format_case = kFormatCases[*rc::gen::inRange<std::size_t>(1, kFormatCases.size())];
  const std::string kind = *rc::gen::elementOf(format_case.models);
  const bool rectified = is_rectified(format_case.format);
  const Rig plain = any_rig(kind, true, rectified, format_case.sizes, format_case.only);
  Rig rig = plain;
  put_on_mast(rig);
  RC_PRE(rig.validation_errors().empty());
  const TemporaryFolder folder;
  const auto read = round_trip(rig, format_case, folder);
  if (!read) RC_FAIL(std::string(format_case.path) + ", " + kind + ": " + read.error().message());
  std::set<std::string> lost;
  for (const RigDifference& each : describe_differences(rig, read->rig)) lost.insert(each.key);
  std::set<std::string> wanted = native_only_keys(rig);
  wanted.insert("pan_tilt_units.mast");
  const std::string pair = "pairs." + rig.pairs[0].name + ".";
  if (rig.pairs[0].nearest_m != 0) wanted.insert(pair + "nearest_m");
  if (!rig.pairs[0].for_odometry) wanted.insert(pair + "for_odometry");
  if (!format_case.body) wanted.insert({"body", "pose_convention"});
  std::erase_if(lost, [](const std::string& key) { return key.ends_with("name"); });
  RC_ASSERT(lost == wanted);
  expect_same(rig, read->rig);
}

// Formats for any number of cameras keep all of them.
RC_GTEST_PROP(CalibrationRoundTrip, AdditionalCamerasAreKept, ()) {
  const FormatCase format_case =
      *rc::gen::elementOf(std::vector<FormatCase>{kFormatCases[0], kFormatCases[3], kFormatCases[4]});
  Rig rig = any_rig("radtan4", true, false, true);
  const int more = *rc::gen::inRange(1, 4);
  for (int i = 0; i < more; ++i) {
    Camera camera = any_camera(("more" + std::to_string(i)).c_str(), "equidistant", {640, 480});
    camera.mount_from_camera = Pose(exp_so3(any_vector(2)), any_vector(3));
    rig.cameras.insert(rig.cameras.begin(), camera);  // before those of the pair
  }
  RC_PRE(rig.validation_errors().empty());
  const TemporaryFolder folder;
  const auto read = round_trip(rig, format_case, folder);
  if (!read) RC_FAIL(read.error().message());
  RC_ASSERT(read->rig.cameras.size() == rig.cameras.size());
  // The order is that of the files: first the pair.
  for (std::size_t i = 0; i < rig.cameras.size() && format_case.format != Format::rig_yaml; ++i) {
    const std::size_t at = (i + static_cast<std::size_t>(more)) % rig.cameras.size();
    const Camera& camera = rig.cameras[at];
    const Camera& kept = read->rig.cameras[i < 2 ? i : 2 + (at + 0)];
    RC_ASSERT(kept.size == camera.size);
    const Pose apart = camera.mount_from_camera.inverse() * kept.mount_from_camera;
    RC_ASSERT(apart.translation().norm() <= 1e-11);
    RC_ASSERT(rotation_angle(apart) <= 1e-11);
  }
}

}  // namespace
}  // namespace spartan
