#include "spartan/rig/design/pan_view.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/rig/design/pan_words.h"
#include "spartan/rig/formats/rig_files.h"
#include "spartan/testing/real_data.h"

namespace spartan {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const GroundView kWide{1.0, 39 * kDegree, 50 * kDegree, 50 * kDegree, 0.20};
const double kTan = std::tan(25 * kDegree);
// Half of what one eye and both eyes span at the far edge, and the borders of the middle column: by hand.
const double kFar_m = 1 / std::tan(14 * kDegree), kNear_m = 1 / std::tan(64 * kDegree);
const double kAside_m = kTan / (std::sin(39 * kDegree) - kTan * std::cos(39 * kDegree));
const double kOneEye_deg = std::atan2(kAside_m, kFar_m) / kDegree;
const double kBothEyes_deg = std::atan2(kAside_m - 0.1, kFar_m) / kDegree;

PanRequirements pans(std::vector<double> angles_deg, double azimuth_deg) {
  PanRequirements asked;
  asked.angles_deg = std::move(angles_deg);
  asked.azimuth_deg = azimuth_deg;
  return asked;
}

double some(double low, double high) {
  return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1'000'001);
}

// Whether the pixel of a point is in the picture of an eye, by projecting it: knows nothing of polygons or intervals.
bool sees(const GroundView& view, double eye_left_m, double pan_rad, double r, double azimuth_rad) {
  const double ahead = r * std::cos(azimuth_rad - pan_rad), left = r * std::sin(azimuth_rad - pan_rad) - eye_left_m;
  const double depth = ahead * std::cos(view.tilt_rad) + view.height_m * std::sin(view.tilt_rad);
  const double up = ahead * std::sin(view.tilt_rad) - view.height_m * std::cos(view.tilt_rad);
  return depth > 0 && std::abs(left) < depth * std::tan(view.hfov_rad / 2) &&
         std::abs(up) < depth * std::tan(view.vfov_rad / 2);
}
bool both_see(const GroundView& view, const std::vector<double>& pans_deg, double r, double azimuth_rad) {
  return std::any_of(pans_deg.begin(), pans_deg.end(), [&](double pan_deg) {
    return sees(view, view.baseline_m / 2, pan_deg * kDegree, r, azimuth_rad) &&
           sees(view, -view.baseline_m / 2, pan_deg * kDegree, r, azimuth_rad);
  });
}

// Between which distances both eyes see all of so many directions, walking out in small steps; the longest walk.
DistanceSpan held_by_walking(const GroundView& view, const PanRequirements& asked, double to_m) {
  constexpr double kStep_m = 5e-3;
  constexpr int kDirections = 360;
  DistanceSpan longest, span;
  bool before = false;
  for (double r = kStep_m / 2; r < to_m; r += kStep_m) {
    bool all = true;
    for (int i = 0; all && i <= kDirections; ++i) {
      all = both_see(view, asked.angles_deg, r, (1.0 * i / kDirections - 0.5) * asked.azimuth_deg * kDegree);
    }
    if (all && !before) span.from_m = r;
    if (all) span.to_m = r;
    if (all && span.to_m - span.from_m > longest.to_m - longest.from_m) longest = span;
    before = all;
  }
  return longest;
}

void expect_sectors(const AzimuthSet& set, const std::vector<AzimuthSector>& expected) {
  ASSERT_EQ(set.sectors().size(), expected.size()) << in_words(set);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(set.sectors()[i].from_deg, expected[i].from_deg, 1e-9);
    EXPECT_NEAR(set.sectors()[i].to_deg, expected[i].to_deg, 1e-9);
  }
}

TEST(PanView, ThePublishedPans) {
  const PanFigures figures = pan_figures(kWide, pans({-35, 0, 35}, 120));
  expect_sectors(figures.azimuth_far, {{-35 - kOneEye_deg, 35 + kOneEye_deg}});
  expect_sectors(figures.azimuth_far_stereo, {{-35 - kBothEyes_deg, 35 + kBothEyes_deg}});
  EXPECT_NEAR(figures.azimuth_far.width_deg(), 117.1, 0.05);
  EXPECT_NEAR(figures.azimuth_far_stereo.width_deg(), 114.6, 0.05);
  EXPECT_NEAR(figures.overlap->percent(), 30, 1e-9);
  ASSERT_TRUE(figures.azimuth_held);
  // The outermost ray stands 25 degrees off its pan. It comes in at the bottom row, and leaves where the half of the
  // view's width, less half a baseline, is what it is aside: both linear in the distance along it.
  EXPECT_NEAR(figures.azimuth_held->from_m, kNear_m / std::cos(25 * kDegree), 1e-8);
  const double per_m_ahead = kTan * std::cos(39 * kDegree), at_foot = kTan * std::sin(39 * kDegree) - 0.1;
  EXPECT_NEAR(figures.azimuth_held->to_m, at_foot / (std::sin(25 * kDegree) - per_m_ahead * std::cos(25 * kDegree)),
              1e-8);
}

