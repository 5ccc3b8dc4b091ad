// Truncated, damaged, random and inconsistent files: rejected, with file and line or key.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/numerics/random.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;
using Format = CalibrationFormat;

constexpr ImageSize kSize{640, 480};

// A format with a camera model that it represents completely.
struct Case {
  Format format;
  const char* path;
  CameraModel model;
  ImageSize size = kSize;
};

std::vector<Case> cases() {
  const PinholeModel pinhole{500, 501, 320, 240};
  const RadialTangentialModel brown(pinhole, {-0.2, 0.1, 0.001, 0.002});
  const CahvoreModel fisheye({pinhole, 0.5}, Eigen::Vector3d(0.01, 0, 1).normalized(), {0.01, 0.02, 0.03},
                             {0.001, 0, 0}, 0.5);
  const CahvorModel cahvor({pinhole, 0}, Eigen::Vector3d(0.01, 0, 1).normalized(), {0.01, 0.02, 0.03});
  return {{Format::rig_yaml, "rig.yaml", brown},
          {Format::kitti, "calib.txt", pinhole},
          {Format::kitti_raw, "calib_cam_to_cam.txt", pinhole},
          {Format::euroc, "mav0", brown},
          {Format::kalibr, "camchain.yaml", brown},
          {Format::opencv, "stereo.yml", brown},
          {Format::opencv, "stereo.xml", brown},
          {Format::ros, "camera_info.yaml", brown},
          {Format::mrcal, "pair.cameramodel", cahvor},
          {Format::tsai, "pair.tsai", brown},
          {Format::zed, "SN1.conf", brown, {672, 376}},
          {Format::cahvor, "pair.cahvore", fisheye}};
}

// The files of a valid rig in a temporary folder; the text of one of them can be replaced.
class Files {
 public:
  explicit Files(const Case& of) : of_(of) {
    Camera left, right;
    left.name = "left";
    right.name = "right";
    left.size = right.size = of.size;
    left.model = right.model = of.model;
    Rig rig = rig_of_one_pair("r", left, right, Pose::from_translation({-0.12, 0, 0}));
    if (of.format == Format::kitti_raw || of.format == Format::kalibr || of.format == Format::euroc) {
      rig.convention = PoseConvention::body;
      for (Camera& camera : rig.cameras)
        camera.mount_from_camera = Pose::from_translation({1, 2, 3}) * camera.mount_from_camera;
    }
    files_ = to_calibration_files(rig, of.format, folder_.path() + "/" + of.path).value();
    for (const CalibrationFile& file : files_) put(file, file.content);
  }

  const CalibrationFiles& all() const { return files_; }
  void put(const CalibrationFile& file, const std::string& text) const {
    folder_.write(file.path.substr(folder_.path().size() + 1), text);
  }
  void restore() const {
    for (const CalibrationFile& file : files_) put(file, file.content);
  }
  Result<LoadedRig> read() const {
    const bool two = has_file_per_camera(of_.format);
    return read_calibration(two ? files_[0].path + "," + files_[1].path : files_[0].path, of_.size);
  }
  // Reads the files: "accepted" for a valid rig, otherwise the message of an error that must name the folder.
  std::string outcome() const {
    const auto read = this->read();
    if (read) {
      EXPECT_TRUE(read->rig.validation_errors().empty());
      return "accepted";
    }
    EXPECT_EQ(read.error().code, ErrorCode::configuration) << read.error().message();
    EXPECT_THAT(read.error().message(), HasSubstr(folder_.path())) << "the message names no file";
    return read.error().message();
  }

 private:
  Case of_;
  TemporaryFolder folder_;
  CalibrationFiles files_;
};

TEST(BadCalibrations, UnchangedFilesAreAccepted) {
  for (const Case& each : cases()) EXPECT_EQ(Files(each).outcome(), "accepted") << each.path;
}

