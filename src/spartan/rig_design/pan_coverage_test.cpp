#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/rig/rig.h"
#include "spartan/rig_design/rig_designer.h"
#include "spartan/testing/real_data.h"

namespace spartan {
namespace {

const GroundView kPanningPair{1.0, 39 * kRadiansPerDegree, 50 * kRadiansPerDegree, 50 * kRadiansPerDegree, 0.20};
const double kTan = std::tan(25 * kRadiansPerDegree);
// By hand: half azimuth of the far edge for one camera and for both, and the ends of the middle column.
const double kFar_m = 1 / std::tan(14 * kRadiansPerDegree), kNear_m = 1 / std::tan(64 * kRadiansPerDegree);
const double kAside_m = kTan / (std::sin(39 * kRadiansPerDegree) - kTan * std::cos(39 * kRadiansPerDegree));
const double kOneCamera_deg = std::atan2(kAside_m, kFar_m) / kRadiansPerDegree;
const double kBothCameras_deg = std::atan2(kAside_m - 0.1, kFar_m) / kRadiansPerDegree;

PanRequirements pans(std::vector<double> angles_deg, double azimuth_deg) {
  PanRequirements required;
  required.angles_deg = std::move(angles_deg);
  required.azimuth_deg = azimuth_deg;
  return required;
}

double uniform_in(double low, double high) {
  return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1'000'001);
}

// Whether a ground point projects into the image of a camera; independent of polygons and intervals.
bool sees(const GroundView& view, double camera_left_m, double pan_rad, double r, double azimuth_rad) {
  const double ahead = r * std::cos(azimuth_rad - pan_rad), left = r * std::sin(azimuth_rad - pan_rad) - camera_left_m;
  const double depth = ahead * std::cos(view.tilt_rad) + view.height_m * std::sin(view.tilt_rad);
  const double up = ahead * std::sin(view.tilt_rad) - view.height_m * std::cos(view.tilt_rad);
  return depth > 0 && std::abs(left) < depth * std::tan(view.hfov_rad / 2) &&
         std::abs(up) < depth * std::tan(view.vfov_rad / 2);
}
bool both_see(const GroundView& view, const std::vector<double>& pans_deg, double r, double azimuth_rad) {
  return std::any_of(pans_deg.begin(), pans_deg.end(), [&](double pan_deg) {
    return sees(view, view.baseline_m / 2, pan_deg * kRadiansPerDegree, r, azimuth_rad) &&
           sees(view, -view.baseline_m / 2, pan_deg * kRadiansPerDegree, r, azimuth_rad);
  });
}

// Distances at which both cameras see all of many azimuths, by sampling in small steps; the longest range.
DistanceSpan full_coverage_by_sampling(const GroundView& view, const PanRequirements& required, double to_m) {
  constexpr double kStep_m = 5e-3;
  constexpr int kDirections = 360;
  DistanceSpan longest, span;
  bool before = false;
  for (double r = kStep_m / 2; r < to_m; r += kStep_m) {
    bool all = true;
    for (int i = 0; all && i <= kDirections; ++i) {
      all = both_see(view, required.angles_deg, r,
                     (1.0 * i / kDirections - 0.5) * required.azimuth_deg * kRadiansPerDegree);
    }
    if (all && !before) span.from_m = r;
    if (all) span.to_m = r;
    if (all && span.to_m - span.from_m > longest.to_m - longest.from_m) longest = span;
    before = all;
  }
  return longest;
}

void expect_sectors(const AzimuthSet& set, const std::vector<AzimuthSector>& expected) {
  ASSERT_EQ(set.sectors().size(), expected.size()) << to_text(set);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(set.sectors()[i].from_deg, expected[i].from_deg, 1e-9);
    EXPECT_NEAR(set.sectors()[i].to_deg, expected[i].to_deg, 1e-9);
  }
}

