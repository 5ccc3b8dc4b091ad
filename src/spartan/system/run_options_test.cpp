#include "spartan/system/run_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace spartan {
namespace {

TEST(RunOptions, EveryBasicOptionExists) {
  const std::vector<OptionLine> all = list_options(RunOptions());
  for (const std::string_view key : basic_options()) {
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const OptionLine& line) { return line.key == key; })) << key;
  }
  EXPECT_LE(basic_options().size(), 30U);
}

TEST(RunOptions, BasicOptionsAreDumpedAndReadBack) {
  RunOptions options;
  options.mapping.map.cell_m = 0.1;
  options.odometry.motion.inlier_sigmas = 5;  // an expert option
  const std::string text = dump_basic_options(options);
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '#')), basic_options().size() + 1);
  EXPECT_THAT(text, ::testing::HasSubstr("inlier_sigmas: 5")) << "nothing that was given is lost";
  EXPECT_THAT(dump_basic_options({}), ::testing::Not(::testing::HasSubstr("inlier_sigmas")));
  const auto read = parse_options<RunOptions>(text, "basic");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->mapping.map.cell_m, 0.1);
  EXPECT_EQ(read->odometry.motion.inlier_sigmas, 5);
}

Rig rig_of_a_small_rover() {
  Rig rig;
  rig.rover = {0.35, 0.05, 0.06};
  return rig;
}

TEST(ResolvedOptions, TakeTheGeometryOfTheRoverFromTheRig) {
  const RunOptions options = resolved_options({}, rig_of_a_small_rover());
  EXPECT_EQ(options.mapping.map.rover.geometry, (RoverGeometry{0.35, 0.05, 0.06}));
  EXPECT_EQ(options.localization.wheels.track_m, 0.35);
}

TEST(ResolvedOptions, TakeTheErrorsOfTheCalibrationFromTheRig) {
  Rig rig;
  EXPECT_EQ(resolved_options({}, rig).mapping.map.calibration, CalibrationErrors());
  rig.calibration_errors = CalibrationErrors{0.01, 0.02, 0.03, 0.04, 0.05};
  EXPECT_EQ(resolved_options({}, rig).mapping.map.calibration, *rig.calibration_errors);
  RunOptions given;
  given.mapping.map.calibration.mount_mm = 7;
  EXPECT_EQ(resolved_options(given, rig).mapping.map.calibration, (CalibrationErrors{0.01, 0.02, 0.03, 7, 0.05}));
}

TEST(ResolvedOptions, KeepWhatWasSetUnderAFormerKey) {
  const auto set = read_assignment<RunOptions>("mapping.map.rover.track_m=0.5");
  ASSERT_TRUE(set) << set.error().message();
  EXPECT_EQ(set->warnings.size(), 1U);
  const RunOptions options = resolved_options(set->options, rig_of_a_small_rover());
  EXPECT_EQ(options.mapping.map.rover.geometry.track_m, 0.5);
  EXPECT_EQ(options.mapping.map.rover.geometry.wheel_radius_m, 0.05);
}

TEST(ResolvedOptions, ShareObstacleHeightAndDisparitySigma) {
  RunOptions options;
  options.mapping.disparity_sigma_px = 0.5;
  options.mapping.map.obstacle_m = 0.05;
  const MappingOptions mapping = resolved_options(options, Rig()).mapping;
  EXPECT_EQ(mapping.v_disparity.plane.disparity_sigma_px, 0.5);
  EXPECT_EQ(mapping.merging.disparity_sigma_px, 0.5);
  EXPECT_DOUBLE_EQ(mapping.v_disparity.obstacle_m, 0.04);
}

TEST(ResolvedOptions, AngleErrorsOfPanTiltUnitsNeedAPairOnOne) {
  Rig rig;
  rig.cameras.resize(2);
  rig.cameras[0].name = "left";
  rig.cameras[1].name = "right";
  rig.pairs = {{"front", "left", "right", 0, true}};
  EXPECT_EQ(resolved_options({}, rig).mapping.map.calibration.pan_tilt_deg, 0);
  RunOptions given;
  given.mapping.map.calibration.pan_tilt_deg = 0.3;
  EXPECT_EQ(resolved_options(given, rig).mapping.map.calibration.pan_tilt_deg, 0.3);
  rig.cameras[0].mount = rig.cameras[1].mount = "mast";
  EXPECT_EQ(resolved_options({}, rig).mapping.map.calibration.pan_tilt_deg, 0.1);
}

// What is stated once is what the modules had before, to the last bit.
TEST(ResolvedOptions, ChangeNoDefault) {
  const RunOptions defaults, resolved = resolved_options({}, Rig());
  EXPECT_EQ(dump_options(resolved), dump_options(defaults));
  EXPECT_EQ(resolved.mapping.v_disparity.obstacle_m, 0.08);
  EXPECT_EQ(resolved.mapping.v_disparity.plane.disparity_sigma_px, 0.3);
  EXPECT_EQ(resolved.mapping.merging.disparity_sigma_px, 0.3);
}

TEST(RunOptions, DifferencesNameKeyAndBothValues) {
  const RunOptions before;
  RunOptions now;
  EXPECT_EQ(option_differences(before, now), "");
  now.odometry.detection.landmarks = 800;
  EXPECT_EQ(option_differences(before, now), "odometry.detection.landmarks was 1200, is 800");
  now.maps = !before.maps;
  now.terrain.enabled = !before.terrain.enabled;
  now.reconstruction.p1 = now.reconstruction.p2_flat = now.reconstruction.p2_edge = 51;
  const std::string six = option_differences(before, now);
  EXPECT_EQ(std::count(six.begin(), six.end(), ';'), 5) << six;
  EXPECT_TRUE(six.ends_with("; …")) << six;
}

}  // namespace
}  // namespace spartan
