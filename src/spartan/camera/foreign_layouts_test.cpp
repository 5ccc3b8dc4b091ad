// Recordings in the layouts of public data sets: KITTI odometry, KITTI raw, EuRoC; and detection of the layout.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TemporaryFolder;

const std::string kKittiCalib = "P0: 30 0 16 0 0 30 8 0 0 0 1 0\nP1: 30 0 16 -3 0 30 8 0 0 0 1 0\n";

class ForeignLayouts : public ::testing::Test {
 protected:
  void image(const std::string& name, int width = 32, int height = 16) {
    Image<std::uint8_t> pixels(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) pixels(x, y) = static_cast<std::uint8_t>((7 * x + 31 * y) % 256);
    }
    ASSERT_TRUE(write_png(folder_.file(name), pixels.view()));
  }
  std::string text_of(const std::string& name) { return read_file(folder_.path() + "/" + name).value(); }
  void remove(const std::string& name) { ASSERT_TRUE(std::filesystem::remove_all(folder_.path() + "/" + name) > 0); }

  std::unique_ptr<Recording> open(const OpenOptions& options = {}) {
    auto source = open_recording(folder_.path(), options);
    EXPECT_TRUE(source) << source.error().message();
    return source ? std::move(*source) : nullptr;
  }
  std::string rejection(const OpenOptions& options = {}) {
    const auto source = open_recording(folder_.path(), options);
    if (source) return "opened";
    EXPECT_EQ(source.error().code, ErrorCode::input);
    return source.error().message();
  }
  // "f0 f1 right_missing …": frames by id, missing frames by fault, IMU samples as i.
  std::vector<std::string> collect_samples(Recording& source) {
    std::vector<std::string> seen;
    while (true) {
      const auto sample = source.next();
      EXPECT_TRUE(sample) << sample.error().message();
      if (!sample || !*sample) return seen;
      if (const auto* frame = std::get_if<StereoFrame>(&**sample)) seen.push_back(fmt::format("f{}", frame->frame_id));
      if (const auto* missing = std::get_if<MissingFrame>(&**sample)) seen.emplace_back(name_of(missing->fault));
      if (std::holds_alternative<ImuSample>(**sample)) seen.emplace_back("i");
    }
  }
  TemporaryFolder folder_;
};

// --- KITTI odometry ---

class KittiLayout : public ForeignLayouts {
 protected:
  KittiLayout() {
    folder_.write("calib.txt", kKittiCalib);
    folder_.write("times.txt", "0.0\n1.036e-01\n2.07e-01\n0.31\n");
    for (int i = 0; i < 4; ++i) {
      for (const char* side : {"image_0", "image_1"}) image(fmt::format("{}/{:06}.png", side, i));
    }
  }
};

TEST_F(KittiLayout, ReadsFramesAndTruth) {
  auto source = open();
  EXPECT_EQ(source->info().format, RecordingFormat::kitti);
  EXPECT_THAT(source->info().layout_reason, HasSubstr("calib.txt and image_0 found"));
  EXPECT_EQ(source->info().truth_file, "");
  EXPECT_FALSE(source->info().has_imu);
  EXPECT_THAT(collect_samples(*source), ElementsAre("f0", "f1", "f2", "f3"));
  EXPECT_THAT(source->listed_stamps("stereo"),
              ElementsAre(Stamp{0}, Stamp{103'600'000}, Stamp{207'000'000}, Stamp{310'000'000}));
  EXPECT_EQ(source->frame_at("stereo", {207'000'000}).value().frame_id, 2);
  folder_.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  EXPECT_EQ(open()->info().truth_file, folder_.path() + "/poses.txt");
}

TEST_F(KittiLayout, SkipsFramesWithAMissingImage) {
  remove("image_1/000001.png");
  remove("image_0/000002.png");
  auto source = open();
  EXPECT_THAT(collect_samples(*source), ElementsAre("f0", "right_missing", "left_missing", "f3"));
  EXPECT_EQ(source->info().sequence.orphans_left, 1);
  EXPECT_EQ(source->info().sequence.orphans_right, 1);
  remove("image_1");
  EXPECT_THAT(rejection(), HasSubstr("none of the 4 listed stereo frames is usable"));
}

TEST_F(KittiLayout, AssumesTenHertzWithoutTimes) {
  remove("times.txt");
  auto source = open();
  EXPECT_THAT(source->info().layout_reason, HasSubstr("no times.txt: frames are assumed to be 0.1 s apart"));
  EXPECT_THAT(source->listed_stamps("stereo"),
              ElementsAre(Stamp{0}, Stamp{100'000'000}, Stamp{200'000'000}, Stamp{300'000'000}));
}