TEST(PanCoverage, PublishedPans) {
  const PanCoverage coverage = pan_coverage(kPanningPair, pans({-35, 0, 35}, 120));
  expect_sectors(coverage.azimuth_far, {{-35 - kOneCamera_deg, 35 + kOneCamera_deg}});
  expect_sectors(coverage.azimuth_far_stereo, {{-35 - kBothCameras_deg, 35 + kBothCameras_deg}});
  EXPECT_NEAR(coverage.azimuth_far.width_deg(), 117.1, 0.05);
  EXPECT_NEAR(coverage.azimuth_far_stereo.width_deg(), 114.6, 0.05);
  EXPECT_NEAR(coverage.overlap->percent(), 30, 1e-9);
  ASSERT_TRUE(coverage.full_coverage);
  // The outermost required azimuth is 25 degrees off its pan. Coverage begins at the bottom row, and ends where the
  // half width of the view, minus half a baseline, equals the lateral offset; both are linear in the distance.
  EXPECT_NEAR(coverage.full_coverage->from_m, kNear_m / std::cos(25 * kRadiansPerDegree), 1e-8);
  const double per_m_ahead = kTan * std::cos(39 * kRadiansPerDegree),
               at_foot = kTan * std::sin(39 * kRadiansPerDegree) - 0.1;
  EXPECT_NEAR(coverage.full_coverage->to_m,
              at_foot / (std::sin(25 * kRadiansPerDegree) - per_m_ahead * std::cos(25 * kRadiansPerDegree)), 1e-8);
}

TEST(PanCoverage, GapsAreExcluded) {
  const PanCoverage three = pan_coverage(kPanningPair, pans({-80, 0, 80}, 120));
  expect_sectors(three.azimuth_far,
                 {{-60, -80 + kOneCamera_deg}, {-kOneCamera_deg, kOneCamera_deg}, {80 - kOneCamera_deg, 60}});
  expect_sectors(three.azimuth_far_stereo,
                 {{-60, -80 + kBothCameras_deg}, {-kBothCameras_deg, kBothCameras_deg}, {80 - kBothCameras_deg, 60}});
  EXPECT_FALSE(three.full_coverage);
  EXPECT_NEAR(three.overlap->gap_deg(), 30, 1e-9);
  EXPECT_NEAR(three.overlap->percent(), -60, 1e-9);
  EXPECT_NEAR(three.far_overlap_stereo->gap_deg(), 80 - 2 * kBothCameras_deg, 1e-9);
  const PanCoverage uneven = pan_coverage(kPanningPair, pans({-60, -35, 35}, 120));
  expect_sectors(uneven.azimuth_far, {{-60, -35 + kOneCamera_deg}, {35 - kOneCamera_deg, 35 + kOneCamera_deg}});
}

TEST(PanCoverage, PansToOneSide) {
  const PanCoverage coverage = pan_coverage(kPanningPair, pans({0, 35, 70}, 120));
  expect_sectors(coverage.azimuth_far, {{-kOneCamera_deg, 60}});
  expect_sectors(coverage.azimuth_far_stereo, {{-kBothCameras_deg, 60}});
  EXPECT_FALSE(coverage.full_coverage);
  EXPECT_NEAR(coverage.overlap->percent(), 30, 1e-9);
}

TEST(PanCoverage, NarrowAzimuthIsCoveredByOnePan) {
  const PanCoverage coverage = pan_coverage(kPanningPair, pans({-35, 0, 35}, 10));
  expect_sectors(coverage.azimuth_far, {{-5, 5}});
  EXPECT_NEAR(coverage.full_coverage.value().from_m, kNear_m / std::cos(5 * kRadiansPerDegree), 1e-8);
  EXPECT_NEAR(coverage.full_coverage->to_m, kFar_m, 1e-8) << "straight ahead the top row is the limit";
}

