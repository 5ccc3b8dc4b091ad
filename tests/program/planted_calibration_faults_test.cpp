// Faults planted in calibrations of real images: `rig inspect` names them, and the rig it writes is correct.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>

#include "program.h"
#include "spartan/calibration/internal/model_modification.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {

using namespace internal;
namespace {

using nlohmann::json;
using ::testing::Contains;
using testing::run_program;
using testing::TemporaryFolder;

// The first image of a folder.
std::string first_of(const std::string& folder) {
  std::string first;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (first.empty() || entry.path().string() < first) first = entry.path().string();
  }
  return first;
}

class PlantedCalibrationFaults : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string data = testing::data_folder() + "/" + GetParam();
    if (!std::filesystem::exists(data)) GTEST_SKIP() << "no " << GetParam() << "; SPARTAN_DATA says where it is";
    const std::string name = GetParam(), shipped = testing::source_folder() + "/config/rigs/";
    if (name == "euroc_v101") {
      rig_ = read_rig(shipped + "euroc.yaml").value();
      left_ = first_of(data + "/mav0/cam0/data");
      right_ = first_of(data + "/mav0/cam1/data");
    } else {
      rig_ = read_rig(shipped + "k10_corrected.yaml").value();
      left_ = data + "/left4.png";
      right_ = data + "/right4.png";
    }
  }

  json inspect(const Rig& rig, const std::vector<std::string>& options = {}) const {
    std::vector<std::string> arguments{"rig", "inspect", folder_.write("rig.yaml", to_rig_yaml(rig)),
                                       left_, right_,    "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const auto result = run_program(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out)["pairs"].front();
  }

  static std::vector<std::string> ids(const json& pair) {
    std::vector<std::string> names;
    for (const json& finding : pair["findings"]) names.push_back(finding["id"]);
    return names;
  }

  // The fault is named, and the corrected rig gives the rows and ranges of the true one.
  void expect_named(const std::string& id, const std::function<void(Rig&)>& plant, double focal = 0.005,
                    double turn_deg = 0.2) const {
    SCOPED_TRACE(id);
    Rig planted = rig_;
    plant(planted);
    const std::string corrected = folder_.path() + "/corrected.yaml";
    const json found = inspect(planted, {"--force", "--apply", corrected});
    EXPECT_THAT(ids(found), Contains(id));
    EXPECT_EQ(found["verdict"], "bad");
    const auto rig = read_rig(corrected);
    ASSERT_TRUE(rig) << rig.error().message();
    const json again = inspect(*rig);
    EXPECT_EQ(again["verdict"], "good") << again["findings"];
    EXPECT_NEAR(again["row_error_px"]["after"]["mean"].get<double>(),
                found["row_error_px"]["corrected"]["mean"].get<double>(), 0.1)
        << "the figures are those of the rig that is written";
    const Pose wanted = rig_.right_from_left(rig_.pairs[0]), got = rig->right_from_left(rig->pairs[0]);
    EXPECT_NEAR(got.translation().norm() / wanted.translation().norm(), 1, 0.01);
    EXPECT_LT(rotation_angle(got.inverse() * wanted) * 180 / std::numbers::pi, turn_deg);
    EXPECT_NEAR(focal_ratio(*rig->find_camera(rig->pairs[0].left)), 1, focal);
  }

  // Relative to the left camera.
  double focal_ratio(const Camera& camera) const {
    const auto focal = [](const Camera& c) {
      return project_with_jacobian(c.model, Eigen::Vector3d::UnitZ())->by_point(0, 0);
    };
    return focal(camera) / focal(*rig_.find_camera(rig_.pairs[0].left));
  }

  Camera& camera(Rig& rig, bool right) const {
    const std::string& name = right ? rig_.pairs[0].right : rig_.pairs[0].left;
    return *std::find_if(rig.cameras.begin(), rig.cameras.end(), [&](const Camera& c) { return c.name == name; });
  }
  void move_right_camera(Rig& rig, const std::function<Pose(const Pose&)>& change) const {
    const Pose left_from_right = rig.right_from_left(rig.pairs[0]).inverse();
    camera(rig, true).mount_from_camera = camera(rig, false).mount_from_camera * change(left_from_right);
  }

  TemporaryFolder folder_;
  Rig rig_;
  std::string left_, right_;
};

TEST_P(PlantedCalibrationFaults, None) {
  const std::string corrected = folder_.path() + "/corrected.yaml";
  const json found = inspect(rig_, {"--force", "--apply", corrected});
  EXPECT_EQ(found["verdict"], "good") << found["findings"];
  EXPECT_EQ(*read_rig(corrected), rig_) << "nothing is changed where nothing is wrong";
}

TEST_P(PlantedCalibrationFaults, ExchangedCamerasAndTransforms) {
  expect_named("inverse_transform",
               [&](Rig& rig) { move_right_camera(rig, [](const Pose& p) { return p.inverse(); }); });
  expect_named("swapped_eyes", [](Rig& rig) { std::swap(rig.pairs[0].left, rig.pairs[0].right); });
  expect_named("swapped_eyes", [&](Rig& rig) { std::swap(camera(rig, false).model, camera(rig, true).model); });
  expect_named("baseline_unit", [&](Rig& rig) {
    move_right_camera(rig, [](const Pose& p) { return Pose(p.rotation(), 1000 * p.translation()); });
  });
  expect_named("yaw_offset", [&](Rig& rig) {
    move_right_camera(rig, [](const Pose& p) {
      return Pose(p.rotation() * exp_so3({0, std::numbers::pi / 180, 0}), p.translation());
    });
  });
}

// A focal length common to both cameras is observable by the distortion only: to some percent where rows agree to a
// third of a pixel.
TEST_P(PlantedCalibrationFaults, Sizes) {
  for (const auto& change : {with_scaled_focal_length, resized}) {
    expect_named(
        "size_mismatch",
        [&](Rig& rig) {
          for (const bool right : {false, true}) camera(rig, right).model = change(camera(rig, right).model, 2);
        },
        0.03);
  }
  expect_named("size_mismatch",
               [&](Rig& rig) { camera(rig, true).model = with_scaled_focal_length(camera(rig, true).model, 1.5); });
}

TEST_P(PlantedCalibrationFaults, RowsAndLenses) {
  for (const double rows_px : {2, -2, -5, 20}) {
    SCOPED_TRACE(rows_px);
    expect_named(
        "row_offset", [&](Rig& rig) { camera(rig, true).model = with_row_offset(camera(rig, true).model, rows_px); },
        0.005, 0.4);
  }
  const auto pinhole = [&](Rig& rig, bool right) {
    camera(rig, right).model = std::get<RadialTangentialModel>(camera(rig, right).model).pinhole();
  };
  expect_named(
      "distortion_ignored",
      [&](Rig& rig) {
        pinhole(rig, false);
        pinhole(rig, true);
      },
      0.005, 0.5);
}

INSTANTIATE_TEST_SUITE_P(RealImages, PlantedCalibrationFaults, ::testing::Values("euroc_v101", "k10_pair"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace spartan