TEST(BadCalibrations, TruncatedAnywhere) {
  Random random(1);
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.path);
    const Files files(each);
    for (const CalibrationFile& file : files.all()) {
      std::vector<std::size_t> cuts{0, 1};
      for (std::size_t at = file.content.find('\n'); at != std::string::npos; at = file.content.find('\n', at + 1)) {
        cuts.push_back(at);
      }
      for (int i = 0; i < 60; ++i) cuts.push_back(random.below(static_cast<std::uint32_t>(file.content.size())));
      for (const std::size_t cut : cuts) {
        files.put(file, file.content.substr(0, cut));
        (void)files.outcome();
      }
      files.put(file, "");
      EXPECT_NE(files.outcome(), "accepted") << file.path;
      files.put(file, file.content.substr(0, file.content.size() / 2));
      EXPECT_NE(files.outcome(), "accepted") << file.path;
      if (std::string(each.path).ends_with(".xml")) {
        files.put(file, file.content.substr(0, file.content.rfind('<')));
        EXPECT_THAT(files.outcome(), HasSubstr("is truncated: </opencv_storage> is missing"));
      }
      files.restore();
    }
  }
}

// Positions and lengths of the numbers that follow a key.
std::vector<std::pair<std::size_t, std::size_t>> numbers_in(const std::string& text) {
  std::vector<std::pair<std::size_t, std::size_t>> places;
  const std::string in_number = "0123456789.e-+";
  for (std::size_t at = 0; at < text.size();) {
    const bool begins = (text[at] >= '0' && text[at] <= '9') ||
                        (text[at] == '-' && at + 1 < text.size() && text[at + 1] >= '0' && text[at + 1] <= '9');
    const bool alone = at == 0 || std::string(" [,\n>=").find(text[at - 1]) != std::string::npos;
    if (!begins || !alone) {
      ++at;
      continue;
    }
    const std::size_t end = std::min(text.find_first_not_of(in_number, at), text.size());
    places.emplace_back(at, end - at);
    at = end;
  }
  return places;
}

// The key that a position of the text belongs to: the last one before it of the form "key:", "key =", "'key':" or
// "<key>".
std::string key_before(const std::string& text, std::size_t at) {
  const std::string in_key = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789";
  for (std::size_t end = at;;) {
    const std::size_t begin = end == 0 ? 0 : text.rfind('\n', end - 1) + 1;
    const std::size_t first = text.find_first_not_of(" -'<", begin);
    const std::size_t behind = std::min(text.find_first_not_of(in_key, first), text.size());
    const std::size_t sign = text.find_first_not_of("' ", behind);
    const bool closed = sign < end && std::string(":=>t").find(text[sign]) != std::string::npos;
    if (first < behind && closed) return text.substr(first, behind - first);
    if (begin == 0) return "";
    end = begin - 1;
  }
}

// Numbers that the readers ignore because other programs need them, because they are redundant, or because the caller
// provides the image size.
const std::map<Format, std::set<std::string>> kUnread{
    {Format::kitti_raw, {"S_00", "K_00", "D_00", "R_00", "T_00", "S_01", "K_01", "D_01", "R_01", "T_01", "R_rect_01"}},
    {Format::euroc, {"rows", "cols"}},
    {Format::ros, {"rows", "cols"}},
    {Format::opencv, {"image_width", "image_height"}},
    {Format::cahvor, {"T", "P"}},
};

// Every number in turn: an invalid value must not be accepted for any number that is read.
TEST(BadCalibrations, InvalidNumbers) {
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.path);
    const Files files(each);
    const auto found = kUnread.find(each.format);
    const std::set<std::string> unread = found == kUnread.end() ? std::set<std::string>() : found->second;
    for (const CalibrationFile& file : files.all()) {
      for (const auto& [at, length] : numbers_in(file.content)) {
        const std::string key = key_before(file.content, at);
        for (const char* odd : {"nan", "-.inf", "1e999", "twelve", "-1e308"}) {
          std::string text = file.content;
          files.put(file, text.replace(at, length, odd));
          const std::string message = files.outcome();
          if (std::string(odd) == "-1e308" || unread.contains(key)) continue;
          EXPECT_NE(message, "accepted") << file.path << ": " << key << " as " << odd;
        }
      }
      files.restore();
    }
  }
}