TEST(PanCoverage, FullCircle) {
  const PanCoverage four = pan_coverage(kPanningPair, pans({-180, -90, 0, 90, 180}, 360));
  EXPECT_NEAR(four.azimuth_far.width_deg(), 4 * 2 * kOneCamera_deg, 1e-9) << "two of the five pans coincide";
  EXPECT_NEAR(four.azimuth_far_stereo.width_deg(), 4 * 2 * kBothCameras_deg, 1e-9);
  EXPECT_FALSE(four.full_coverage);
  std::vector<double> twelve_deg;
  for (int pan = -180; pan < 180; pan += 30) twelve_deg.push_back(pan);
  const PanCoverage twelve = pan_coverage(kPanningPair, pans(twelve_deg, 360));
  EXPECT_EQ(twelve.azimuth_far_stereo.width_deg(), 360);
  EXPECT_NEAR(twelve.full_coverage.value().from_m, kNear_m / std::cos(15 * kRadiansPerDegree), 1e-8);
  EXPECT_NEAR(twelve.full_coverage->to_m, kFar_m, 1e-8);
  // The last and the first pan are neighbours, too.
  EXPECT_EQ(pans({-100, 0, 100}, 360).widest_step_deg(), 160);
  EXPECT_EQ(pans({-100, 0, 100}, 300).widest_step_deg(), 100);
}

TEST(PanCoverage, BottomRowBehindTheNadirLeavesNoBlindZone) {
  GroundView steep = kPanningPair;
  steep.tilt_rad = 80 * kRadiansPerDegree;
  const auto held = pan_coverage(steep, pans({-35, 0, 35}, 120)).full_coverage;
  ASSERT_TRUE(held);
  EXPECT_EQ(held->from_m, 0);
}

// Closely spaced pans cover more distance together than straight ahead of one of them.
TEST(PanCoverage, FullCoverageAgreesWithSampling) {
  GroundView apart = kPanningPair;
  apart.baseline_m = 0.6;
  for (const auto& [view, required] :
       {std::pair{kPanningPair, pans({-35, 0, 35}, 120)}, std::pair{kPanningPair, pans({-60, -35, 35}, 120)},
        std::pair{kPanningPair, pans({-60, -50, -40, -30, -20, -10, 0, 10, 20, 30, 40, 50, 60}, 120)},
        std::pair{kPanningPair, pans({-35, 0, 35}, 10)}, std::pair{kPanningPair, pans({0, 35, 70}, 40)},
        std::pair{apart, pans({-40, -20, 0, 20, 40}, 90)}}) {
    const DistanceSpan sampled = full_coverage_by_sampling(view, required, 6);
    const auto held = pan_coverage(view, required).full_coverage;
    ASSERT_TRUE(held);
    EXPECT_NEAR(held->from_m, sampled.from_m, 6e-3);
    EXPECT_NEAR(held->to_m, sampled.to_m, 6e-3);
  }
}

// Any pans, with or without gaps, any view: an azimuth is in the set exactly if its ground point projects into an
// image.
RC_GTEST_PROP(PanCoverage, CoveredAzimuthAgreesWithProjection, ()) {
  GroundView view = kPanningPair;
  view.tilt_rad = uniform_in(26, 89) * kRadiansPerDegree;
  view.baseline_m = uniform_in(0, 1.5);
  PanRequirements required = pans({}, uniform_in(1, 360));
  const int count = *rc::gen::inRange(1, 7);
  for (int i = 0; i < count; ++i) required.angles_deg.push_back(uniform_in(-180, 180));
  const double r = uniform_in(0, 6), azimuth = uniform_in(-0.5, 0.5) * required.azimuth_deg * kRadiansPerDegree;
  for (const double d : {-1e-7, 1e-7}) {  // not on a border
    RC_PRE(both_see(view, required.angles_deg, r, azimuth + d) == both_see(view, required.angles_deg, r, azimuth));
  }
  RC_ASSERT(covered_azimuth(common_footprint(view, 0), required, r).contains(azimuth / kRadiansPerDegree) ==
            both_see(view, required.angles_deg, r, azimuth));
  const bool one_camera = std::any_of(required.angles_deg.begin(), required.angles_deg.end(),
                                      [&](double pan) { return sees(view, 0, pan * kRadiansPerDegree, r, azimuth); });
  const AzimuthSet seen = covered_azimuth(footprint(view, 0, 0), required, r);
  RC_PRE(seen.contains(azimuth / kRadiansPerDegree - 1e-5) == seen.contains(azimuth / kRadiansPerDegree + 1e-5));
  RC_ASSERT(seen.contains(azimuth / kRadiansPerDegree) == one_camera);
  RC_ASSERT(!seen.contains(required.azimuth_deg / 2 + 1e-3) || required.azimuth_deg > 359.99);
}

