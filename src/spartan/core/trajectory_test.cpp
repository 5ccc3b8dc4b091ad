#include "spartan/core/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "spartan/numerics/random.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

Trajectory random_trajectory(std::uint64_t seed, std::size_t count) {
  Random random(seed);
  Trajectory trajectory;
  std::int64_t ns = 1'403'715'273'262'142'976;
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3d rotation(random.normal(), random.normal(), random.normal());
    trajectory.push_back({Stamp{ns}, Pose(exp_so3(rotation), {100 * random.normal(), random.normal(), -5.0})});
    ns += 1 + random.below(100'000'000);
  }
  return trajectory;
}

void expect_same(const Trajectory& a, const Trajectory& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].stamp, b[i].stamp);
    EXPECT_LE((a[i].pose.matrix() - b[i].pose.matrix()).cwiseAbs().maxCoeff(), 1e-9) << i;
  }
}

TEST(Trajectory, EveryFormatRoundTrips) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Trajectory trajectory = random_trajectory(seed, 1 + seed);
    std::vector<Stamp> stamps;
    for (const auto& entry : trajectory) stamps.push_back(entry.stamp);
    expect_same(parse_tum(to_tum(trajectory), "a").value(), trajectory);
    expect_same(parse_euroc(to_euroc(trajectory), "a").value(), trajectory);
    expect_same(parse_kitti(to_kitti(trajectory), "a", stamps).value(), trajectory);
  }
}