TEST(BadCalibrations, FoldersAndMissingFiles) {
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.path);
    const Files files(each);
    const CalibrationFile& last = files.all().back();
    std::filesystem::remove(last.path);
    if (each.format != Format::kitti_raw) {
      EXPECT_THAT(files.outcome(), HasSubstr(last.path));
    }
    std::filesystem::create_directory(last.path);
    EXPECT_NE(files.outcome(), "accepted");
  }
}

std::string repeated(const std::string& text, std::size_t bytes) {
  std::string all;
  while (all.size() < bytes) all += text;
  return all;
}

// Ten megabytes are rejected because of their size; three megabytes are read and rejected because of their content.
TEST(BadCalibrations, LargeRandomFiles) {
  constexpr std::size_t kTen = 10U << 20U, kThree = 3U << 20U;
  Random random(7);
  std::string bytes(kTen, ' '), letters(kTen, ' ');
  for (char& c : bytes) c = static_cast<char>(random.below(256));
  for (char& c : letters) c = static_cast<char>(random.below(20) == 0 ? '\n' : 32 + random.below(95));
  for (const Case& each : cases()) {
    const Files files(each);
    for (const CalibrationFile& file : files.all()) {
      SCOPED_TRACE(file.path);
      for (const std::string* noise : {&bytes, &letters}) {
        files.put(file, *noise);
        const std::string message = files.outcome();
        EXPECT_NE(message, "accepted");
        if (each.format != Format::mrcal && (&file == &files.all().front())) {
          EXPECT_THAT(message, HasSubstr("is larger than 4 MB, so it is not a calibration file"));
        }
        files.put(file, noise->substr(0, kThree));
        EXPECT_NE(files.outcome(), "accepted");
        files.put(file, file.content.substr(0, file.content.size() / 2) + noise->substr(0, kThree));
        (void)files.outcome();
      }
      files.restore();
    }
  }
}

// Input that exhausts the stack of a recursive parser.
TEST(BadCalibrations, DeepNesting) {
  constexpr std::size_t kBytes = 1U << 16U;
  std::string stairs;
  for (std::size_t depth = 0; stairs.size() < kBytes; ++depth) stairs += std::string(depth, ' ') + "a:\n";
  const std::string texts[] = {repeated("[", kBytes),    repeated("{", kBytes),       repeated("- ", kBytes),
                               repeated("a: {", kBytes), repeated("{'a': [", kBytes), repeated("<a>", kBytes),
                               repeated("? ", kBytes),   repeated("!a ", kBytes),     repeated("&a [", kBytes),
                               repeated("\"", kBytes),   repeated("P0: 1 ", kBytes),  stairs};
  for (const Case& each : cases()) {
    const Files files(each);
    const CalibrationFile& file = files.all().front();
    for (const std::string& text : texts) {
      SCOPED_TRACE(file.path + ": " + text.substr(0, 8));
      for (const std::string& head :
           {std::string(), std::string("%YAML:1.0\n---\n"), std::string("<?xml version=\"1.0\"?>\n<opencv_storage>\n"),
            std::string("M1: "), std::string("cam0: "), std::string("{ 'lensmodel': ")}) {
        files.put(file, head + text);
        EXPECT_NE(files.outcome(), "accepted");
      }
    }
    files.restore();
  }
}