TEST(PanView, GapsAreNotSeen) {
  const PanFigures three = pan_figures(kWide, pans({-80, 0, 80}, 120));
  expect_sectors(three.azimuth_far, {{-60, -80 + kOneEye_deg}, {-kOneEye_deg, kOneEye_deg}, {80 - kOneEye_deg, 60}});
  expect_sectors(three.azimuth_far_stereo,
                 {{-60, -80 + kBothEyes_deg}, {-kBothEyes_deg, kBothEyes_deg}, {80 - kBothEyes_deg, 60}});
  EXPECT_FALSE(three.azimuth_held);
  EXPECT_NEAR(three.overlap->gap_deg(), 30, 1e-9);
  EXPECT_NEAR(three.overlap->percent(), -60, 1e-9);
  EXPECT_NEAR(three.far_overlap_stereo->gap_deg(), 80 - 2 * kBothEyes_deg, 1e-9);
  const PanFigures uneven = pan_figures(kWide, pans({-60, -35, 35}, 120));
  expect_sectors(uneven.azimuth_far, {{-60, -35 + kOneEye_deg}, {35 - kOneEye_deg, 35 + kOneEye_deg}});
}

TEST(PanView, PansToOneSideLeaveTheOther) {
  const PanFigures figures = pan_figures(kWide, pans({0, 35, 70}, 120));
  expect_sectors(figures.azimuth_far, {{-kOneEye_deg, 60}});
  expect_sectors(figures.azimuth_far_stereo, {{-kBothEyes_deg, 60}});
  EXPECT_FALSE(figures.azimuth_held);
  EXPECT_NEAR(figures.overlap->percent(), 30, 1e-9);
}

TEST(PanView, ANarrowAzimuthIsHeldAsFarAsThePanBeforeItSees) {
  const PanFigures figures = pan_figures(kWide, pans({-35, 0, 35}, 10));
  expect_sectors(figures.azimuth_far, {{-5, 5}});
  EXPECT_NEAR(figures.azimuth_held.value().from_m, kNear_m / std::cos(5 * kDegree), 1e-8);
  EXPECT_NEAR(figures.azimuth_held->to_m, kFar_m, 1e-8) << "straight ahead the top row comes first";
}

TEST(PanView, AllAround) {
  const PanFigures four = pan_figures(kWide, pans({-180, -90, 0, 90, 180}, 360));
  EXPECT_NEAR(four.azimuth_far.width_deg(), 4 * 2 * kOneEye_deg, 1e-9) << "two of the five are one";
  EXPECT_NEAR(four.azimuth_far_stereo.width_deg(), 4 * 2 * kBothEyes_deg, 1e-9);
  EXPECT_FALSE(four.azimuth_held);
  std::vector<double> twelve_deg;
  for (int pan = -180; pan < 180; pan += 30) twelve_deg.push_back(pan);
  const PanFigures twelve = pan_figures(kWide, pans(twelve_deg, 360));
  EXPECT_EQ(twelve.azimuth_far_stereo.width_deg(), 360);
  EXPECT_NEAR(twelve.azimuth_held.value().from_m, kNear_m / std::cos(15 * kDegree), 1e-8);
  EXPECT_NEAR(twelve.azimuth_held->to_m, kFar_m, 1e-8);
  // The last and the first are neighbours, too.
  EXPECT_EQ(pans({-100, 0, 100}, 360).widest_step_deg(), 160);
  EXPECT_EQ(pans({-100, 0, 100}, 300).widest_step_deg(), 100);
}

TEST(PanView, ALowestRowBehindTheRoverLeavesNothingBlind) {
  GroundView steep = kWide;
  steep.tilt_rad = 80 * kDegree;
  const auto held = pan_figures(steep, pans({-35, 0, 35}, 120)).azimuth_held;
  ASSERT_TRUE(held);
  EXPECT_EQ(held->from_m, 0);
}

// Pans that stand close see farther together than straight ahead of one of them.
TEST(PanView, HeldSpansAreThoseOfWalkingOut) {
  GroundView apart = kWide;
  apart.baseline_m = 0.6;
  for (const auto& [view, asked] :
       {std::pair{kWide, pans({-35, 0, 35}, 120)}, std::pair{kWide, pans({-60, -35, 35}, 120)},
        std::pair{kWide, pans({-60, -50, -40, -30, -20, -10, 0, 10, 20, 30, 40, 50, 60}, 120)},
        std::pair{kWide, pans({-35, 0, 35}, 10)}, std::pair{kWide, pans({0, 35, 70}, 40)},
        std::pair{apart, pans({-40, -20, 0, 20, 40}, 90)}}) {
    const DistanceSpan walked = held_by_walking(view, asked, 6);
    const auto held = pan_figures(view, asked).azimuth_held;
    ASSERT_TRUE(held);
    EXPECT_NEAR(held->from_m, walked.from_m, 6e-3);
    EXPECT_NEAR(held->to_m, walked.to_m, 6e-3);
  }
}

