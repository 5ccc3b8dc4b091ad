#include "spartan/odometry/internal/landmarks/odometer_memory.h"

#include <gtest/gtest.h>

#include <cmath>

namespace spartan::internal {
namespace {

OdometerMemory some_memory() {
  OdometerMemory memory;
  memory.started = true;
  memory.reference.stamp.ns = 1234567890123;
  memory.frames_since_reference = 2;
  memory.reference_from_latest = Pose::from_translation({0.1, 0, 0});
  memory.geometry = {{640, 480}, 500, {319.5, 239.5}, 0.12};
  memory.latest_velocity.motion << 1, 2, 3, 0.1, 0.2, 0.3;
  memory.latest_velocity.span_s = 0.1;
  memory.steady_velocity = {memory.latest_velocity.motion * 0.5, 0.2};
  memory.ambiguous_frames = 2;
  memory.offset = {0.07, 0.001};
  memory.reference.map.next_anchor_id = 9;
  memory.reference.map.anchors = {{3, exp_se3(memory.latest_velocity.motion)}, {8, Pose()}};
  for (int i = 0; i < 3; ++i) {
    Landmark l;
    l.anchor_id = i == 0 ? 3 : 8;
    l.anchor_pixel = {10.0 + i, 20};
    l.disparity = 4.25 + i;
    l.variance = 0.01;
    l.slant = {0.1, -0.2};
    l.patch.fill(static_cast<std::uint16_t>(1000 + i));
    l.pixel = {11.5, 21.25};
    l.descriptor.bytes[5] = static_cast<std::int8_t>(-i);
    l.missed_frames = i;
    memory.reference.map.landmarks.push_back(l);
  }
  memory.latest = {Stamp{1234567890999}, memory.reference.map, {}};
  memory.sharpness = {120, 130};
  memory.kept = {{Stamp{1234567880000}, memory.reference.map, {}},
                 memory.reference.stamp,
                 {Pose::from_translation({0, 0, 0.3}), Matrix6d::Identity()},
                 4,
                 2};
  return memory;
}

TEST(OdometerMemory, RestoresWhatWasSaved) {
  const Bytes bytes = some_memory().save();
  const Result<OdometerMemory> restored = OdometerMemory::restore(bytes);
  ASSERT_TRUE(restored.has_value()) << restored.error().message();
  EXPECT_EQ(restored->save(), bytes);
  EXPECT_EQ(restored->reference.map.landmarks[2].patch[0], 1002);
  EXPECT_EQ(restored->reference.map.landmarks[2].disparity, 6.25);
  EXPECT_EQ(restored->latest.map.landmarks.size(), 3U);
  EXPECT_EQ(restored->offset.value, 0.07);
  EXPECT_EQ(restored->steady_velocity.span_s, 0.2);
  EXPECT_EQ(restored->kept.frame.map.landmarks.size(), 3U);
  EXPECT_EQ(restored->kept.kept_from_reference.pose.translation().z(), 0.3);
  EXPECT_EQ(restored->kept.age, 4);
  EXPECT_EQ(restored->reference.map.anchor(3).latest_from_anchor.translation(),
            some_memory().reference.map.anchors[0].latest_from_anchor.translation());
}

TEST(OdometerMemory, KeepsDescriptorsOfEveryKind) {
  for (const DescriptorKind kind :
       {DescriptorKind::surf, DescriptorKind::sift, DescriptorKind::orb, DescriptorKind::akaze}) {
    OdometerMemory memory = some_memory();
    Descriptor& descriptor = memory.reference.map.landmarks[1].descriptor;
    descriptor.kind = kind;
    descriptor.bytes[bytes_of(kind) - 1] = -3;
    const auto restored = OdometerMemory::restore(memory.save());
    ASSERT_TRUE(restored.has_value()) << restored.error().message();
    EXPECT_EQ(restored->reference.map.landmarks[1].descriptor, descriptor);
    EXPECT_EQ(restored->reference.map.landmarks[0].descriptor.kind, DescriptorKind::surf);
  }
}

TEST(OdometerMemory, RejectsOtherVersionsAndDamagedBytes) {
  const Bytes whole = some_memory().save();
  Bytes other = whole;
  other[0] = 99;
  ASSERT_FALSE(OdometerMemory::restore(other).has_value());
  EXPECT_EQ(OdometerMemory::restore(other).error().code, ErrorCode::configuration);
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    const auto result = OdometerMemory::restore(cut);
    ASSERT_FALSE(result.has_value()) << length;
    EXPECT_EQ(result.error().code, ErrorCode::store_damaged);
  }
  Bytes longer = whole;
  longer.push_back(0);
  EXPECT_FALSE(OdometerMemory::restore(longer).has_value());
}

// A state with a valid checksum may come from anyone.
TEST(OdometerMemory, RejectsValuesThatAreNotPossible) {
  const auto is_rejected = [](auto change) {
    OdometerMemory memory = some_memory();
    change(memory);
    const auto restored = OdometerMemory::restore(memory.save());
    return !restored && restored.error().code == ErrorCode::store_damaged;
  };
  EXPECT_FALSE(is_rejected([](OdometerMemory&) {}));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.reference.map.landmarks[1].pixel.x() = -1e285; }));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.reference.map.landmarks[1].anchor_pixel.y() = std::nan(""); }));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.reference.map.landmarks[1].variance = -1; }));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.reference.map.landmarks[1].missed_frames = 2'147'483'647; }));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.steady_velocity.motion[4] = std::nan(""); }));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.ambiguous_frames = -1; }));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.kept.age = -1; }));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.kept.frame.map.landmarks[0].anchor_id = 77; }));
  EXPECT_TRUE(is_rejected([](OdometerMemory& m) { m.reference.stamp.ns = -9'223'372'036'854'775'807; }));
}

TEST(LandmarkMemory, DropsUnusedAnchors) {
  LandmarkMemory memory = some_memory().reference.map;
  std::erase_if(memory.landmarks, [](const Landmark& l) { return l.anchor_id == 3; });
  memory.drop_unused_anchors();
  ASSERT_EQ(memory.anchors.size(), 1u);
  EXPECT_EQ(memory.anchor(8).id, 8u);
  EXPECT_THROW(memory.anchor(3), std::logic_error);
}

}  // namespace
}  // namespace spartan::internal
