#include "spartan/core/image.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <type_traits>

namespace spartan {
namespace {

template <class T>
class ImageOf : public ::testing::Test {};
using PixelTypes = ::testing::Types<std::uint8_t, std::uint16_t, float, double, Rgb8, Rgb16>;
TYPED_TEST_SUITE(ImageOf, PixelTypes);

TYPED_TEST(ImageOf, RowsAreAligned) {
  for (const int width : {1, 7, 21, 22, 63, 64, 65, 1226}) {
    const Image<TypeParam> image(width, 3);
    EXPECT_GE(image.stride(), width);
    for (int y = 0; y < 3; ++y) {
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(image.row(y)) % Image<TypeParam>::kAlignment, 0U) << width;
    }
  }
}

TYPED_TEST(ImageOf, IsZeroInitializedAndStoresValues) {
  Image<TypeParam> image(5, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 5; ++x) EXPECT_EQ(image(x, y), TypeParam{});
  }
  TypeParam value{};
  if constexpr (std::is_arithmetic_v<TypeParam>) {
    value = 42;
  } else {
    value = {1, 2, 3};
  }
  image(4, 3) = value;
  EXPECT_EQ(image.row(3)[4], value);
  EXPECT_EQ(image(3, 3), TypeParam{});
  EXPECT_EQ(image(4, 2), TypeParam{});
  const Image<TypeParam> filled(5, 4, value);
  EXPECT_EQ(filled(0, 0), value);
  EXPECT_EQ(filled(4, 3), value);
}

Image<int> numbered(int width, int height) {
  Image<int> image(width, height);
  for (int y = 0; y < height; ++y) std::iota(image.row(y), image.row(y) + width, 100 * y);
  return image;
}

TEST(Image, EmptyAndInvalidSizes) {
  EXPECT_TRUE(Image<int>().empty());
  EXPECT_TRUE(Image<int>(0, 5).empty());
  EXPECT_TRUE(Image<int>(5, 0).empty());
  EXPECT_TRUE(Image<int>(0, 5).clone().empty());
  EXPECT_THROW(Image<int>(-1, 5), std::invalid_argument);
}

TEST(Image, AMovedFromImageIsEmpty) {
  static_assert(!std::is_copy_constructible_v<Image<int>>);
  static_assert(std::is_nothrow_move_constructible_v<Image<int>>);
  Image<int> from = numbered(4, 3);
  const int* const data = from.data();
  Image<int> to(1, 1);
  to = std::move(from);
  EXPECT_EQ(to.data(), data);
  EXPECT_EQ(to(3, 2), 203);
  EXPECT_TRUE(from.empty());  // NOLINT(bugprone-use-after-move): documented
  EXPECT_EQ(from.data(), nullptr);
}

TEST(Image, ClonesAreIndependent) {
  Image<int> original = numbered(4, 3);
  const Image<int> copy = original.clone();
  original(1, 1) = -1;
  EXPECT_EQ(copy(1, 1), 101);
  EXPECT_EQ(copy.size(), original.size());
}

TEST(ImageView, CropsShareThePixels) {
  Image<int> image = numbered(6, 5);
  const ImageView<int> part = image.view().crop(2, 1, 3, 4);
  EXPECT_EQ(part.size(), (ImageSize{3, 4}));
  EXPECT_EQ(part(0, 0), 102);
  EXPECT_EQ(part(2, 3), 404);
  part(0, 0) = -7;
  EXPECT_EQ(image(2, 1), -7);
  EXPECT_EQ(part.crop(1, 1, 1, 1)(0, 0), 203);
  EXPECT_TRUE(part.crop(3, 4, 0, 0).empty());
  EXPECT_EQ(Image<int>::copy_of(part)(2, 3), 404);
}

TEST(ImageView, RejectsCropsOutsideTheImage) {
  const Image<int> image(6, 5);
  EXPECT_NO_THROW(image.view().crop(0, 0, 6, 5));
  EXPECT_THROW(image.view().crop(-1, 0, 1, 1), std::out_of_range);
  EXPECT_THROW(image.view().crop(0, -1, 1, 1), std::out_of_range);
  EXPECT_THROW(image.view().crop(1, 0, 6, 1), std::out_of_range);
  EXPECT_THROW(image.view().crop(0, 1, 1, 5), std::out_of_range);
  EXPECT_THROW(image.view().crop(0, 0, -1, 1), std::out_of_range);
  EXPECT_THROW(image.view().crop(1, 1, std::numeric_limits<int>::max(), 1), std::out_of_range);
}

TEST(ImageView, ContainsItsPixels) {
  const Image<int> image(6, 5);
  EXPECT_TRUE(image.contains(5, 4));
  EXPECT_FALSE(image.contains(6, 4));
  EXPECT_FALSE(image.view().contains(5, 5));
  EXPECT_FALSE(image.view().contains(-1, 0));
}

}  // namespace
}  // namespace spartan
