#include <gtest/gtest.h>

#include "spartan/reconstruction/disparity_computer.h"

namespace spartan {
namespace {

TEST(DisparityMemory, TheEstimateIsAnUpperBoundAndNotFarOff) {
  for (const ImageSize size : {ImageSize{320, 240}, ImageSize{61, 43}, ImageSize{640, 80}}) {
    for (const DisparityRange range : {DisparityRange{0, 31}, DisparityRange{-20, 20}, DisparityRange{5, 60}}) {
      if (range.max >= size.width) continue;
      const Image<std::uint8_t> image(size.width, size.height, 7);
      auto computer = DisparityComputer::create({}, ThreadPool(1));
      ASSERT_TRUE(computer);
      const auto result = computer->compute(image, image, range);
      ASSERT_TRUE(result) << result.error().message();
      const auto used = static_cast<double>(result->buffer_bytes);
      const auto estimate = static_cast<double>(DisparityComputer::memory_bytes(size, range, 1));
      EXPECT_GE(estimate, used) << size.width << " " << range.min;
      EXPECT_LE(estimate, 1.6 * used) << size.width << " " << range.min;
    }
  }
}

TEST(DisparityMemory, MoreThanTheBoundIsRefusedWithBothFigures) {
  EXPECT_TRUE(DisparityComputer::check_memory({11585, 11585}, {0, 2895}, 2, 0)) << "no bound";
  const Status refused = DisparityComputer::check_memory({11585, 11585}, {0, 2895}, 2, 2'000'000'000);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::resources);
  EXPECT_NE(refused.error().message().find("11585x11585 px with 2896 disparities need 8"), std::string::npos)
      << refused.error().message();
  EXPECT_NE(refused.error().message().find("2000 MB"), std::string::npos);
}

}  // namespace
}  // namespace spartan
