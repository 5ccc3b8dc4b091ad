#include "spartan/imaging/internal/mirrored.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

TEST(Mirrored, ReflectsAtBothEnds) {
  for (const int size : {1, 2, 3, 7}) {
    int at = 0, way = -1;
    for (int i = 0; i < 50; ++i) {
      ASSERT_EQ(mirrored(i, size), at) << i << " of " << size;
      ASSERT_EQ(mirrored(-i, size), at) << -i << " of " << size;
      if (at + way < 0 || at + way >= size) way = -way;
      if (size > 1) at += way;
    }
  }
}

}  // namespace
}  // namespace spartan::internal
