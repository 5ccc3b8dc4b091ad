#include "spartan/rig_design/rig_designer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <tuple>

#include "spartan/testing/real_data.h"

namespace spartan {
namespace {

const RigRequirements& rover_requirements() {
  static const RigRequirements requirements =
      read_requirements(testing::source_folder() + "/config/requirements/rover.yaml").value();
  return requirements;
}
const RigDesign& rover_design() {
  static const RigDesign design = design_rig(rover_requirements());
  return design;
}

// The design after a change of the requirements.
RigDesign design_after(const std::function<void(RigRequirements&)>& change) {
  RigRequirements requirements = rover_requirements();
  change(requirements);
  return design_rig(requirements);
}

const DesignWarning* find_warning(const RigDesign& design, const std::string& id) {
  const auto found = std::find_if(design.warnings.begin(), design.warnings.end(),
                                  [&](const DesignWarning& warning) { return warning.id == id; });
  return found == design.warnings.end() ? nullptr : &*found;
}

void expect_warning(const RigDesign& design, const std::string& id, double value, double tolerance) {
  const DesignWarning* warning = find_warning(design, id);
  ASSERT_NE(warning, nullptr) << id;
  EXPECT_NEAR(warning->value, value, tolerance) << warning->text;
}

using Whole = std::tuple<int, int, int, int, int>;  // cm, dm, degrees, px, hundredths of µm

Whole whole(const PairParameters& s) {
  const auto rounded = [](double value) { return static_cast<int>(std::lround(value)); };
  return {rounded(100 * s.baseline_m), rounded(10 * s.nearest_m), rounded(s.hfov_deg), s.width_px,
          rounded(100 * s.pixel_size_um)};
}

// The same limits in another form, with integers in centimetres and in long double, without roots and arc tangents.
// Resolution: r b w ≥ 2 c L² tan(F/2). Stereo angle: b/2 ≤ d tan(7.5°). Search range φ ≤ F/4: b/2 ≤ d tan(F/8).
std::set<Whole> feasible_by_tangents() {
  const long double degree = std::numbers::pi_v<long double> / 180;
  std::set<Whole> feasible;
  for (int b = 10; b <= 30; ++b) {
    for (int d = 6; d <= 15; ++d) {
      for (int f = 40; f <= 70; ++f) {
        for (const int w : {780, 1040, 1120, 1280}) {
          const bool reaches = 2.0L * b * w / 100 >= 2 * 30.0L * 16 * std::tan(f * degree / 2);
          const bool narrow_angle = b <= 20 * d * std::tan(7.5L * degree);
          const bool short_search = b <= 20 * d * std::tan(f * degree / 8);
          for (const int s : {454, 550, 740, 900}) {
            if (reaches && narrow_angle && short_search) feasible.insert({b, d, f, w, s});
          }
        }
      }
    }
  }
  return feasible;
}

TEST(RigDesigner, FindsTheFeasibleSetOfThePublishedLists) {
  const PairDesign& wide = rover_design().pairs[0];
  EXPECT_EQ(wide.combinations, 128960u);
  EXPECT_EQ(wide.feasible.size(), 12592u);
  EXPECT_EQ(wide.with_pan_overlap_count, 8876u);
  EXPECT_EQ(count_feasible(rover_requirements().pairs[0]), 12592u);
  std::set<Whole> found;
  for (const PairMetrics& pair : wide.feasible) found.insert(whole(pair.parameters));
  EXPECT_EQ(found, feasible_by_tangents());
  EXPECT_TRUE(found.contains({20, 10, 50, 1120, 550})) << "the published pair";
  EXPECT_GT(wide.smallest_limit_distance, 1e-6) << "no value is so close to its limit that rounding matters";
}

TEST(RigDesigner, ReproducesThePublishedWidePair) {
  ASSERT_TRUE(rover_design().pairs[0].published);
  const PairMetrics& pair = *rover_design().pairs[0].published;
  EXPECT_TRUE(pair.feasible);
  EXPECT_TRUE(rover_design().pairs[0].published_is_candidate);
  EXPECT_NEAR(pair.range_m, 4.00, 0.005);
  EXPECT_NEAR(pair.focal_length_mm, 6.6, 0.05);
  EXPECT_NEAR(pair.stereo_angle_deg, 11.4, 0.05);
  EXPECT_NEAR(pair.search_percent, 22.8, 0.05);
  EXPECT_NEAR(pair.view_near_m, 0.488, 0.0005);
  EXPECT_NEAR(pair.view_far_m, 4.011, 0.0005);
  EXPECT_NEAR(pair.pan_overlap_percent, 30, 1e-9);
  EXPECT_NEAR(pair.margins.range_m, pair.range_m - 4, 1e-12);
  EXPECT_NEAR(pair.margins.baseline_m, 0.1, 1e-12);
  // The tilt rule yields the published tilt.
  EXPECT_EQ(metrics_of(pair.parameters, rover_requirements().pairs[0]).tilt_deg, 39);
}

TEST(RigDesigner, ReproducesThePublishedNarrowPair) {
  ASSERT_TRUE(rover_design().pairs.size() == 2 && rover_design().pairs[1].published);
  const PairMetrics& pair = *rover_design().pairs[1].published;
  EXPECT_FALSE(pair.feasible) << "a resolution of 2 cm only up to 1.99 m";
  EXPECT_NEAR(pair.range_m, 1.99, 0.005);
  EXPECT_NEAR(pair.view_near_m, 0.200, 0.0005);
  EXPECT_NEAR(pair.view_far_m, 2.516, 0.0005);
  EXPECT_NEAR(rover_design().view_overlap_m.value(), 2.03, 0.005);
  EXPECT_EQ(rover_design().pairs[1].with_pan_overlap_count, std::nullopt);
  RigRequirements without_tilt = rover_requirements();
  without_tilt.pairs[1].published->tilt_deg.reset();
  EXPECT_EQ(published_metrics(without_tilt.pairs[1]).tilt_deg, 31.55) << "the tilt rule yields the published tilt";
}

TEST(RigDesigner, SortsTheBestFirst) {
  const PairDesign& wide = rover_design().pairs[0];
  for (std::size_t i = 1; i < wide.feasible.size(); ++i) {
    const PairMetrics &better = wide.feasible[i - 1], &worse = wide.feasible[i];
    if (better.range_m > worse.range_m + 1e-8) continue;
    ASSERT_GE(better.range_m, worse.range_m - 1e-8);
    if (better.pan_overlap_percent > worse.pan_overlap_percent + 1e-8) continue;
    ASSERT_GE(better.pan_overlap_percent, worse.pan_overlap_percent - 1e-8);
    ASSERT_LE(better.parameters.baseline_m, worse.parameters.baseline_m);
  }
  // The largest b w / tan(F/2) of the feasible set, by an independent loop.
  double largest = 0;
  for (const auto& [b, d, f, w, s] : feasible_by_tangents()) {
    largest = std::max(largest, b * w / std::tan(f * std::numbers::pi / 360));
  }
  EXPECT_NEAR(wide.best()->range_m, std::sqrt(largest / 100 / 30), 1e-12);
  EXPECT_EQ(wide.equally_good, 4u) << "the pixel sizes";
  ASSERT_TRUE(wide.best_with_pan_overlap);
  EXPECT_GE(wide.best_with_pan_overlap->pan_overlap_percent, 25);
  for (const PairMetrics& pair : wide.feasible) {
    if (pair.with_pan_overlap) {
      EXPECT_EQ(pair.parameters, wide.best_with_pan_overlap->parameters);
      break;
    }
  }
}

// 0.15 m · 1040 px and 0.20 m · 780 px have the same range; then the shorter baseline decides, not the list order.
TEST(RigDesigner, EqualValuesAreDecidedByTheNextCriterion) {
  const auto lists = [](RigRequirements& r) {
    r.pairs[0].lists = {{0.20, 0.15}, {1.5}, {45, 50}, {5.5}, {780, 1040}};
    r.pairs[0].range_m = 3;
  };
  const RigDesign design = design_after(lists);
  std::vector<Whole> order;
  order.reserve(design.pairs[0].feasible.size());
  for (const PairMetrics& pair : design.pairs[0].feasible) order.push_back(whole(pair.parameters));
  const auto position = [&](const Whole& parameters) {
    return std::find(order.begin(), order.end(), parameters) - order.begin();
  };
  EXPECT_EQ(position({15, 15, 45, 1040, 550}) + 1, position({20, 15, 45, 780, 550}));
  const RigDesign by_overlap = design_after([&](RigRequirements& r) {
    lists(r);
    r.pairs[0].order = {DesignCriterion::pan_overlap, DesignCriterion::shorter_baseline, DesignCriterion::range_margin};
  });
  EXPECT_EQ(whole(by_overlap.pairs[0].best()->parameters), (Whole{15, 15, 50, 1040, 550}));
}

// Values to either side of a multiple of 1e-9 are equal; so are the ends of a chain of such values.
TEST(RigDesigner, ValuesThatDifferByLessThanOneInABillionAreEqual) {
  const RigDesign design = design_after([](RigRequirements& r) {
    r.pairs[0].lists = {
        {0.2, 0.2000000005 - 1e-13, 0.2000000005 + 1e-13, 0.2000000011, 0.21}, {1.5}, {45}, {5.5}, {1120}};
    r.pairs[0].order = {DesignCriterion::shorter_baseline};
    r.pairs[0].range_m = 3;
  });
  ASSERT_EQ(design.pairs[0].feasible.size(), 5u);
  EXPECT_EQ(design.pairs[0].equally_good, 4u);
  EXPECT_EQ(design.pairs[0].best()->parameters.baseline_m, 0.2) << "in the order of the list";
  EXPECT_EQ(design.pairs[0].feasible.back().parameters.baseline_m, 0.21);
}

TEST(RigDesigner, ValuesOnALimitPassWithAWarning) {
  const RigDesign design = design_after([](RigRequirements& r) {
    r.pairs[0].lists = {{0.2}, {1}, {60}, {5.5}, {1120}};
    r.pairs[0].range_m = r.pairs[0].height_m = 1;
    r.pairs[0].largest_stereo_angle_deg = 2 * std::atan(0.1) * 180 / std::numbers::pi;
    r.pairs[0].published->parameters.hfov_deg = 60;
    r.pairs[0].published->tilt_deg.reset();
  });
  EXPECT_EQ(design.pairs[0].feasible.size(), 1u);
  EXPECT_NE(find_warning(design, "on_a_limit"), nullptr);
  EXPECT_EQ(find_warning(rover_design(), "on_a_limit"), nullptr);
}

TEST(RigDesigner, WarnsOfAllInconsistenciesOfThePublishedRig) {
  const RigDesign& design = rover_design();
  expect_warning(design, "not_unique", 12591, 0);
  EXPECT_NE(find_warning(design, "not_unique")->text.find("8875 of them with enough overlap"), std::string::npos);
  expect_warning(design, "pixel_size_never_binds", 3148, 0);
  expect_warning(design, "baseline_limit_never_binds", 0.14, 1e-12);
  expect_warning(design, "stereo_angle_limits_disagree", 11.4, 0.05);
  expect_warning(design, "azimuth_far", 117.1, 0.05);
  expect_warning(design, "azimuth_far_stereo", 114.6, 0.05);
  expect_warning(design, "azimuth_held_to", 2.05, 0.005);
  expect_warning(design, "pan_overlap_far", 25.6, 0.05);
  expect_warning(design, "pan_overlap_far_stereo", 21.6, 0.05);
  expect_warning(design, "range_short", 1.99, 0.005);
  expect_warning(design, "accuracy_needed", 0.19, 0.005);
  expect_warning(design, "width_needed", 2.51, 0.005);
  expect_warning(design, "nearest_row", 0.36, 0.005);
  expect_warning(design, "largest_disparity", 185, 0.5);
  expect_warning(design, "focal_length_misfit", 3.65, 0.005);
  expect_warning(design, "vertical_view_misfit", 51.9, 0.05);
  EXPECT_EQ(design.warnings.size(), 16u) << "and no others";
  EXPECT_EQ(find_warning(design, "azimuth_far")->pair, "wide");
  EXPECT_EQ(find_warning(design, "range_short")->pair, "narrow");
}

// Corrected requirements no longer cause warnings.
TEST(RigDesigner, WarningsFollowTheRequirements) {
  const RigDesign consistent = design_after([](RigRequirements& r) {
    r.pairs[0].contradicting_stereo_angle_deg.reset();
    r.pairs[0].pans->azimuth_deg = 110;
    r.pairs[1].disparity_accuracy_px = 0.18;
    r.pairs[1].published->focal_length_mm = 3.65;
    r.pairs[1].published->vfov_deg = 51.9;
    r.pairs[1].published->tilt_deg = 33;
    r.pairs[1].published->parameters.nearest_m = 0.3;
  });
  for (const char* id :
       {"stereo_angle_limits_disagree", "azimuth_far", "azimuth_far_stereo", "azimuth_held_to", "range_short",
        "accuracy_needed", "width_needed", "nearest_row", "focal_length_misfit", "vertical_view_misfit"}) {
    EXPECT_EQ(find_warning(consistent, id), nullptr) << id;
  }
  const RigDesign stereo_only = design_after([](RigRequirements& r) { r.pairs[0].pans->azimuth_deg = 115; });
  EXPECT_EQ(find_warning(stereo_only, "azimuth_far"), nullptr);
  EXPECT_NE(find_warning(stereo_only, "azimuth_far_stereo"), nullptr);
  const RigDesign binding = design_after([](RigRequirements& r) { r.pairs[0].smallest_baseline_m = 0.2; });
  EXPECT_EQ(find_warning(binding, "baseline_limit_never_binds"), nullptr);
  EXPECT_LT(binding.pairs[0].feasible.size(), 12592u);
  const RigDesign infeasible = design_after([](RigRequirements& r) {
    r.pairs[0].published->parameters = {0.35, 0.6, 45, 5.5, 1120};
    r.pairs[0].pans->angles_deg = {-50, 0, 50};
    r.pairs[0].smallest_baseline_m = 0.4;
  });
  for (const char* id : {"nothing_feasible", "stereo_angle_large", "search_large", "baseline_short", "pan_overlap"}) {
    EXPECT_NE(find_warning(infeasible, id), nullptr) << id;
  }
  EXPECT_FALSE(infeasible.pairs[0].published_is_candidate);
  EXPECT_EQ(infeasible.pairs[0].best(), nullptr);
}

// Range by L² = r b w / (2 c tan(F/2)).
TEST(RigDesigner, WhereNothingIsFeasibleTheNearestCandidateIsNamedWithWhatItMisses) {
  const RigDesign design = design_after([](RigRequirements& r) {
    r.pairs[0].lists = {{0.20}, {1}, {50}, {5.5}, {780, 1120}};
    r.pairs[0].range_m = 8;
  });
  const PairDesign& pair = design.pairs[0];
  EXPECT_EQ(pair.meeting.range, 0u);
  EXPECT_EQ(pair.meeting.stereo_angle, 2u);
  ASSERT_TRUE(pair.nearest);
  EXPECT_EQ(pair.nearest->parameters.width_px, 1120);
  const double range = std::sqrt(0.02 * 0.2 * 1120 / (2 * 0.3 * std::tan(25 * std::numbers::pi / 180)));
  EXPECT_NEAR(pair.nearest->margins.range_m, range - 8, 1e-9);
  const DesignWarning* warning = find_warning(design, "nothing_feasible");
  ASSERT_NE(warning, nullptr);
  EXPECT_THAT(warning->text, ::testing::HasSubstr("none has a range of 8 m; the nearest candidate (baseline 0.2 m"));
  EXPECT_THAT(warning->text, ::testing::HasSubstr("misses: range by 4 m (50 %)"));
  EXPECT_FALSE(rover_design().pairs[0].nearest) << "something is feasible";
}

// A short baseline has the range, a long one the stereo angle: no limit alone is out of reach.
TEST(RigDesigner, LimitsThatContradictEachOtherAreSaid) {
  const RigDesign design = design_after([](RigRequirements& r) {
    r.pairs[0].lists = {{0.10, 0.30}, {0.6}, {50}, {5.5}, {1120}};
    r.pairs[0].range_m = 4;
  });
  const DesignWarning* warning = find_warning(design, "nothing_feasible");
  ASSERT_NE(warning, nullptr);
  EXPECT_THAT(warning->text, ::testing::HasSubstr("each limit can be met, but not all together"));
  EXPECT_EQ(design.pairs[0].nearest->parameters.baseline_m, 0.10);
}

TEST(RigDesigner, SearchesAnyNumberOfPairs) {
  RigRequirements three = rover_requirements();
  three.pairs.push_back(three.pairs[1]);
  three.pairs[2].name = "rear";
  const RigDesign design = design_rig(three);
  ASSERT_EQ(design.pairs.size(), 3u);
  EXPECT_EQ(design.pairs[2].name, "rear");
  EXPECT_EQ(design.view_overlap_m, rover_design().view_overlap_m);
  three.pairs[2].published->tilt_deg = 70;
  EXPECT_EQ(design_rig(three).view_overlap_m, 0) << "what all of them see";
}

TEST(RigDesigner, CandidatesAreInEveryList) {
  const PairParameters published = rover_requirements().pairs[0].published->parameters;
  PairParameters others[] = {published, published, published, published, published};
  others[0].baseline_m = 0.205;
  others[1].nearest_m = 1.05;
  others[2].hfov_deg = 50.5;
  others[3].pixel_size_um = 5.6;
  others[4].width_px = 1100;
  for (const PairParameters& parameters : others) {
    const RigDesign design = design_after([&](RigRequirements& r) {
      r.pairs[0].lists = {{0.2}, {1}, {50}, {5.5}, {1120}};
      r.pairs[0].published->parameters = parameters;
    });
    EXPECT_FALSE(design.pairs[0].published_is_candidate);
  }
}

// The published tilt is used, not that of the rule; the nearest ground is straight down.
TEST(RigDesigner, PublishedTiltIsUsed) {
  const RigDesign steep = design_after([](RigRequirements& r) { r.pairs[1].published->tilt_deg = 70; });
  const PairMetrics& narrow = *steep.pairs[1].published;
  EXPECT_EQ(narrow.tilt_deg, 70);
  EXPECT_NEAR(narrow.view_far_m, 0.3 / std::tan((70 - 49.5 / 2) * std::numbers::pi / 180), 1e-9);
  EXPECT_LT(narrow.view_near_m, 0) << "behind the cameras";
  expect_warning(steep, "nearest_row", 0.3, 1e-12);
  // Its view no longer overlaps that of the wide pair.
  EXPECT_EQ(steep.view_overlap_m, 0.0);
  EXPECT_NE(find_warning(steep, "views_apart"), nullptr);
  EXPECT_EQ(find_warning(rover_design(), "views_apart"), nullptr);
}

TEST(RigDesigner, PansOfAFullCircleAndTooFew) {
  const RigDesign round = design_after([](RigRequirements& r) {
    r.pairs[0].pans->angles_deg = {-180, -150, -120, -90, -60, -30, 0, 30, 60, 90, 120, 150};
    r.pairs[0].pans->azimuth_deg = 360;
  });
  EXPECT_EQ(round.pans->azimuth_far.width_deg(), 360);
  EXPECT_EQ(round.pans->azimuth_far_stereo.width_deg(), 360);
  const RigDesign few = design_after([](RigRequirements& r) { r.pairs[0].pans->azimuth_deg = 200; });
  EXPECT_FALSE(few.pans->full_coverage);
  const RigDesign uneven = design_after([](RigRequirements& r) { r.pairs[0].pans->angles_deg = {-35, 0, 20}; });
  EXPECT_NEAR(uneven.pans->overlap->percent(), 30, 1e-9) << "of the widest step";
}

// Relative to the limits the overlap is nearest: 30 % instead of 25 %, by 5 of 100.
TEST(RigDesigner, NearestLimitIsTheOverlap) {
  const RigDesign design = design_after([](RigRequirements& r) {
    r.pairs[0].lists = {{0.2}, {1}, {50}, {5.5}, {1120}};
    r.pairs[0].range_m = 3;
  });
  EXPECT_NEAR(design.pairs[0].smallest_limit_distance, 0.05, 1e-9);
}

TEST(RigDesigner, WithoutAPublishedPairTheBestIsSelected) {
  const RigDesign design = design_after([](RigRequirements& r) {
    r.pairs[0].published.reset();
    r.pairs.pop_back();
  });
  EXPECT_EQ(design.pairs[0].selected()->parameters, rover_design().pairs[0].best_with_pan_overlap->parameters);
  EXPECT_FALSE(design.view_overlap_m);
  ASSERT_TRUE(design.pans);
  EXPECT_GE(design.pans->overlap->percent(), 25);
  const RigDesign ahead_only = design_after([](RigRequirements& r) { r.pairs[0].pans.reset(); });
  EXPECT_FALSE(ahead_only.pans);
  EXPECT_EQ(ahead_only.pairs[0].feasible.size(), 12592u);
  const RigDesign one_pan = design_after([](RigRequirements& r) { r.pairs[0].pans->angles_deg = {10}; });
  EXPECT_FALSE(one_pan.pans->overlap || one_pan.pans->far_overlap || one_pan.pans->far_overlap_stereo);
  EXPECT_NEAR(one_pan.pans->azimuth_far.width_deg(), 2 * 23.54, 0.01);
}

// A baseline of 20 m: all values stay finite.
TEST(RigDesigner, PairsWithoutCommonGround) {
  const RigDesign design = design_after([](RigRequirements& r) { r.pairs[0].published->parameters.baseline_m = 20; });
  EXPECT_TRUE(design.pans->azimuth_far_stereo.empty());
  EXPECT_FALSE(design.pans->full_coverage);
  EXPECT_FALSE(design.pans->far_overlap_stereo);
  EXPECT_EQ(design.view_overlap_m, 0) << "the wide pair sees no common ground";
  expect_warning(design, "azimuth_far_stereo", 0, 0);
  expect_warning(design, "azimuth_held_to", 0, 0);
  EXPECT_EQ(find_warning(design, "pan_overlap_far_stereo"), nullptr);
  EXPECT_NE(find_warning(design, "views_apart"), nullptr);
}

RC_GTEST_PROP(RigDesigner, WarningsHaveFiniteValues, ()) {
  const auto one_of = [](std::initializer_list<double> values) { return *rc::gen::elementOf(std::vector(values)); };
  RigRequirements r = rover_requirements();
  r.pairs[0].lists = r.pairs[1].lists = {{0.1, 0.2}, {1}, {50}, {5.5}, {1120}};
  const std::size_t count = *rc::gen::inRange<std::size_t>(1, 6);
  r.pairs[0].pans->angles_deg.clear();
  for (std::size_t i = 0; i < count; ++i) r.pairs[0].pans->angles_deg.push_back(*rc::gen::inRange(-36, 37) * 5);
  std::sort(r.pairs[0].pans->angles_deg.begin(), r.pairs[0].pans->angles_deg.end());
  r.pairs[0].pans->azimuth_deg = one_of({1e-6, 10, 120, 359, 360});
  r.pairs[0].published->parameters.baseline_m = one_of({1e-6, 0.2, 1, 20, 1e6});
  r.pairs[0].published->parameters.hfov_deg = one_of({0.1, 50, 120, 179});
  r.pairs[0].published->tilt_deg = one_of({25.5, 39, 70, 90});
  for (const DesignWarning& warning : design_rig(r).warnings) {
    RC_ASSERT(std::isfinite(warning.value));
    RC_ASSERT(warning.text.find("nan") == std::string::npos && warning.text.find("inf ") == std::string::npos);
  }
}

// At the tilt of each candidate the top row reaches the range; one step more, and it would not.
TEST(RigDesigner, TiltsReachTheRange) {
  for (const PairMetrics& pair : rover_design().pairs[0].feasible) {
    ASSERT_GE(pair.view_far_m, 4);
    PairMetrics lower = pair;
    lower.tilt_deg += 1;
    ASSERT_LT(far_edge_m(ground_view(lower, rover_requirements().pairs[0])), 4);
  }
}

}  // namespace
}  // namespace spartan
