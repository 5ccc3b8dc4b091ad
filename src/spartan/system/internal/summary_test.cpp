#include "spartan/system/internal/summary.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace spartan::internal {
namespace {

FrameRecord frame(int i, const std::string& status) {
  FrameRecord record;
  record.frame_id = i;
  record.pair = "narrow";
  record.stamp.ns = 100 * i;
  record.status = status;
  record.has_pose = status != "lost" && status != "missing";
  if (status == "missing") record.fault = "left_missing";
  if (status == "lost") record.message = "too few matches";
  record.world_from_body.pose = Pose::from_translation({0.5 * i, 0, 0});
  record.times = {{"odometry", 1.0 + i, 2.0}};
  return record;
}

TEST(Summary, CountsFramesByStatus) {
  const std::vector<FrameRecord> frames{frame(0, "tracking"), frame(1, "standing"), frame(2, "lost"),
                                        frame(3, "missing"),  frame(4, "lost"),     frame(5, "tracking"),
                                        frame(6, "missing"),  frame(7, "degraded")};
  RunFacts facts;
  facts.version = "1.2.3";
  facts.gravity_measured = true;
  facts.threads = 2;
  const auto json = nlohmann::json::parse(to_summary_json(facts, frames));
  EXPECT_EQ(json["schema"], 1);
  EXPECT_EQ(json["frames"], 6);
  EXPECT_EQ(json["skipped"], nlohmann::json::parse(R"({"left_missing": 2})"));
  EXPECT_EQ(json["predicted_frames"], nlohmann::json::parse("[2, 3, 4, 6]"));
  EXPECT_EQ(json["health"]["odometry"],
            nlohmann::json::parse(R"({"tracking": 2, "degraded": 1, "lost": 2, "standing": 1})"));
  EXPECT_EQ(json["world"]["gravity"], "measured");
  EXPECT_DOUBLE_EQ(json["distance_m"], 3.5);
  EXPECT_TRUE(json["resumed_from_frame"].is_null());
  EXPECT_DOUBLE_EQ(json["stages"]["odometry"]["wall_ms"]["median"], 4.0) << "nearest rank of 1 … 8";
  EXPECT_DOUBLE_EQ(json["stages"]["odometry"]["wall_ms"]["p95"], 8.0);
  EXPECT_DOUBLE_EQ(json["stages"]["odometry"]["cpu_ms"]["total"], 16.0);
}

TEST(Summary, JoinsConsecutiveLossesToOneSpan) {
  const std::vector<FrameRecord> frames{frame(0, "tracking"), frame(1, "lost"),     frame(2, "missing"),
                                        frame(3, "lost"),     frame(4, "tracking"), frame(5, "lost")};
  const auto spans = lost_spans(frames);
  ASSERT_EQ(spans.size(), 2U);
  EXPECT_EQ(spans[0].from.ns, 0);
  EXPECT_EQ(spans[0].to.ns, 400);
  EXPECT_EQ(spans[0].reason, "too few matches");
  EXPECT_EQ(spans[1].from.ns, 400);
  EXPECT_EQ(spans[1].to.ns, 500);
  EXPECT_TRUE(lost_spans({frame(0, "tracking"), frame(1, "missing"), frame(2, "tracking")}).empty())
      << "a missing frame alone is not a loss";
}

FrameRecord frame_at(double seconds, const std::string& status) {
  FrameRecord record = frame(0, status);
  record.stamp = Stamp::from_seconds(seconds);
  return record;
}

TEST(Summary, SkippedFramesBeyondTwoSecondsAreALoss) {
  const auto drive = [](double step_s) {
    std::vector<FrameRecord> frames{frame_at(0, "tracking")};
    for (int i = 1; i <= 4; ++i) frames.push_back(frame_at(i * step_s, "missing"));
    frames.push_back(frame_at(5 * step_s, "tracking"));
    return frames;
  };
  EXPECT_TRUE(lost_spans(drive(0.4)).empty()) << "2 s are bridged";
  const auto spans = lost_spans(drive(0.5));
  ASSERT_EQ(spans.size(), 1U);
  EXPECT_EQ(spans[0].from, Stamp{0});
  EXPECT_EQ(spans[0].to, Stamp::from_seconds(2.5));
  EXPECT_EQ(spans[0].reason, "4 frames skipped in 2.5 s, the first: left_missing");
  EXPECT_TRUE(
      lost_spans({frame_at(0, "tracking"), frame_at(1.5, "missing"), frame_at(3, "missing"), frame_at(4.5, "tracking")})
          .empty())
      << "two frames of a slow camera are bridged";
}

TEST(Summary, ACameraThatIsDeadToTheEndIsALoss) {
  std::vector<FrameRecord> frames{frame_at(0, "tracking")};
  for (int i = 1; i <= 30; ++i) frames.push_back(frame_at(0.1 * i, "missing"));
  const auto spans = lost_spans(frames);
  ASSERT_EQ(spans.size(), 1U);
  EXPECT_EQ(spans[0].to, Stamp::from_seconds(3));
}

TEST(Summary, AReversedStampDoesNotHideALoss) {
  std::vector<FrameRecord> frames{frame_at(10, "tracking"), frame_at(11, "missing"), frame_at(12, "missing"),
                                  frame_at(1, "missing"),   frame_at(13, "missing"), frame_at(14, "tracking")};
  frames[3].fault = "stamp_reversed";
  ASSERT_EQ(lost_spans(frames).size(), 1U);
  frames = {frame_at(10, "tracking"), frame_at(11, "missing"), frame_at(12, "missing"), frame_at(13, "missing"),
            frame_at(1, "missing")};
  frames[4].fault = "stamp_reversed";
  ASSERT_EQ(lost_spans(frames).size(), 1U);
  EXPECT_EQ(lost_spans(frames)[0].to, Stamp::from_seconds(13));
}

TEST(Summary, PathsThatAreNotUtf8AreReplaced) {
  RunFacts facts;
  facts.input = "bad\xff";
  const auto json = nlohmann::json::parse(to_summary_json(facts, {}));
  EXPECT_EQ(json["input"], "bad\xEF\xBF\xBD");
}

}  // namespace
}  // namespace spartan::internal