TEST_F(KittiLayout, RejectsInvalidTimes) {
  folder_.write("times.txt", "0\n0.1\nnan\n0.3\n");
  EXPECT_THAT(rejection(), HasSubstr("times.txt:3"));
  folder_.write("times.txt", "");
  EXPECT_THAT(rejection(), HasSubstr("the file holds no times"));
  folder_.write("times.txt", "0\n0.1\n0.05\n0.3\n");
  auto source = open();
  EXPECT_THAT(collect_samples(*source), ElementsAre("f0", "f1", "stamp_reversed", "f3"));
  EXPECT_EQ(source->info().sequence.reversals, 1);
  folder_.write("times.txt", "0\n0.1\n");
  EXPECT_THAT(collect_samples(*open()), ElementsAre("f0", "f1"));
  EXPECT_THAT(open()->info().sequence.remarks, ::testing::Not(IsEmpty())) << "two images have no time";
}

TEST_F(KittiLayout, CountsGaps) {
  folder_.write("times.txt", "0\n0.1\n0.2\n1.3\n");
  const auto source = open();
  EXPECT_EQ(source->info().sequence.gaps, 1);
  EXPECT_NEAR(source->info().sequence.longest_gap_s, 1.1, 1e-9);
}

TEST_F(KittiLayout, SkipsDamagedImages) {
  const std::string whole = text_of("image_0/000001.png");
  folder_.write("image_0/000001.png", whole.substr(0, whole.size() - 20));
  folder_.write("image_1/000002.png", "");
  image("image_1/000003.png", 31, 16);
  EXPECT_THAT(collect_samples(*open()), ElementsAre("f0", "unreadable", "unreadable", "wrong_size"));
}

TEST_F(KittiLayout, SkipsTruncatedJpegs) {
  cv::Mat pixels(16, 32, CV_8U);
  cv::randu(pixels, 0, 256);
  for (int i = 0; i < 4; ++i) {
    for (const char* side : {"image_0", "image_1"}) {
      remove(fmt::format("{}/{:06}.png", side, i));
      cv::imwrite(folder_.file(fmt::format("{}/{:06}.jpg", side, i)), pixels);
    }
  }
  EXPECT_THAT(collect_samples(*open()), ElementsAre("f0", "f1", "f2", "f3"));
  const std::string whole = text_of("image_0/000002.jpg");
  for (const std::size_t kept : {whole.size() - 2, whole.size() - 40, whole.size() / 2, std::size_t{3}}) {
    folder_.write("image_0/000002.jpg", whole.substr(0, kept));
    EXPECT_THAT(collect_samples(*open()), ElementsAre("f0", "f1", "unreadable", "f3"))
        << kept << " of " << whole.size() << " bytes";
  }
}

TEST_F(KittiLayout, CalibrationFaultsHaveCodeConfiguration) {
  folder_.write("calib.txt", "P0: nan 0 16 0 0 30 8 0 0 0 1 0\nP1: 30 0 16 -3 0 30 8 0 0 0 1 0\n");
  const auto rejected = open_recording(folder_.path());
  ASSERT_FALSE(rejected);
  EXPECT_EQ(rejected.error().code, ErrorCode::configuration);
  // A calibration given by the caller replaces it.
  OpenOptions options;
  options.rig_file = folder_.write("other.txt", kKittiCalib);
  EXPECT_EQ(open(options)->info().rig_source, options.rig_file);
}

// --- KITTI raw ---

class KittiRawLayout : public ForeignLayouts {
 protected:
  KittiRawLayout() {
    folder_.write("calib_cam_to_cam.txt",
                  "S_rect_00: 32 16\nR_rect_00: 1 0 0 0 1 0 0 0 1\nP_rect_00: 30 0 16 0 0 30 8 0 0 0 1 0\n"
                  "P_rect_01: 30 0 16 -3 0 30 8 0 0 0 1 0\n");
    std::string times;
    for (int i = 0; i < 3; ++i) {
      times += fmt::format("2011-09-26 13:02:25.{}64389445\n", i);
      for (const char* side : {"image_00", "image_01"}) image(fmt::format("{}/data/{:010}.png", side, i));
      std::string oxts;
      for (int k = 0; k < 30; ++k) oxts += fmt::format("{} ", 100 * i + k);
      folder_.write(fmt::format("oxts/data/{:010}.txt", i), oxts + "\n");
    }
    for (const char* part : {"image_00", "image_01", "oxts"})
      folder_.write(part + std::string("/timestamps.txt"), times);
  }
};