// Any pans, gapped or not, any view: a direction is in the set exactly where a pixel sees its point.
RC_GTEST_PROP(PanView, TheAzimuthSeenAtADistanceIsWhatPixelsSee, ()) {
  GroundView view = kWide;
  view.tilt_rad = some(26, 89) * kDegree;
  view.baseline_m = some(0, 1.5);
  PanRequirements asked = pans({}, some(1, 360));
  const int count = *rc::gen::inRange(1, 7);
  for (int i = 0; i < count; ++i) asked.angles_deg.push_back(some(-180, 180));
  const double r = some(0, 6), azimuth = some(-0.5, 0.5) * asked.azimuth_deg * kDegree;
  for (const double d : {-1e-7, 1e-7}) {  // not on a border
    RC_PRE(both_see(view, asked.angles_deg, r, azimuth + d) == both_see(view, asked.angles_deg, r, azimuth));
  }
  RC_ASSERT(seen_azimuth(common_footprint(view, 0), asked, r).contains(azimuth / kDegree) ==
            both_see(view, asked.angles_deg, r, azimuth));
  const bool one_eye = std::any_of(asked.angles_deg.begin(), asked.angles_deg.end(),
                                   [&](double pan) { return sees(view, 0, pan * kDegree, r, azimuth); });
  const AzimuthSet seen = seen_azimuth(footprint(view, 0, 0), asked, r);
  RC_PRE(seen.contains(azimuth / kDegree - 1e-5) == seen.contains(azimuth / kDegree + 1e-5));
  RC_ASSERT(seen.contains(azimuth / kDegree) == one_eye);
  RC_ASSERT(!seen.contains(asked.azimuth_deg / 2 + 1e-3) || asked.azimuth_deg > 359.99);
}

// The far edge is the chord of the top row: a direction is in the set exactly where the ray to that chord hits it.
RC_GTEST_PROP(PanView, TheFarEdgeIsSeenWhereAPansTopRowIs, ()) {
  PanRequirements asked = pans({}, some(1, 360));
  const int count = *rc::gen::inRange(1, 7);
  for (int i = 0; i < count; ++i) asked.angles_deg.push_back(some(-180, 180));
  const double azimuth_deg = some(-0.5, 0.5) * asked.azimuth_deg;
  const PanFigures figures = pan_figures(kWide, asked);
  double one_eye_aside = 1e9;  // how far aside of the nearest pan's axis the ray meets the line of its top row
  for (const double pan : asked.angles_deg) {
    const double off = std::remainder(azimuth_deg - pan, 360) * kDegree;
    if (std::cos(off) > 1e-6) one_eye_aside = std::min(one_eye_aside, std::abs(kFar_m * std::tan(off)));
  }
  RC_PRE(std::abs(one_eye_aside - kAside_m) > 1e-6 && std::abs(one_eye_aside - (kAside_m - 0.1)) > 1e-6);
  RC_ASSERT(figures.azimuth_far.contains(azimuth_deg) == (one_eye_aside < kAside_m));
  RC_ASSERT(figures.azimuth_far_stereo.contains(azimuth_deg) == (one_eye_aside < kAside_m - 0.1));
}

// The rig's own camera models and mounts know nothing of all this.
TEST(PanView, TheAskedAzimuthIsHeldAsFarAsTheCamerasSay) {
  const Rig rig = read_rig_yaml(testing::source_folder() + "/config/rigs/rover.yaml").value();
  const auto cameras_see = [&](double r) {
    for (const char* name : {"wide_left", "wide_right"}) {
      const Camera& c = *rig.find_camera(name);
      const Pose camera_from_body = rig.body_from_camera(name, 35 * kDegree, 39 * kDegree).inverse();
      const auto pixel = project(
          c.model, camera_from_body * Eigen::Vector3d(r * std::cos(60 * kDegree), r * std::sin(60 * kDegree), 0));
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
  const auto held = pan_figures(kWide, pans({-35, 0, 35}, 120)).azimuth_held;
  EXPECT_NEAR(held.value().from_m, seen.from_m, 2e-4);
  EXPECT_NEAR(held->to_m, seen.to_m, 2e-4);
  EXPECT_NEAR(seen.to_m, 2.05, 0.005);
}

TEST(PanView, Words) {
  EXPECT_EQ(in_words(AzimuthSet()), "nowhere");
  EXPECT_EQ(in_words(AzimuthSet::around(0, 10).turned_by({-30, 20})), "-40.0 to -20.0, 10.0 to 30.0 deg");
  EXPECT_EQ(
      overlaps_in_words(pan_figures(kWide, pans({-35, 0, 35}, 120))),
      "Neighbouring pans overlap by 30.0 % of the view, at the far edge by 25.6 % (one eye) and 21.6 % (both eyes)");
  EXPECT_EQ(overlaps_in_words(pan_figures(kWide, pans({-80, 0, 80}, 120)), "°"),
            "Neighbouring pans leave a gap of 30.0°, at the far edge of 32.9° (one eye) and 35.4° (both eyes)");
  EXPECT_EQ(overlaps_in_words(pan_figures(kWide, pans({0, 48}, 120))),
            "Neighbouring pans overlap by 4.0 % of the view; at the far edge they leave a gap of 0.9 deg (one eye), "
            "leave a gap of 3.4 deg (both eyes)");
}

}  // namespace
}  // namespace spartan
