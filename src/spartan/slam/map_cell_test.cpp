#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "spartan/slam/tile_store.h"

namespace spartan {
namespace {

CellSurface seen(float elevation, float variance, std::int32_t stop = 0) {
  CellSurface s;
  s.elevation_m = s.lowest_m = s.highest_m = elevation;
  s.variance_m2 = variance;
  s.count = 5;
  s.occupancy_logodds = -1;
  s.stop = stop;
  s.votes = 1;
  return s;
}

TEST(MapCell, FusesByVariance) {
  MapCell cell = fuse_observation({}, seen(0.10F, 4e-4F), {});
  cell = fuse_observation(cell, seen(0.12F, 1e-4F, 1), {});
  EXPECT_NEAR(cell.surface.elevation_m, (0.10 * 1 + 0.12 * 4) / 5, 1e-6);
  EXPECT_NEAR(cell.surface.variance_m2, 0.8e-4, 1e-9);
  EXPECT_EQ(cell.surface.count, 10);
  EXPECT_EQ(cell.surface.stop, 0) << "the first stop that observed it";
  EXPECT_EQ(cell.surface.votes, 2);
  EXPECT_FLOAT_EQ(cell.surface.lowest_m, 0.11F);
  EXPECT_FLOAT_EQ(cell.surface.highest_m, cell.surface.elevation_m);
  EXPECT_FLOAT_EQ(cell.surface.occupancy_logodds, -2);
  EXPECT_FALSE(cell.alternative.observed());
}

// N observations with the independent variance i and the common one c have the mean's variance i/N + c.
TEST(MapCell, CountingDoesNotShrinkTheCommonPartOfTheVariance) {
  CellSurface observation = seen(0.1F, 5e-4F);
  observation.common_variance_m2 = 4e-4F;
  MapCell cell;
  for (int i = 0; i < 10; ++i) cell = fuse_observation(cell, observation, {});
  EXPECT_NEAR(cell.surface.variance_m2, 1e-4 / 10 + 4e-4, 1e-8);
  EXPECT_NEAR(cell.surface.common_variance_m2, 4e-4, 1e-8);
}

TEST(MapCell, AnObservationWithALargerCommonErrorHasNoWeight) {
  CellSurface near = seen(0.1F, 2e-4F), far = seen(0.12F, 30e-4F);
  near.common_variance_m2 = 1e-4F;
  far.common_variance_m2 = 29e-4F;
  const MapCell cell = fuse_observation(fuse_observation({}, near, {}), far, {});
  EXPECT_FLOAT_EQ(cell.surface.elevation_m, 0.1F);
  EXPECT_FLOAT_EQ(cell.surface.variance_m2, 2e-4F);
  EXPECT_FLOAT_EQ(cell.surface.common_variance_m2, 1e-4F);
}

// The common part is a floor of the variance of a confirmed surface, which a wrong match from nearby is below.
TEST(MapCell, AContradictionFromNearbyDoesNotReplaceAConfirmedSurface) {
  CellSurface far = seen(0.1F, 3e-4F), near = seen(0.6F, 6e-5F);
  far.common_variance_m2 = 2.3e-4F;
  near.common_variance_m2 = 5e-5F;
  MapCell cell;
  for (int i = 0; i < 30; ++i) cell = fuse_observation(cell, far, {});
  cell = fuse_observation(cell, near, {});
  EXPECT_FLOAT_EQ(cell.surface.elevation_m, 0.1F);
}

TEST(MapCell, AnOutlierDoesNotChangeTheSurface) {
  const MapCell before = fuse_observation({}, seen(0.1F, 1e-4F), {});
  const MapCell after = fuse_observation(before, seen(0.4F, 1e-4F), {});
  EXPECT_EQ(after.surface, before.surface);
  EXPECT_FLOAT_EQ(after.alternative.elevation_m, 0.4F);
}

TEST(MapCell, ConfirmationDiscardsTheAlternative) {
  MapCell cell = fuse_observation({}, seen(0.1F, 1e-4F), {});
  cell = fuse_observation(cell, seen(0.4F, 1e-4F), {});
  cell = fuse_observation(cell, seen(0.1F, 1e-4F), {});
  EXPECT_FALSE(cell.alternative.observed());
}

TEST(MapCell, RepeatedContradictionReplacesTheSurface) {
  MapCell cell;
  for (int i = 0; i < 3; ++i) cell = fuse_observation(cell, seen(0.1F, 1e-4F), {});
  int needed = 0;
  while (cell.surface.elevation_m < 0.3F && needed < 20) {
    cell = fuse_observation(cell, seen(0.4F, 1e-4F, 7), {});
    ++needed;
  }
  EXPECT_EQ(needed, 3) << "as many contradictions as there were confirmations";
  EXPECT_EQ(cell.surface.stop, 7);
  EXPECT_FLOAT_EQ(cell.alternative.elevation_m, 0.1F);
}

TEST(MapCell, TheFirstContradictionWinsWhereItIsKnownBetter) {
  const MapCell from_afar = fuse_observation({}, seen(0.1F, 25e-4F), {});
  const MapCell after = fuse_observation(from_afar, seen(0.6F, 4e-6F, 3), {});
  EXPECT_FLOAT_EQ(after.surface.elevation_m, 0.6F);
  EXPECT_FLOAT_EQ(after.alternative.elevation_m, 0.1F);
  MapCell confirmed = from_afar;
  for (int i = 0; i < 30; ++i) confirmed = fuse_observation(confirmed, seen(0.1F, 25e-4F), {});
  EXPECT_FLOAT_EQ(fuse_observation(confirmed, seen(0.6F, 4e-4F), {}).surface.elevation_m, 0.1F) << "30 against one";
}

TEST(MapCell, OneWrongPointDoesNotWidenTheReliefForEver) {
  MapCell cell;
  for (int i = 0; i < 20; ++i) cell = fuse_observation(cell, seen(0.1F, 1e-4F), {});
  CellSurface wrong = seen(0.1F, 1e-4F);
  wrong.highest_m = 0.4F;
  cell = fuse_observation(cell, wrong, {});
  EXPECT_LT(cell.surface.highest_m, 0.14F);
  for (int i = 0; i < 40; ++i) cell = fuse_observation(cell, seen(0.1F, 1e-4F), {});
  EXPECT_LT(cell.surface.highest_m, 0.102F);
}

TEST(MapCell, ReliefWidensTheGate) {
  CellSurface rough = seen(0.1F, 1e-4F);
  rough.highest_m = 0.5F;  // 0.15 of 0.4 m is 6 cm
  const MapCell cell = fuse_observation(fuse_observation({}, rough, {}), seen(0.25F, 1e-4F), {});
  EXPECT_FALSE(cell.alternative.observed());
  EXPECT_TRUE(
      fuse_observation(fuse_observation({}, seen(0.1F, 1e-4F), {}), seen(0.25F, 1e-4F), {}).alternative.observed());
}

TEST(MapCell, KindFollowsTheLogOdds) {
  EXPECT_EQ(MapCell{}.kind(), GroundClass::unknown);
  CellSurface s = seen(0, 1e-4F);
  EXPECT_EQ((MapCell{s, {}}.kind()), GroundClass::ground);
  s.occupancy_logodds = 2;
  s.shape = 1;
  EXPECT_EQ((MapCell{s, {}}.kind()), GroundClass::obstacle);
  s.shape = -1;
  EXPECT_EQ((MapCell{s, {}}.kind()), GroundClass::cavity);
}

// Any sequence of observations, empty ones included.
CellSurface any_observation() {
  CellSurface s = seen(static_cast<float>(*rc::gen::inRange(-30, 30)) * 0.01F,
                       static_cast<float>(*rc::gen::inRange(1, 400)) * 1e-6F);
  s.count = static_cast<float>(*rc::gen::inRange(0, 4));
  s.occupancy_logodds = static_cast<float>(*rc::gen::inRange(-5, 5));
  return s;
}

RC_GTEST_PROP(MapCell, ObservationsNeverRaiseTheVariance, ()) {
  MapCell cell;
  bool any = false;
  for (int i = *rc::gen::inRange(1, 30); i > 0; --i) {
    const CellSurface observation = any_observation();
    const MapCell next = fuse_observation(cell, observation, {});
    if (cell.surface.observed()) RC_ASSERT(next.surface.variance_m2 <= cell.surface.variance_m2);
    any = any || observation.observed();
    cell = next;
    RC_ASSERT(cell.surface.observed() == any);
    RC_ASSERT(any || cell.kind() == GroundClass::unknown);
    if (any) RC_ASSERT(cell.surface.variance_m2 >= 4e-6F * 0.999F);
  }
}

TEST(MapCell, WithoutAnObservedClassItIsUnknownUntilOneIsObserved) {
  CellSurface unclassified = seen(0.1F, 1e-4F);
  unclassified.occupancy_logodds = 0;
  unclassified.votes = 0;
  MapCell cell = fuse_observation({}, unclassified, {});
  EXPECT_TRUE(cell.surface.observed());
  EXPECT_EQ(cell.kind(), GroundClass::unknown);
  cell = fuse_observation(cell, seen(0.1F, 1e-4F), {});
  EXPECT_EQ(cell.kind(), GroundClass::ground);
}

}  // namespace
}  // namespace spartan
