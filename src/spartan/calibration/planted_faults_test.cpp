// Faults planted in calibrations of real images: the check names them, and the corrected rig is correct. The images of
// a pair are matched once; `rig inspect` on the same images: tests/program/planted_calibration_faults_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "spartan/calibration/internal/model_modification.h"
#include "spartan/calibration/pair_check.h"
#include "spartan/core/files.h"
#include "spartan/core/pose.h"
#include "spartan/image_io/image_io.h"
#include "spartan/testing/real_data.h"

namespace spartan {

using namespace internal;
namespace {

using ::testing::Contains;

// The first image of a folder.
std::string first_of(const std::string& folder) {
  std::string first;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (first.empty() || entry.path().string() < first) first = entry.path().string();
  }
  return first;
}

Rig shipped_rig(const std::string& name) {
  const std::string path = testing::source_folder() + "/config/rigs/" + name + ".yaml";
  return parse_rig_yaml(read_file(path).value(), path).value();
}

// A rig and the matches between a pair of its images.
struct MatchedPair {
  Rig rig;
  std::vector<PixelMatch> matches;
  ImageSize size;
};

MatchedPair match_pair(const Rig& rig, const std::string& left_path, const std::string& right_path) {
  const auto left = read_gray8(left_path), right = read_gray8(right_path);
  const std::vector<StereoViews> views{{left->view(), right->view()}};
  const auto inspection = inspect_pair(rig, rig.pairs.front(), views, ThreadPool(1));
  return {rig, inspection.value().matches.front(), left->size()};
}

// Matched once. Only where the data is there.
const MatchedPair& matched_pair(const std::string& name) {
  static std::map<std::string, MatchedPair> made;
  const auto known = made.find(name);
  if (known != made.end()) return known->second;
  const std::string data = testing::data_folder() + "/" + name;
  if (name == "euroc_v101") {
    return made[name] =
               match_pair(shipped_rig("euroc"), first_of(data + "/mav0/cam0/data"), first_of(data + "/mav0/cam1/data"));
  }
  return made[name] = match_pair(shipped_rig("k10_corrected"), data + "/left4.png", data + "/right4.png");
}

class PlantedFaults : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(testing::data_folder() + "/" + GetParam()))
      GTEST_SKIP() << "no " << GetParam() << "; SPARTAN_DATA says where it is";
    pair_ = &matched_pair(GetParam());
    rig_ = pair_->rig;
  }

  PairCheck check(const Rig& rig) const { return check_pair(rig, rig.pairs.front(), pair_->matches, pair_->size); }

  static std::vector<std::string> ids(const PairCheck& check) {
    std::vector<std::string> names;
    names.reserve(check.findings.size());
    for (const RigFinding& finding : check.findings) names.push_back(finding.id);
    return names;
  }

  // The fault is named, and the corrected rig gives the rows and ranges of the true one.
  void expect_named(const std::string& id, const std::function<void(Rig&)>& plant, double focal = 0.005,
                    double turn_deg = 0.2) const {
    SCOPED_TRACE(id);
    Rig planted = rig_;
    plant(planted);
    const PairCheck found = check(planted);
    EXPECT_THAT(ids(found), Contains(id));
    EXPECT_EQ(name_of(found.grade), "bad");
    ASSERT_TRUE(found.corrected);
    const Rig& rig = *found.corrected;
    const PairCheck again = check(rig);
    EXPECT_EQ(name_of(again.grade), "good") << ::testing::PrintToString(ids(again));
    EXPECT_NEAR(again.nominal_rows.mean_px, found.corrected_rows.mean_px, 0.1)
        << "the figures are those of the corrected rig";
    const Pose wanted = rig_.right_from_left(rig_.pairs[0]), got = rig.right_from_left(rig.pairs[0]);
    EXPECT_NEAR(got.translation().norm() / wanted.translation().norm(), 1, 0.01);
    EXPECT_LT(rotation_angle(got.inverse() * wanted) * 180 / std::numbers::pi, turn_deg);
    EXPECT_NEAR(focal_ratio(*rig.find_camera(rig.pairs[0].left)), 1, focal);
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

  const MatchedPair* pair_ = nullptr;
  Rig rig_;
};

TEST_P(PlantedFaults, None) {
  const PairCheck found = check(rig_);
  EXPECT_EQ(name_of(found.grade), "good") << ::testing::PrintToString(ids(found));
  EXPECT_EQ(found.corrected, rig_) << "nothing is changed where nothing is wrong";
}

TEST_P(PlantedFaults, ExchangedCamerasAndTransforms) {
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
TEST_P(PlantedFaults, Sizes) {
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

TEST_P(PlantedFaults, RowsAndLenses) {
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

INSTANTIATE_TEST_SUITE_P(RealImages, PlantedFaults, ::testing::Values("euroc_v101", "k10_pair"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace spartan
