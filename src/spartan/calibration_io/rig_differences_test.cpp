#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/calibration_io/internal/pair_of_files.h"
#include "spartan/rig/describe.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/testing/camera_model_laws.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {

using namespace internal;

namespace {

using ::testing::HasSubstr;

constexpr PinholeModel kPinhole{500, 501, 320, 240};

Rig rover() {
  Rig rig;
  rig.name = "rover";
  rig.pan_tilt_units = {{"mast", Pose::from_translation({0, 0, 1}), 0.1, 0.6}};
  for (const char* name : {"left", "right", "third"}) {
    Camera camera;
    camera.name = name;
    camera.size = {640, 480};
    camera.model = kPinhole;
    camera.mount_from_camera = Pose::from_translation({0.1, 0.1 * static_cast<double>(rig.cameras.size()), 0}) *
                               optical_from_forward().inverse();
    rig.cameras.push_back(camera);
  }
  rig.pairs = {{"front", "left", "right", 0.3, true}};
  return rig;
}

template <class Change>
std::string differences(Change change) {
  Rig result = rover();
  change(result);
  std::string keys;
  for (const RigDifference& each : describe_differences(rover(), result)) keys += each.key + ";";
  return keys;
}

TEST(RigDifferences, EveryFieldIsCompared) {
  EXPECT_EQ(differences([](Rig&) {}), "");
  EXPECT_EQ(differences([](Rig& r) { r.name = "x"; }), "name;");
  EXPECT_EQ(differences([](Rig& r) { r.convention = PoseConvention::left_optical; }), "pose_convention;");
  EXPECT_EQ(differences([](Rig& r) { r.pan_tilt_units.clear(); }), "pan_tilt_units.mast;");
  EXPECT_EQ(differences([](Rig& r) { r.pan_tilt_units[0].rest_pan_rad = 0; }), "pan_tilt_units.mast;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras.pop_back(); }), "cameras.third;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[2].name = "x"; }), "cameras.third.name;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[2].size.width = 1; }), "cameras.third.size_px;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[0].model = EquidistantModel(kPinhole, {}); }), "cameras.left.model;");
  EXPECT_EQ(differences([](Rig& r) { std::get<PinholeModel>(r.cameras[0].model).cx += 1e-9; }),
            "cameras.left.centre_px;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[1].pixel_format.layout = PixelLayout::rgb; }),
            "cameras.right.pixel_layout;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[1].pixel_format.bits = 12; }), "cameras.right.bits;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[1].pixel_format.alignment = BitAlignment::high; }),
            "cameras.right.bit_alignment;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[1].vignetting.coefficients = {-0.3}; }), "cameras.right.vignetting;");
  EXPECT_EQ(differences([](Rig& r) {
              r.cameras[1].vignetting.centre_px = {320, 240};
            }),
            "cameras.right.vignetting_centre_px;");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[1].self_mask = "m.png"; }), "cameras.right.self_mask;");
  const auto moved = [](Camera& c) {
    c.mount_from_camera = Pose::from_translation({1e-9, 0, 0}) * c.mount_from_camera;
  };
  EXPECT_EQ(differences([&](Rig& r) { moved(r.cameras[1]); }), "cameras.right.place;");
  EXPECT_EQ(differences([](Rig& r) {
              r.cameras[1].mount_from_camera = r.cameras[1].mount_from_camera * Pose(exp_so3({0, 1e-9, 0}), {0, 0, 0});
            }),
            "cameras.right.place;");
  EXPECT_EQ(differences([&](Rig& r) {
              for (Camera& c : r.cameras) moved(c);
            }),
            "body;");
  EXPECT_EQ(differences([](Rig& r) { r.pairs[0].name = "x"; }), "pairs.front.name;");
  EXPECT_EQ(differences([](Rig& r) { r.pairs[0].nearest_m = 0; }), "pairs.front.nearest_m;");
  EXPECT_EQ(differences([](Rig& r) { r.pairs[0].for_odometry = false; }), "pairs.front.for_odometry;");
  EXPECT_EQ(differences([](Rig& r) { r.pairs.clear(); }), "pairs.front;");
}

TEST(RigDifferences, PairsOfOtherCameras) {
  Rig wanted = rover();
  wanted.pairs.push_back({"side", "left", "third", 0.3, true});
  Rig result = wanted;
  result.pairs[1].left = "right";
  auto found = describe_differences(wanted, result);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].key, "pairs.side.left");
  result.pairs[1] = {"side", "left", "right", 0.3, true};
  found = describe_differences(wanted, result);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].key, "pairs.side.right");
}

TEST(RigDifferences, AdditionsAreReported) {
  EXPECT_EQ(differences([](Rig& r) {
              r.cameras.push_back(r.cameras[2]);
              r.cameras[3].name = "fourth";
              r.pairs.push_back({"back", "third", "fourth"});
              r.pan_tilt_units.push_back({"arm", Pose(), 0, 0});
            }),
            "pan_tilt_units.arm;cameras.fourth;pairs.back;");
}