TEST(Trajectory, LinesHaveTheDocumentedFormat) {
  const Trajectory one{{Stamp{1'500'000'000}, Pose(exp_so3({0, 0, 0}), {1, 2, 3})}};
  EXPECT_EQ(to_tum(one),
            "1.500000000 1.000000000 2.000000000 3.000000000 0.000000000000 0.000000000000 0.000000000000 "
            "1.000000000000\n");
  EXPECT_THAT(to_euroc(one), HasSubstr("\n1500000000,1.000000000,2.000000000,3.000000000,1.000000000000,0.0"));
  EXPECT_THAT(to_kitti(one), HasSubstr("1.000000000000e+00 0.000000000000e+00 0.000000000000e+00 1.000000000000e+00 "));
}

TEST(Trajectory, IgnoresCommentsBlankLinesAndCarriageReturns) {
  const auto trajectory = parse_tum("# a, comment\r\n\r\n1 0 0 0 0 0 0 1\r\n \t\n2 1 0 0 0 0 0 1", "a.tum");
  ASSERT_TRUE(trajectory) << trajectory.error().message();
  EXPECT_EQ(trajectory->size(), 2U);
}

std::string error_of(const Result<Trajectory>& result) {
  EXPECT_FALSE(result);
  if (result) return {};
  EXPECT_EQ(result.error().code, ErrorCode::input);
  return result.error().message();
}

TEST(Trajectory, ErrorsNameFileAndLine) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  EXPECT_THAT(error_of(parse_tum(good + "2 0 0 0 0 0 0\n", "a.tum")), HasSubstr("a.tum:2: 7 values"));
  EXPECT_THAT(error_of(parse_tum(good + "2 0 0 0 0 0 0 1 9\n", "a.tum")), HasSubstr("a.tum:2: 9 values"));
  EXPECT_THAT(error_of(parse_tum("#\n" + good + "2 0 nan 0 0 0 0 1\n", "a.tum")), HasSubstr("a.tum:3: 'nan'"));
  EXPECT_THAT(error_of(parse_tum(good + "2 0 1x 0 0 0 0 1\n", "a.tum")), HasSubstr("a.tum:2: '1x'"));
  EXPECT_THAT(error_of(parse_tum(good + "2 0 0 0 0 0 0 0\n", "a.tum")), HasSubstr("a.tum:2: the quaternion"));
  EXPECT_THAT(error_of(parse_tum(good + "1 0 0 0 0 0 0 1\n", "a.tum")), HasSubstr("a.tum:2: the time stamp"));
  EXPECT_THAT(error_of(parse_tum("x 0 0 0 0 0 0 1\n", "a.tum")), HasSubstr("a.tum:1: 'x' is not a time"));
  EXPECT_THAT(error_of(parse_tum("# nothing\n", "a.tum")), HasSubstr("a.tum: contains no poses"));
  EXPECT_THAT(error_of(parse_euroc("1.5,0,0,0,1,0,0,0\n", "a.csv")), HasSubstr("a.csv:1: '1.5'"));
  EXPECT_THAT(error_of(parse_euroc("1,0,0,0,1,0,0\n", "a.csv")), HasSubstr("a.csv:1: 7 values"));
  EXPECT_THAT(error_of(parse_kitti("1 0 0 0 0 1 0 0 0 0 2 0\n", "a.txt", {})), HasSubstr("a.txt:1: the left 3×3"));
  EXPECT_THAT(error_of(parse_kitti("1 0 0 0 0 1 0 0 0 0 -1 0\n", "a.txt", {})), HasSubstr("a.txt:1: the left 3×3"));
  EXPECT_THAT(error_of(parse_kitti("1 0 0\n", "a.txt", {})), HasSubstr("a.txt:1: 3 values"));
}

TEST(Trajectory, KittiStampsComeFromTimesTxt) {
  const testing::TemporaryFolder folder;
  const std::string line = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const std::string path = folder.write("poses.txt", line + line);
  auto loaded = load_trajectory(path);
  ASSERT_TRUE(loaded);
  EXPECT_FALSE(loaded->has_stamps);
  EXPECT_EQ(loaded->poses[1].stamp.ns, 1'000'000'000);

  folder.write("times.txt", "0.5\n6.036224e-01\n");
  loaded = load_trajectory(path);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->format, TrajectoryFormat::kitti);
  EXPECT_TRUE(loaded->has_stamps);
  EXPECT_FALSE(loaded->has_rotation);
  EXPECT_EQ(loaded->poses[0].stamp.ns, 500'000'000);
  EXPECT_EQ(loaded->poses[1].stamp.ns, 603'622'400);

  folder.write("times.txt", "0.5\n");
  EXPECT_FALSE(load_trajectory(path)) << "fewer stamps than poses";
  folder.write("times.txt", "0.5\nsoon\n");
  EXPECT_THAT(load_trajectory(path).error().where, HasSubstr("times.txt:2"));
}

TEST(Trajectory, FormatsAreDetectedFromTheContent) {
  const testing::TemporaryFolder folder;
  const Trajectory trajectory = random_trajectory(3, 4);
  const auto format_of = [&](const std::string& text) { return load_trajectory(folder.write("a", text))->format; };
  EXPECT_EQ(format_of(to_tum(trajectory)), TrajectoryFormat::tum);
  EXPECT_EQ(format_of("# stamp, x, y\n" + to_tum(trajectory)), TrajectoryFormat::tum);
  EXPECT_EQ(format_of(to_euroc(trajectory)), TrajectoryFormat::euroc);
  EXPECT_EQ(format_of("1403715274302142976,1,2,3,1,0,0,0,0.1,0.2,0.3,0,0,0,0,0,0\n"), TrajectoryFormat::euroc);
  EXPECT_EQ(format_of(to_kitti(trajectory)), TrajectoryFormat::kitti);
  EXPECT_FALSE(load_trajectory(folder.write("a", "")));
  EXPECT_FALSE(load_trajectory(folder.write("a", "1 2 3\n")));
  EXPECT_FALSE(load_trajectory(folder.path()));
}

TEST(Trajectory, PathLengthIsThatOfThePolyline) {
  EXPECT_EQ(path_length({}), 0.0);
  const auto at = [](double x, double y) { return StampedPose{{}, Pose::from_translation({x, y, 0})}; };
  EXPECT_DOUBLE_EQ(path_length({at(0, 0), at(3, 4), at(3, 4), at(0, 4)}), 8.0);
}

// Any text gives poses or an error of code `input`.
RC_GTEST_PROP(Trajectory, ParsersSurviveAnyText, (const std::string& noise)) {
  for (const auto& result : {parse_tum(noise, "n"), parse_kitti(noise, "n", {}), parse_euroc(noise, "n")}) {
    if (!result) RC_ASSERT(result.error().code == ErrorCode::input);
  }
}

}  // namespace
}  // namespace spartan
