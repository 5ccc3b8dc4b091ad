#include "spartan/odometry/internal/detection/descriptor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

constexpr DescriptorKind kKinds[] = {DescriptorKind::surf, DescriptorKind::sift, DescriptorKind::orb,
                                     DescriptorKind::akaze};

Descriptor random_descriptor(DescriptorKind kind, Random& random) {
  Descriptor d;
  d.kind = kind;
  for (std::size_t i = 0; i < bytes_of(kind); ++i) d.bytes[i] = static_cast<std::int8_t>(random.below(256));
  return d;
}

TEST(Descriptor, DistanceIsSymmetricZeroForItselfAndInfiniteBetweenKinds) {
  Random random(1);
  for (const DescriptorKind kind : kKinds) {
    const Descriptor a = random_descriptor(kind, random), b = random_descriptor(kind, random);
    EXPECT_EQ(squared_distance(a, a), 0);
    EXPECT_GT(squared_distance(a, b), 0);
    EXPECT_EQ(squared_distance(a, b), squared_distance(b, a));
    for (const DescriptorKind other : kKinds) {
      if (other == kind) continue;
      EXPECT_EQ(squared_distance(a, random_descriptor(other, random)), std::numeric_limits<double>::infinity());
    }
  }
}

TEST(Descriptor, DistanceKeepsTheTriangleInequality) {
  Random random(2);
  for (const DescriptorKind kind : kKinds) {
    for (int i = 0; i < 100; ++i) {
      const Descriptor a = random_descriptor(kind, random), c = random_descriptor(kind, random);
      Descriptor b = a;  // every entry is that of a or c, so half of the way between them
      for (std::size_t k = 0; k < bytes_of(kind); ++k) b.bytes[k] = random.below(2) == 0 ? a.bytes[k] : c.bytes[k];
      EXPECT_LE(std::sqrt(squared_distance(a, c)),
                std::sqrt(squared_distance(a, b)) + std::sqrt(squared_distance(b, c)) + 1e-12);
    }
  }
}

TEST(Descriptor, DistanceIsThatOfTheUnitVectorsOrOfTheBits) {
  Descriptor a, b;
  a.bytes[0] = 127;  // orthogonal vectors of length 1/2
  b.bytes[63] = -127;
  EXPECT_NEAR(squared_distance(a, b), 0.5, 1e-12);
  a = b = {DescriptorKind::sift, {}};
  a.bytes[127] = static_cast<std::int8_t>(255);  // entries are not signed: 0.6 · 255 / 512
  EXPECT_NEAR(std::sqrt(squared_distance(a, b)), 0.6 * 255 / 512, 1e-12);
  a = b = {DescriptorKind::orb, {}};
  a.bytes[0] = static_cast<std::int8_t>(0xff);
  a.bytes[31] = 1;
  EXPECT_NEAR(std::sqrt(squared_distance(a, b)), 1.35 * 9 / 256, 1e-12);
  a = b = {DescriptorKind::akaze, {}};
  a.bytes[60] = 0x3f;  // the last six of 486 bits
  EXPECT_NEAR(std::sqrt(squared_distance(a, b)), 1.4 * 6 / 486, 1e-12);
}

TEST(Descriptor, ItsLengthTellsItsKind) {
  for (const DescriptorKind kind : kKinds) EXPECT_EQ(descriptor_kind_of(bytes_of(kind)), kind);
  for (const std::size_t length : {0U, 33U, 63U, 127U, 129U}) EXPECT_FALSE(descriptor_kind_of(length)) << length;
}

}  // namespace
}  // namespace spartan::internal