TEST(RigDifferences, RoundingIsIgnored) {
  EXPECT_EQ(differences([](Rig& r) { std::get<PinholeModel>(r.cameras[0].model).cx += 1e-13; }), "");
  EXPECT_EQ(differences([](Rig& r) { r.cameras[0].model = RadialTangentialModel(kPinhole, {}); }), "");
  EXPECT_EQ(differences([](Rig& r) {
              r.cameras[1].mount_from_camera = Pose::from_translation({1e-13, 0, 0}) * r.cameras[1].mount_from_camera;
            }),
            "");
}

TEST(RigDifferences, TextsNameBothValues) {
  Rig result = rover();
  result.cameras[0].size = {1, 2};
  result.cameras[2].mount_from_camera = Pose::from_translation({0, 0.5, 0}) * result.cameras[2].mount_from_camera;
  const auto found = describe_differences(rover(), result);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].text, "the image size: 640 x 480, now 1 x 2");
  EXPECT_THAT(found[1].text,
              HasSubstr("relative to left: 200.0 mm to the left; not rotated, now 700.0 mm to the left"));
  const auto text = [](const auto& change) {
    Rig changed = rover();
    change(changed);
    return describe_differences(rover(), changed).at(0).text;
  };
  EXPECT_EQ(text([](Rig& r) { std::get<PinholeModel>(r.cameras[0].model).cx = 321; }), "[320, 240], now [321, 240]");
  EXPECT_THAT(text([](Rig& r) { r.pan_tilt_units[0].rest_pan_rad = 0; }), HasSubstr("another pose"));
  EXPECT_THAT(text([](Rig& r) { r.pan_tilt_units.clear(); }), HasSubstr("is missing"));
  // In the new body frame the cameras are 1 m further ahead, and so is the old body frame.
  EXPECT_THAT(text([](Rig& r) {
                for (Camera& c : r.cameras)
                  c.mount_from_camera = Pose::from_translation({1, 0, 0}) * c.mount_from_camera;
              }),
              HasSubstr("the old one is 1.000 m ahead"));
}

// --- camera_model.h ---

TEST(ModelEquivalents, PlainestModelProjectsEqually) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ(), tilted = Eigen::Vector3d(0.1, 0, 1).normalized();
  const CahvModel cahv{kPinhole, 0}, skewed{kPinhole, 0.5};
  const struct {
    CameraModel given;
    std::string_view simplest_equivalent;
  } known[] = {
      {RadialTangentialModel(kPinhole, {}), "pinhole"},
      {RadialTangentialModel(kPinhole, {0, 0, 0.001, 0}), "radial_tangential"},
      {DoubleSphereModel{kPinhole, 0, 0}, "pinhole"},
      {DoubleSphereModel{kPinhole, 0.1, 0}, "double_sphere"},
      {EquidistantModel(kPinhole, {}), "equidistant"},
      {cahv, "pinhole"},
      {skewed, "cahv"},
      {CahvorModel(skewed, tilted, {}), "cahv"},
      {CahvorModel(cahv, tilted, {}), "pinhole"},
      {CahvorModel(cahv, z, {0, -0.1, 0.02}), "radial_tangential"},
      {CahvorModel(cahv, z, {0.01, -0.1, 0.02}), "cahvor"},
      {CahvorModel(skewed, z, {0, -0.1, 0.02}), "cahvor"},
      {CahvorModel(cahv, tilted, {0, -0.1, 0.02}), "cahvor"},
      {CahvoreModel(cahv, tilted, {0, -0.1, 0.02}, {}, 1), "cahvor"},
      {CahvoreModel(cahv, z, {}, {}, 1), "pinhole"},
      {CahvoreModel(cahv, z, {0, -0.1, 0.02}, {}, 0), "equidistant"},
      {CahvoreModel(cahv, z, {0, -0.1, 0.02}, {0.001, 0, 0}, 0), "cahvore"},
      {CahvoreModel(cahv, z, {0, -0.1, 0.02}, {}, 0.5), "cahvore"},
  };
  for (const auto& [given, name] : known) {
    const CameraModel plain = simplest_equivalent(given);
    EXPECT_EQ(name_of(plain), name);
    for (const Eigen::Vector3d& p :
         {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.3, -0.2, 0.7), Eigen::Vector3d(-1, 1, 5)}) {
      const auto a = project(given, p), b = project(plain, p);
      ASSERT_TRUE(a && b) << name;
      EXPECT_LE((*a - *b).norm(), 1e-10) << name;
    }
  }
}