TEST_F(KittiRawLayout, ReadsFramesAndImu) {
  folder_.write("calib_imu_to_velo.txt", "R: 1 0 0 0 1 0 0 0 1\nT: 0 0 0\n");
  folder_.write("calib_velo_to_cam.txt", "R: 0 -1 0 0 0 -1 1 0 0\nT: 0 0 0\n");
  auto source = open();
  EXPECT_EQ(source->info().format, RecordingFormat::kitti_raw);
  EXPECT_TRUE(source->info().has_imu);
  EXPECT_THAT(collect_samples(*source), ElementsAre("i", "f0", "i", "f1", "i", "f2"));
  // 2011-09-26 13:02:25 UTC
  EXPECT_EQ(source->listed_stamps("stereo")[0], Stamp{1317042145'064389445LL});
  const auto imu = source->imu_samples({}, 10).value();
  ASSERT_EQ(imu.size(), 3u);
  EXPECT_EQ(imu[1].accel_m_s2, Eigen::Vector3d(111, 112, 113));
  EXPECT_EQ(imu[1].gyro_rad_s, Eigen::Vector3d(117, 118, 119));
}

TEST_F(KittiRawLayout, RejectsInvalidDates) {
  for (const char* bad :
       {"2011-13-26 13:02:25.0", "2011-09-26 13:02", "2011-09-26", "yesterday noon", "2011-09-26 25:02:25.0"}) {
    folder_.write("image_00/timestamps.txt", std::string(bad) + "\n");
    EXPECT_THAT(rejection(), HasSubstr("image_00/timestamps.txt:1")) << bad;
  }
}

// --- EuRoC ---

class EurocLayout : public ForeignLayouts {
 protected:
  EurocLayout() {
    for (const int camera : {0, 1}) {
      folder_.write(
          fmt::format("mav0/cam{}/sensor.yaml", camera),
          fmt::format("T_BS: {{rows: 4, cols: 4, data: [1,0,0,{}, 0,1,0,0, 0,0,1,0, 0,0,0,1]}}\nresolution: [32, 16]\n"
                      "camera_model: pinhole\nintrinsics: [30, 30, 16, 8]\ndistortion_model: none\n",
                      0.1 * camera));
      list(camera, {1000, 2000, 3000, 4000});
    }
  }
  // Stamps in µs.
  void list(int camera, const std::vector<int>& stamps) {
    std::string table = "#timestamp [ns],filename\r\n";
    for (const int stamp : stamps) {
      table += fmt::format("{}000,{}000.png\r\n", stamp, stamp);
      image(fmt::format("mav0/cam{}/data/{}000.png", camera, stamp));
    }
    folder_.write(fmt::format("mav0/cam{}/data.csv", camera), table);
  }
};

TEST_F(EurocLayout, OpensAboveAndInsideMav0) {
  EXPECT_THAT(collect_samples(*open()), ElementsAre("f0", "f1", "f2", "f3"));
  EXPECT_EQ(open()->info().format, RecordingFormat::euroc);
  auto source = open_recording(folder_.path() + "/mav0");
  ASSERT_TRUE(source);
  EXPECT_THAT(collect_samples(**source), ElementsAre("f0", "f1", "f2", "f3"));
}

TEST_F(EurocLayout, PairsImagesByStamp) {
  list(1, {1002, 2998, 4001, 70000});
  auto source = open();
  EXPECT_THAT(collect_samples(*source), ElementsAre("f0", "right_missing", "f2", "f3", "left_missing"));
  EXPECT_EQ(source->info().sequence.orphans_left, 1);
  EXPECT_EQ(source->info().sequence.orphans_right, 1);
  const auto frame = source->frame_at("stereo", {3'000'000});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->right_stamp, Stamp{2'998'000});
}

TEST_F(EurocLayout, RotatesImuSamplesIntoTheBodyFrame) {
  folder_.write("mav0/imu0/sensor.yaml", "T_BS: {rows: 4, cols: 4, data: [0,-1,0,0, 1,0,0,0, 0,0,1,0, 0,0,0,1]}\n");
  folder_.write("mav0/imu0/data.csv", "#timestamp,wx,wy,wz,ax,ay,az\n500000,1,2,3,4,5,6\n1500000,0,0,0,0,0,0\n");
  auto source = open();
  EXPECT_THAT(collect_samples(*source), ElementsAre("i", "f0", "i", "f1", "f2", "f3"));
  const auto imu = source->imu_samples({}, 1).value();
  EXPECT_LE((imu[0].gyro_rad_s - Eigen::Vector3d(-2, 1, 3)).norm(), 1e-12);
  EXPECT_LE((imu[0].accel_m_s2 - Eigen::Vector3d(-5, 4, 6)).norm(), 1e-12);
}

// A calibration that is given has a body of its own, on which T_BS does not mount the IMU.
TEST_F(EurocLayout, TheRigThatIsGivenMountsTheImu) {
  folder_.write("mav0/imu0/sensor.yaml", "T_BS: {rows: 4, cols: 4, data: [0,-1,0,0.2, 1,0,0,0, 0,0,1,0, 0,0,0,1]}\n");
  folder_.write("mav0/imu0/data.csv", "#timestamp,wx,wy,wz,ax,ay,az\n500000,1,2,3,4,5,6\n");
  EXPECT_EQ(open()->info().rig.imu.body_from_imu.translation(), Eigen::Vector3d(0.2, 0, 0));
  OpenOptions options;
  options.rig_file = folder_.write("cameras.txt",
                                   "cam0=[30 0 16; 0 30 8; 0 0 1]\ncam1=[30 0 16; 0 30 8; 0 0 1]\ndoffs=0\n"
                                   "baseline=100\nwidth=32\nheight=16\n");
  const auto without_mount = open(options);
  EXPECT_FALSE(without_mount->info().has_imu) << "its body is the left camera";
  EXPECT_THAT(collect_samples(*without_mount), ElementsAre("f0", "f1", "f2", "f3"));
  EXPECT_THAT(without_mount->info().sequence.warnings, ElementsAre(HasSubstr("imu0/data.csv: is left out")));

  const std::string own = to_rig_yaml(open()->info().rig);
  const std::string cameras = own.substr(0, own.find("imu:")) + own.substr(own.find("cameras:"));
  const auto accel_with = [&](const std::string& imu) {
    options.rig_file = folder_.write("rig.yaml", cameras + imu);
    return open(options)->imu_samples({}, 1).value().at(0).accel_m_s2;
  };
  const Eigen::Vector3d turned = accel_with("imu: {translation_m: [0, 0, 0], roll_pitch_yaw_deg: [180, 0, 0]}\n");
  EXPECT_LE((turned - Eigen::Vector3d(4, -5, -6)).norm(), 1e-12);
  EXPECT_EQ(accel_with(""), Eigen::Vector3d(4, 5, 6)) << "a body of its own, in whose axes the readings are";
}

// The body of this camchain is the left camera.
TEST_F(EurocLayout, NoImuWithACamchainOfCamerasAlone) {
  std::string camchain;
  for (const int camera : {0, 1}) {
    remove(fmt::format("mav0/cam{}/sensor.yaml", camera));
    camchain += fmt::format("cam{}:\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n", camera);
    camchain += "  distortion_model: equidistant\n  intrinsics: [30, 30, 16, 8]\n  resolution: [32, 16]\n";
  }
  folder_.write("camchain.yaml",
                camchain + "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  folder_.write("mav0/imu0/data.csv", "#timestamp,wx,wy,wz,ax,ay,az\n500000,1,2,3,4,5,6\n");
  EXPECT_FALSE(open()->info().has_imu);
}

TEST_F(EurocLayout, ReadsTheNoiseOfTheImu) {
  folder_.write("mav0/imu0/data.csv", "#timestamp,wx,wy,wz,ax,ay,az\n500000,1,2,3,4,5,6\n");
  EXPECT_EQ(open()->info().noise.imu.gyro_noise_rad_s_sqrt_hz, 0) << "no sensor.yaml: unknown";
  const std::string densities =
      "%YAML:1.0\ngyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 1.9e-5\n"
      "accelerometer_noise_density: 2.0e-3\n";
  folder_.write("mav0/imu0/sensor.yaml", densities);
  const ImuNoise noise = open()->info().noise.imu;
  EXPECT_EQ(noise.gyro_noise_rad_s_sqrt_hz, 1.7e-4);
  EXPECT_EQ(noise.gyro_walk_rad_s2_sqrt_hz, 1.9e-5);
  EXPECT_EQ(noise.accel_noise_m_s2_sqrt_hz, 2e-3);
  EXPECT_EQ(noise.accel_walk_m_s3_sqrt_hz, 0) << "key missing: unknown";
  const auto error_message = [&](const std::string& text) {
    folder_.write("mav0/imu0/sensor.yaml", text);
    const auto rejected = open_recording(folder_.path());
    EXPECT_EQ(rejected.error().code, ErrorCode::configuration);
    return rejected.error().message();
  };
  EXPECT_THAT(error_message(densities + "accelerometer_random_walk: -1\n"),
              HasSubstr("imu0/sensor.yaml:5: accelerometer_random_walk: is -1, must be at least 0 and below 10"));
  EXPECT_THAT(error_message("gyroscope_noise_density: small\n"),
              HasSubstr("imu0/sensor.yaml:1: gyroscope_noise_density: 'small' is not a number"));
  EXPECT_THAT(error_message("T_BS: [1, 2]\n"), HasSubstr("imu0/sensor.yaml:1: T_BS: has 2 entries"));
  EXPECT_THAT(error_message("T_BS: [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n"),
              HasSubstr("imu0/sensor.yaml:1: T_BS: its rotation part is not a rotation matrix"));
  EXPECT_THAT(error_message(""), HasSubstr("imu0/sensor.yaml"));
}

// One camchain for both cameras beside mav0, and the truth of motion capture.
TEST_F(EurocLayout, OfTumVi) {
  for (const int camera : {0, 1}) remove(fmt::format("mav0/cam{}/sensor.yaml", camera));
  const auto moved = [](double x) {
    return fmt::format("[[1, 0, 0, {}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n", x);
  };
  std::string camchain;
  for (const int camera : {0, 1}) {
    camchain += fmt::format("cam{}:\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n", camera);
    camchain += "  distortion_model: equidistant\n  intrinsics: [30, 30, 16, 8]\n  resolution: [32, 16]\n";
    camchain += "  T_cam_imu: " + moved(-0.1 * camera);
    if (camera == 1) camchain += "  T_cn_cnm1: " + moved(-0.1);
  }
  folder_.write("dso/camchain.yaml", camchain);
  EXPECT_EQ(open()->info().truth_file, "");
  folder_.write(
      "mav0/mocap0/data.csv",
      "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n"
      "1000000,1,2,3,1,0,0,0\n");
  EXPECT_EQ(open()->info().truth_file, folder_.path() + "/mav0/mocap0/data.csv");
  EXPECT_THAT(open()->info().rig_source, HasSubstr("dso/camchain.yaml"));
  folder_.write("mav0/state_groundtruth_estimate0/data.csv", "#timestamp\n");
  EXPECT_THAT(open()->info().truth_file, HasSubstr("state_groundtruth_estimate0"));
}

TEST_F(EurocLayout, ErrorsNameFileAndLine) {
  folder_.write("mav0/cam1/data.csv", "#timestamp [ns],filename\n1000000,1000000.png\nsoon,2000000.png\n");
  EXPECT_THAT(rejection(), HasSubstr("cam1/data.csv:3: the first column is not a time in nanoseconds"));
  folder_.write("mav0/cam1/data.csv", "#timestamp [ns],filename\n1000000\n");
  EXPECT_THAT(rejection(), HasSubstr("cam1/data.csv:2: 1 values, expected 2"));
  remove("mav0/cam1/data.csv");
  EXPECT_THAT(rejection(), HasSubstr("cam1/data.csv"));
}

// --- which layout ---

TEST_F(ForeignLayouts, RejectsOtherFoldersAndListsTheKnownLayouts) {
  EXPECT_THAT(rejection(), HasSubstr("the folder is empty"));
  folder_.write("holiday.txt", "x");
  EXPECT_THAT(rejection(), HasSubstr("is not a recording of a known layout"));
  EXPECT_THAT(rejection(), HasSubstr("looked for calib.txt with image_0"));
  EXPECT_THAT(open_recording(folder_.path() + "/none").error().message(), HasSubstr("no such folder"));
  EXPECT_THAT(open_recording(folder_.path() + "/holiday.txt").error().message(), HasSubstr("is a file"));
}

TEST_F(EurocLayout, KittiHasPrecedence) {
  folder_.write("calib.txt", kKittiCalib);
  for (const char* side : {"image_0", "image_1"}) image(std::string(side) + "/000000.png");
  EXPECT_EQ(open()->info().format, RecordingFormat::kitti);
  OpenOptions options;
  options.format = RecordingFormat::euroc;
  EXPECT_EQ(open(options)->info().format, RecordingFormat::euroc);
  EXPECT_THAT(open(options)->info().layout_reason, HasSubstr("euroc requested"));
  options.format = RecordingFormat::spartan;
  EXPECT_THAT(rejection(options), HasSubstr("recording.yaml"));
}

TEST(RecordingFormats, NamesRoundTrip) {
  for (const char* name : {"spartan", "kitti", "kitti-raw", "euroc"})
    EXPECT_EQ(name_of(parse_recording_format(name).value()), name);
  const auto unknown = parse_recording_format("tum");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::usage);
  EXPECT_THAT(unknown.error().message(), HasSubstr("kitti-raw"));
}

}  // namespace
}  // namespace spartan