// The far edge is a chord: an azimuth is in the set exactly if its ray intersects that chord.
RC_GTEST_PROP(PanCoverage, FarEdgeAgreesWithTheTopRows, ()) {
  PanRequirements required = pans({}, uniform_in(1, 360));
  const int count = *rc::gen::inRange(1, 7);
  for (int i = 0; i < count; ++i) required.angles_deg.push_back(uniform_in(-180, 180));
  const double azimuth_deg = uniform_in(-0.5, 0.5) * required.azimuth_deg;
  const PanCoverage coverage = pan_coverage(kPanningPair, required);
  double offset_m = 1e9;  // lateral offset from the nearest pan at which the ray meets its top row
  for (const double pan : required.angles_deg) {
    const double off = std::remainder(azimuth_deg - pan, 360) * kRadiansPerDegree;
    if (std::cos(off) > 1e-6) offset_m = std::min(offset_m, std::abs(kFar_m * std::tan(off)));
  }
  RC_PRE(std::abs(offset_m - kAside_m) > 1e-6 && std::abs(offset_m - (kAside_m - 0.1)) > 1e-6);
  RC_ASSERT(coverage.azimuth_far.contains(azimuth_deg) == (offset_m < kAside_m));
  RC_ASSERT(coverage.azimuth_far_stereo.contains(azimuth_deg) == (offset_m < kAside_m - 0.1));
}

// Independent reference: the camera models and mounts of the shipped rig.
TEST(PanCoverage, FullCoverageAgreesWithTheShippedRig) {
  const Rig rig = read_rig_yaml(testing::source_folder() + "/config/rigs/rover.yaml").value();
  const auto cameras_see = [&](double r) {
    for (const char* name : {"wide_left", "wide_right"}) {
      const Camera& c = *rig.find_camera(name);
      const Pose camera_from_body =
          rig.body_from_camera(name, 35 * kRadiansPerDegree, 39 * kRadiansPerDegree).inverse();
      const auto pixel = project(c.model, camera_from_body * Eigen::Vector3d(r * std::cos(60 * kRadiansPerDegree),
                                                                             r * std::sin(60 * kRadiansPerDegree), 0));
      if (!pixel || pixel->x() < -0.5 || pixel->x() > c.size.width - 0.5 || pixel->y() < -0.5 ||
          pixel->y() > c.size.height - 0.5) {
        return false;
      }
    }
    return true;
  };
  DistanceSpan seen{6, 0};
  for (double r = 0.1; r < 6; r += 1e-4) {
    if (!cameras_see(r)) continue;
    seen = {std::min(seen.from_m, r), std::max(seen.to_m, r)};
  }
  const auto held = pan_coverage(kPanningPair, pans({-35, 0, 35}, 120)).full_coverage;
  EXPECT_NEAR(held.value().from_m, seen.from_m, 2e-4);
  EXPECT_NEAR(held->to_m, seen.to_m, 2e-4);
  EXPECT_NEAR(seen.to_m, 2.05, 0.005);
}

TEST(PanCoverage, Text) {
  EXPECT_EQ(to_text(AzimuthSet()), "nowhere");
  EXPECT_EQ(to_text(AzimuthSet::around(0, 10).rotated_by({-30, 20})), "-40.0 to -20.0, 10.0 to 30.0 deg");
  EXPECT_EQ(describe_overlaps(pan_coverage(kPanningPair, pans({-35, 0, 35}, 120))),
            "Neighbouring pans overlap by 30.0 % of the view, at the far edge by 25.6 % (one camera) and 21.6 % (both "
            "cameras)");
  EXPECT_EQ(describe_overlaps(pan_coverage(kPanningPair, pans({-80, 0, 80}, 120)), "°"),
            "Neighbouring pans leave a gap of 30.0°, at the far edge of 32.9° (one camera) and 35.4° (both cameras)");
  EXPECT_EQ(describe_overlaps(pan_coverage(kPanningPair, pans({0, 48}, 120))),
            "Neighbouring pans overlap by 4.0 % of the view; at the far edge they leave a gap of 0.9 deg (one camera), "
            "leave a gap of 3.4 deg (both cameras)");
}

}  // namespace
}  // namespace spartan