template <class Model>
void expect_expressed(const CameraModel& model) {
  const auto other = converted_to<Model>(model);
  ASSERT_TRUE(other) << name_of(model) << " as " << Model::kName;
  const Eigen::Vector3d p(0.3, -0.2, 0.7);
  EXPECT_LE((*project(model, p) - *other->project(p)).norm(), 1e-10) << name_of(model) << " as " << Model::kName;
  EXPECT_EQ(simplest_equivalent(CameraModel(*other)), simplest_equivalent(model));
}

TEST(ModelEquivalents, EquivalentModels) {
  expect_expressed<RadialTangentialModel>(kPinhole);
  expect_expressed<DoubleSphereModel>(kPinhole);
  expect_expressed<CahvModel>(kPinhole);
  expect_expressed<CahvorModel>(kPinhole);
  expect_expressed<CahvoreModel>(kPinhole);
  const RadialTangentialModel two(kPinhole, {-0.1, 0.02});
  expect_expressed<CahvorModel>(two);
  expect_expressed<CahvoreModel>(two);
  expect_expressed<CahvoreModel>(EquidistantModel(kPinhole, {-0.1, 0.02, 0, 0}));
  expect_expressed<CahvoreModel>(CahvModel{kPinhole, 0.5});
  EXPECT_FALSE(converted_to<PinholeModel>(two));
  EXPECT_FALSE(converted_to<CahvorModel>(RadialTangentialModel(kPinhole, {-0.1, 0.02, 0.001, 0})));
  EXPECT_FALSE(converted_to<CahvoreModel>(EquidistantModel(kPinhole, {-0.1, 0.02, 0.01, 0})));
  EXPECT_FALSE(converted_to<RadialTangentialModel>(CahvModel{kPinhole, 0.5}));
  EXPECT_FALSE(converted_to<EquidistantModel>(kPinhole));
}

// --- pair_of_files.h ---

TEST(PairOfFiles, FindsTheOtherFile) {
  const testing::TemporaryFolder folder;
  const auto partner = [&](const std::string& given, const std::string& other) {
    folder.write(given, "x");
    folder.write(other, "x");
    const auto pair = find_pair_of_files(folder.path() + "/" + given);
    if (!pair) return pair.error().message();
    return (pair->left + "," + pair->right).erase(0, folder.path().size() + 1);
  };
  const auto both = [&](const std::string& l, const std::string& r) { return l + "," + folder.path() + "/" + r; };
  EXPECT_EQ(partner("black_left.tsai", "black_right.tsai"), both("black_left.tsai", "black_right.tsai"));
  EXPECT_EQ(partner("black_right.tsai", "black_left.tsai"), both("black_left.tsai", "black_right.tsai"));
  EXPECT_EQ(partner("cam0.yaml", "cam1.yaml"), both("cam0.yaml", "cam1.yaml"));
  EXPECT_EQ(partner("nav_l.cahvor", "nav_r.cahvor"), both("nav_l.cahvor", "nav_r.cahvor"));
  EXPECT_EQ(partner("R.cahvor", "L.cahvor"), both("L.cahvor", "R.cahvor"));
  EXPECT_EQ(partner("camera-0.cameramodel", "camera-1.cameramodel"),
            both("camera-0.cameramodel", "camera-1.cameramodel"));
  EXPECT_EQ(partner("l_r.x", "r_r.x"), both("l_r.x", "r_r.x"));
}

TEST(PairOfFiles, AmbiguousNamesAreAnError) {
  const testing::TemporaryFolder folder;
  for (const char* name : {"left_left.x", "right_left.x", "left_right.x", "alone.x", "odd,name.x"})
    folder.write(name, "x");
  const auto message_of = [&](const std::string& name) {
    const auto pair = find_pair_of_files(folder.path() + "/" + name);
    EXPECT_FALSE(pair);
    EXPECT_EQ(pair.error().code, ErrorCode::configuration);
    return pair.error().message();
  };
  EXPECT_THAT(message_of("left_left.x"),
              HasSubstr("could each be the file of the other camera (name both files: LEFT,RIGHT)"));
  EXPECT_THAT(message_of("alone.x"),
              HasSubstr("the file of the other camera is not found (name both files: LEFT,RIGHT)"));
  EXPECT_THAT(message_of("odd,name.x"), HasSubstr("the file of the other camera is not found"));
  const auto named = find_pair_of_files("a.x,b.x");
  EXPECT_EQ(named->left, "a.x");
  EXPECT_EQ(named->right, "b.x");
}

TEST(PairOfFiles, NamesOfWrittenFiles) {
  EXPECT_EQ(names_of_pair("a/b.tsai").left, "a/b_left.tsai");
  EXPECT_EQ(names_of_pair("a/b.tsai").right, "a/b_right.tsai");
  EXPECT_EQ(names_of_pair("x.y,z.y").right, "z.y");
}

}  // namespace
}  // namespace spartan