// Many errors: the message must be much shorter than the file.
TEST(BadCalibrations, ManyErrorsAreSummarized) {
  std::string text = "schema: 1\ncameras:\n";
  for (int i = 0; i < 900; ++i) text += fmt::format("  c{}: {{}}\n", i);
  const auto read = parse_rig_yaml(text, "rig.yaml");
  ASSERT_FALSE(read);
  EXPECT_LE(read.error().message().size(), 10000u);
  EXPECT_THAT(read.error().message(), HasSubstr("more errors"));
  for (int i = 900; i < 10000; ++i) text += fmt::format("  c{}: {{}}\n", i);
  EXPECT_THAT(parse_rig_yaml(text, "rig.yaml").error().message(),
              HasSubstr("rig.yaml:2: cameras: has 10000 entries, more than 1000"));
}

// A parsed YAML value takes hundreds of times its size in the file.
TEST(BadCalibrations, VeryLongListsAreNotParsed) {
  const std::string list = repeated("a,", 3U << 20U);
  const TemporaryFolder folder;
  for (const std::string& text :
       {"schema: [" + list + "a]\n", "cam0: {a: [" + list + "a]}\n",
        "%YAML:1.0\n---\nM1: !!opencv-matrix\n  rows: 1\n  cols: 1\n  data: [" + list + "a]\n",
        "schema:\n" + repeated("- a\n", 3U << 20U)}) {
    const auto read = read_calibration(folder.write("x.yaml", text), kSize);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message(), HasSubstr("x.yaml: holds more than 100000 values"));
  }
}

// Values that no camera has.
TEST(BadCalibrations, ImplausibleNumbersAreRejected) {
  const Files files(cases()[0]);
  const CalibrationFile& file = files.all()[0];
  const auto message = [&](const std::string& what, const std::string& with) {
    std::string text = file.content;
    files.put(file, text.replace(text.find(what), what.size(), with));
    return files.outcome();
  };
  EXPECT_THAT(message("focal_px: [500", "focal_px: [1e308"),
              HasSubstr("cameras.left.focal_px: holds 1e+308, must be above zero and at most 10000000"));
  EXPECT_THAT(message("centre_px: [320", "centre_px: [-1e9"),
              HasSubstr("cameras.left.centre_px: holds -1000000000, must be between -10000000 and 10000000"));
  EXPECT_THAT(message("translation_m: [0", "translation_m: [1e300"),
              HasSubstr(" is farther than 1000000000 m from the mount"));
  EXPECT_EQ(message("focal_px: [500", "focal_px: [1e6"), "accepted");
}

// --- messages of particular errors ---

