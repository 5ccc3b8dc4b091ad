#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/rig_design/rig_designer.h"

namespace spartan {
namespace {

double uniform(double low, double high) {
  return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1'000'001);
}

// Absolute difference of two azimuths.
double difference_deg(double a, double b) {
  return std::abs(std::remainder(a - b, 360));
}

std::vector<double> random_angles() {
  std::vector<double> angles(*rc::gen::inRange<std::size_t>(1, 8));
  for (double& angle : angles) angle = uniform(-400, 400);
  return angles;
}

TEST(AzimuthSet, SectorsAreSplitAt180) {
  const AzimuthSet set = AzimuthSet::around(170, 20);
  ASSERT_EQ(set.sectors().size(), 2u);
  EXPECT_EQ(set.sectors()[0].from_deg, -180);
  EXPECT_EQ(set.sectors()[0].to_deg, -170);
  EXPECT_EQ(set.sectors()[1].from_deg, 150);
  EXPECT_EQ(set.sectors()[1].to_deg, 180);
  EXPECT_EQ(set.width_deg(), 40);
  EXPECT_TRUE(set.contains(180) && set.contains(-180) && set.contains(530) && !set.contains(0));
}

TEST(AzimuthSet, EmptyAndFull) {
  EXPECT_TRUE(AzimuthSet::around(20, 0).empty());
  EXPECT_TRUE(AzimuthSet::around(20, -1).empty());
  EXPECT_EQ(AzimuthSet::around(20, 180).width_deg(), 360);
  EXPECT_EQ(AzimuthSet::all().rotated_by({77}).width_deg(), 360);
  EXPECT_TRUE(AzimuthSet::all().covers({}));
  EXPECT_FALSE(AzimuthSet().covers(AzimuthSet::all()));
  EXPECT_TRUE(AzimuthSet::all().rotated_by({}).empty());
}

TEST(AzimuthSet, TouchingSectorsAreMerged) {
  EXPECT_EQ(AzimuthSet::around(0, 15).rotated_by({-30, 0, 30}).sectors().size(), 1u);
  EXPECT_EQ(AzimuthSet::around(0, 15).rotated_by({-30, 0, 30.001}).sectors().size(), 2u);
}

RC_GTEST_PROP(AzimuthSet, ContainsAzimuthsAroundItsMiddles, ()) {
  const std::vector<double> angles = random_angles();
  const double half = uniform(0, 100), azimuth = uniform(-400, 400);
  double nearest = 360;
  for (const double angle : angles) nearest = std::min(nearest, difference_deg(angle, azimuth));
  RC_PRE(std::abs(nearest - half) > 1e-6);
  RC_ASSERT(AzimuthSet::around(0, half).rotated_by(angles).contains(azimuth) == (nearest < half));
}

RC_GTEST_PROP(AzimuthSet, IntersectionContainsWhatBothContain, ()) {
  const AzimuthSet a = AzimuthSet::around(0, uniform(1, 60)).rotated_by(random_angles()),
                   b = AzimuthSet::around(0, uniform(1, 60)).rotated_by(random_angles());
  const AzimuthSet both = a.intersected_with(b);
  const double azimuth = uniform(-180, 180);
  RC_PRE(a.contains(azimuth - 1e-6) == a.contains(azimuth + 1e-6));
  RC_PRE(b.contains(azimuth - 1e-6) == b.contains(azimuth + 1e-6));
  RC_ASSERT(both.contains(azimuth) == (a.contains(azimuth) && b.contains(azimuth)));
  RC_ASSERT(a.covers(both) && b.covers(both));
  RC_ASSERT(both.covers(a) == (both.width_deg() > a.width_deg() - 1e-9));
}

RC_GTEST_PROP(AzimuthSet, SectorsAreAscendingAndDisjoint, ()) {
  const AzimuthSet set = AzimuthSet::around(0, uniform(0, 30)).rotated_by(random_angles());
  double before = -181;
  for (const AzimuthSector& sector : set.sectors()) {
    RC_ASSERT(sector.from_deg > before && sector.to_deg > sector.from_deg);
    before = sector.to_deg;
  }
  RC_ASSERT(before <= 180);
}

}  // namespace
}  // namespace spartan
