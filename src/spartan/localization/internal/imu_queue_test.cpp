#include "spartan/localization/internal/imu_queue.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

ImuSample sample(std::int64_t ns) {
  return {{ns}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
}

TEST(ImuQueue, KeepsTheOrderBeyondItsCapacity) {
  ImuQueue queue;
  EXPECT_TRUE(queue.empty());
  std::int64_t next = 0, oldest = 0;
  for (int round = 0; round < 7; ++round) {
    while (!queue.full()) queue.push(sample(next++));
    EXPECT_EQ(queue.size(), ImuQueue::kCapacity);
    EXPECT_EQ(queue[5].stamp.ns, oldest + 5);
    for (int i = 0; i < 37; ++i) {
      EXPECT_EQ(queue.front().stamp.ns, oldest++);
      queue.pop();
    }
  }
  while (!queue.empty()) {
    EXPECT_EQ(queue.front().stamp.ns, oldest++);
    queue.pop();
  }
  EXPECT_EQ(oldest, next);
}

}  // namespace
}  // namespace spartan::internal