struct Mistake {
  Format format;
  std::size_t file;
  const char *what, *with, *message;
};
const Mistake kMistakes[] = {
    {Format::rig_yaml, 0, "focal_px: [500", "focal_px: [0",
     "rig.yaml:8: cameras.left.focal_px: holds 0, must be above zero"},
    {Format::rig_yaml, 0, "size_px: [640", "size_px: [-640", "rig.yaml:6: cameras.left.size_px: is -640 × 480"},
    {Format::rig_yaml, 0, "quaternion_xyzw: [-0.5", "quaternion_xyzw: [-0.9", "quaternion_xyzw: has length"},
    {Format::kitti, 0, "P0: 500", "P0: 0", "calib.txt:1: P0: the focal lengths must be above zero"},
    {Format::kitti, 0, "P1: 500", "P1: -500", "calib.txt:2: P1: the focal lengths must be above zero"},
    {Format::kitti, 0, "-60", "60", "calib.txt:2: P1: gives a baseline of -0.12 m"},
    {Format::kitti_raw, 0, "S_rect_00: 640", "S_rect_00: 0", "calib_cam_to_cam.txt:6: S_rect_00"},
    {Format::kitti_raw, 1, "R: 0", "R: 3", "calib_velo_to_cam.txt:1: R: is not a rotation matrix"},
    {Format::euroc, 1, "intrinsics: [500", "intrinsics: [-500",
     "cam1/sensor.yaml:12: intrinsics: the focal lengths must be above"},
    {Format::euroc, 0, "resolution: [640", "resolution: [0.5", "cam0/sensor.yaml:10: resolution: must be two whole"},
    {Format::kalibr, 0, "- [0, 0, 0, 1]", "- [0, 0, 1, 1]",
     "camchain.yaml:2: cam0.T_cam_imu: is not a rigid transform"},
    {Format::kalibr, 0, "intrinsics: [500", "intrinsics: [0",
     "camchain.yaml:8: cam0.intrinsics: the focal lengths must be"},
    {Format::kalibr, 0, "resolution: [640, 480]", "resolution: [640]", "cam0.resolution: has 1 entries"},
    {Format::opencv, 0, "image_width: 640", "image_width: -640", "stereo.yml"},
    {Format::opencv, 0, "data: [ 500., ", "data: [ 0., ", "stereo.yml:5: M1: is not a camera matrix"},
    {Format::opencv, 0, "data: [ 1., 0., 0., 0., 1.", "data: [ 1., 0., 1., 0., 1.",
     "stereo.yml:27: R: is not a rotation matrix"},
    {Format::ros, 0, "image_width: 640", "image_width: 0",
     "camera_info_left.yaml:1: image_width: is 0, must be above zero"},
    {Format::ros, 1, "data: [500, 0", "data: [-500, 0",
     "camera_info_right.yaml:4: camera_matrix: the focal lengths must"},
    {Format::ros, 0, "data: [1, -0, -0, ", "data: [1, 1, -0, ",
     "left.yaml:13: rectification_matrix: is not a rotation matrix"},
    {Format::ros, 1, "projection_matrix", "projection", "right.yaml:1: projection_matrix: is missing"},
    {Format::mrcal, 0, "'intrinsics': [500", "'intrinsics': [0",
     "pair_left.cameramodel:5: intrinsics: the focal lengths must"},
    {Format::mrcal, 1, "'imagersize': [640", "'imagersize': [6.4",
     "pair_right.cameramodel:10: imagersize: must be two whole"},
    {Format::mrcal, 1, "'extrinsics': [", "'extrinsics': [1e9, ", "extrinsics: has 7 numbers, must have 6"},
    {Format::mrcal, 0, "'lensmodel':", "'lensmodel'", "pair_left.cameramodel:2: a colon is missing after 'lensmodel'"},
    {Format::tsai, 1, "fv = 501", "fv = 0", "pair_right.tsai:4: fv: the focal length must be above zero"},
    {Format::tsai, 0, "pitch = 1", "pitch = 0", "pair_left.tsai:12: pitch: is 0, must be above zero"},
    {Format::tsai, 0, "R = 1", "R = 2", "pair_left.tsai:11: R: is not a rotation matrix"},
    {Format::cahvor, 0, "A = ", "A = 1 ", "pair_left.cahvore:4: A: has 4 numbers, must have 3"},
    {Format::cahvor, 0, "A = 0 0 1", "A = 0 0 2", "pair_left.cahvore:4: A: has length 2, must have length 1"},
    {Format::cahvor, 0, "H = 500", "H = 0", "pair_left.cahvore:5: H: the focal length must be above zero"},
    {Format::cahvor, 1, "V = 0.5 501", "V = 0.5 -501", "pair_right.cahvore:6: V: the focal length must be above zero"},
    {Format::cahvor, 1, "Dimensions = 640", "Dimensions = -640", "pair_right.cahvore:2: Dimensions: must be two whole"},
};

TEST(BadCalibrations, ErrorsNameFileAndLineOrKey) {
  for (const Mistake& mistake : kMistakes) {
    for (const Case& each : cases()) {
      if (each.format != mistake.format || std::string(each.path).ends_with(".xml")) continue;
      const Files files(each);
      const CalibrationFile& file = files.all()[mistake.file];
      std::string text = file.content;
      const std::size_t at = text.find(mistake.what);
      ASSERT_NE(at, std::string::npos) << mistake.what << " in\n" << text;
      files.put(file, text.replace(at, std::string(mistake.what).size(), mistake.with));
      EXPECT_THAT(files.outcome(), HasSubstr(mistake.message));
    }
  }
}

}  // namespace
}  // namespace spartan
