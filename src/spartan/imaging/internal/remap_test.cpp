#include "spartan/imaging/internal/remap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"

namespace spartan::internal {
namespace {

constexpr ImageSize kSource{160, 120};

CameraModel camera() {
  return RadialTangentialModel({130, 131, 81, 58}, {-0.28, 0.07, 2e-4, 3e-5});
}

RectifiedStereo odd_view() {
  return {{149, 113}, 128, {75.3, 55.1}, 0.1};
}

template <class Pixel = std::uint8_t>
Image<Pixel> noise_image(ImageSize size) {
  Random random(1);
  Image<Pixel> image(size);
  for (int y = 0; y < size.height; ++y) {
    auto* const bytes = reinterpret_cast<std::uint8_t*>(image.row(y));
    for (std::size_t i = 0; i < static_cast<std::size_t>(size.width) * sizeof(Pixel); ++i) {
      bytes[i] = static_cast<std::uint8_t>(random.below(256));
    }
  }
  return image;
}

// Reference: the exact position of a view pixel in the camera image.
std::optional<Eigen::Vector2d> exact_position(const RectifiedStereo& view, const Eigen::Matrix3d& rotation, int x,
                                              int y) {
  const Eigen::Vector3d direction((x - view.centre_px.x()) / view.focal_px, (y - view.centre_px.y()) / view.focal_px,
                                  1);
  return project(camera(), rotation * direction);
}

TEST(RemapTable, PositionsAreExactToAHundredthOfAPixel) {
  const Eigen::Matrix3d rotation = exp_so3({0.02, -0.15, 0.03}).toRotationMatrix();
  const RectifiedStereo view = odd_view();
  const RemapTable table(camera(), kSource, view, rotation, {}, ThreadPool(2));
  ASSERT_FALSE(table.mask().empty());
  int valid = 0;
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      const auto exact = exact_position(view, rotation, x, y);
      const bool inside = exact && exact->x() >= 0 && exact->y() >= 0 && exact->x() <= kSource.width - 1 &&
                          exact->y() <= kSource.height - 1;
      ASSERT_EQ(table.mask()(x, y), inside ? 255 : 0) << x << ", " << y;
      if (!inside) continue;
      ++valid;
      ASSERT_LE((table.source_of(x, y) - *exact).norm(), 0.01);
    }
  }
  EXPECT_GT(valid, view.size.width * view.size.height / 2);
}

TEST(RemapTable, InterpolatesBilinearly) {
  const RectifiedStereo view = odd_view();
  const RemapTable table(camera(), kSource, view, Eigen::Matrix3d::Identity(), {}, ThreadPool(1));
  const auto source = noise_image(kSource);
  Image<std::uint8_t> result(view.size), threaded(view.size);
  table.apply(source, result, ThreadPool(1));
  table.apply(source, threaded, ThreadPool(2));
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      ASSERT_EQ(result(x, y), threaded(x, y));
      if (!table.mask().empty() && table.mask()(x, y) == 0) {
        ASSERT_EQ(result(x, y), 0);
        continue;
      }
      const Eigen::Vector2d p = table.source_of(x, y);
      const int px = std::min(static_cast<int>(p.x()), kSource.width - 2);
      const int py = std::min(static_cast<int>(p.y()), kSource.height - 2);
      const double fx = p.x() - px, fy = p.y() - py;
      const double level = (1 - fy) * ((1 - fx) * source(px, py) + fx * source(px + 1, py)) +
                           fy * ((1 - fx) * source(px, py + 1) + fx * source(px + 1, py + 1));
      ASSERT_NEAR(result(x, y), level, 0.505);
    }
  }
}

template <class Pixel>
void expect_back(const RemapTable& identity) {
  const auto source = noise_image<Pixel>(kSource);
  Image<Pixel> result(kSource);
  identity.apply(source, result, ThreadPool(1));
  for (int y = 0; y < kSource.height; ++y) {
    for (int x = 0; x < kSource.width; ++x) ASSERT_EQ(result(x, y), source(x, y)) << x << ", " << y;
  }
}

TEST(RemapTable, TheIdentityKeepsAllPixels) {
  const RectifiedStereo view{kSource, 100, {80, 60}, 0.1};
  const RemapTable table(PinholeModel{100, 100, 80, 60}, kSource, view, Eigen::Matrix3d::Identity(), {}, ThreadPool(1));
  EXPECT_TRUE(table.mask().empty());
  expect_back<std::uint8_t>(table);
  expect_back<std::uint16_t>(table);
  expect_back<Rgb8>(table);
  expect_back<Rgb16>(table);
}

// Focal lengths and centres without an exact binary form: border positions have rounding errors.
TEST(RemapTable, RoundingErrorsDoNotMaskTheBorder) {
  const auto image = noise_image(kSource);
  struct View {
    double focal_px, x, y;
  };
  for (const auto& [f, x, y] : {View{125, 79.5, 59.5}, {125.325, 77.675, 61.275}, {114.6635, 91.80375, 62.09375}}) {
    const RectifiedStereo view{kSource, f, {x, y}, 0.1};
    for (const double off : {0.0, 0.003, -0.003}) {
      const RemapTable table(PinholeModel{f, f, x + off, y - off}, kSource, view, Eigen::Matrix3d::Identity(), {},
                             ThreadPool(1));
      ASSERT_TRUE(table.mask().empty()) << f << ", off by " << off;
      Image<std::uint8_t> result(kSource);
      table.apply(image, result, ThreadPool(1));
      for (int j = 0; j < kSource.height; ++j) {
        for (int i = 0; i < kSource.width; ++i) ASSERT_EQ(result(i, j), image(i, j)) << i << ", " << j;
      }
    }
    const RemapTable beside(PinholeModel{f, f, x + 0.005, y}, kSource, view, Eigen::Matrix3d::Identity(), {},
                            ThreadPool(1));
    EXPECT_EQ(beside.mask()(kSource.width - 1, 7), 0) << "outside by more than the rounding error";
    EXPECT_EQ(beside.mask()(0, 7), 255);
  }
}

TEST(RemapTable, AppliesTheSelfMask) {
  const RectifiedStereo view{kSource, 100, {80, 60}, 0.1};
  Image<std::uint8_t> self_mask(kSource.width, kSource.height, 255);
  self_mask(50, 40) = 0;
  // The view is shifted by a quarter of a pixel: two of its pixels touch the masked one.
  const RemapTable table(PinholeModel{100, 100, 80.25, 60}, kSource, view, Eigen::Matrix3d::Identity(), self_mask,
                         ThreadPool(1));
  EXPECT_EQ(table.mask()(49, 40), 0);
  EXPECT_EQ(table.mask()(50, 40), 0);
  EXPECT_EQ(table.mask()(48, 40), 255);
  EXPECT_EQ(table.mask()(51, 40), 255);
  EXPECT_EQ(table.mask()(159, 40), 0) << "outside of the sensor";
}

template <class T>
std::array<T, 1> channels(T gray) {
  return {gray};
}
template <class T>
std::array<T, 3> channels(const Rgb<T>& colour) {
  return {colour.r, colour.g, colour.b};
}

// The formula of remap::interpolate, computed from the positions with divisions that round down.
template <class Pixel>
auto reference_sample(ImageView<const Pixel> source, const Eigen::Vector2d& position) {
  const int x = static_cast<int>(position.x()), y = static_cast<int>(position.y());
  const auto fraction_x = static_cast<std::int64_t>((position.x() - x) * 128);
  const auto fraction_y = static_cast<std::int64_t>((position.y() - y) * 128);
  auto result = channels(Pixel{});
  for (std::size_t c = 0; c < result.size(); ++c) {
    const auto at = [&](int dx, int dy) {
      const Pixel& pixel = source(std::min(x + dx, source.width() - 1), std::min(y + dy, source.height() - 1));
      return static_cast<std::int64_t>(channels(pixel)[c]);
    };
    const std::int64_t top = 128 * at(0, 0) + fraction_x * (at(1, 0) - at(0, 0));
    const std::int64_t bottom = 128 * at(0, 1) + fraction_x * (at(1, 1) - at(0, 1));
    const auto weighted =
        static_cast<std::int64_t>(std::floor(static_cast<double>(fraction_y * (bottom - top) + 64) / 128));
    result[c] = static_cast<typename decltype(result)::value_type>((top + weighted + 64) / 128);
  }
  return result;
}

struct Case {
  const char* what;
  ImageSize source, view;
  double focal_px;
  Eigen::Vector3d rotation;
};

// Smooth views, steep views (more than two source rows in a block), views with blocks wider than a load, and sources as
// wide as a load or narrower.
const Case kCases[] = {{"smooth", {160, 120}, {149, 113}, 128, {0.01, -0.02, 0.01}},
                       {"magnified", {160, 120}, {165, 37}, 400, {0, 0, -0.05}},
                       {"steep", {160, 120}, {131, 120}, 130, {0.02, 0.03, 0.6}},
                       {"upright", {160, 120}, {97, 90}, 130, {0, 0, 1.5}},
                       {"minified", {160, 120}, {101, 64}, 50, {0, 0, 0.1}},
                       {"a narrow view", {160, 120}, {5, 3}, 128, {0, 0, 0}},
                       {"past every border", {67, 45}, {96, 64}, 130, {0, 0, 0}},
                       {"past every border, turned", {67, 45}, {96, 64}, 130, {0, 0, 0.1}},
                       {"a source as wide as a load", {16, 20}, {33, 21}, 130, {0, 0, 0}},
                       {"an odd source, magnified", {19, 20}, {64, 70}, 500, {0, 0, 0}},
                       {"a narrow source", {15, 20}, {33, 21}, 130, {0, 0, 0}},
                       {"the least source", {2, 2}, {8, 8}, 500, {0, 0, 0}}};

CameraModel lens_for(const Case& c) {
  return RadialTangentialModel({130, 131, c.source.width / 2.0, c.source.height / 2.0}, {-0.28, 0.07, 2e-4, 3e-5});
}

RemapTable table_for(const Case& c, SimdTarget simd, ImageView<const std::uint8_t> self_mask = {}) {
  const RectifiedStereo view{c.view, c.focal_px, {(c.view.width - 1) / 2.0, (c.view.height - 1) / 2.0}, 0.1};
  return {lens_for(c), c.source, view, exp_so3(c.rotation).toRotationMatrix(), self_mask, ThreadPool(2), 1, simd};
}

// The source ends with its last row, so that a sanitizer detects reads beyond it; the result is part of a larger image
// whose other pixels must not change.
template <class Pixel>
void expect_reference_formula(const RemapTable& table) {
  const auto [width, height] = table.source_size();
  const auto noise = noise_image<Pixel>({width + 3, height});
  std::vector<Pixel> pixels;
  pixels.reserve(static_cast<std::size_t>((width + 3) * height - 3));
  for (int y = 0; y < height; ++y) {
    pixels.insert(pixels.end(), noise.row(y), noise.row(y) + width + (y + 1 < height ? 3 : 0));
  }
  const ImageView<const Pixel> source(pixels.data(), width, height, width + 3);

  const Pixel untouched = source(0, 0);
  Image<Pixel> canvas(table.size().width + 5, table.size().height, untouched);
  const auto result = canvas.view().crop(0, 0, table.size().width, table.size().height);
  table.apply(source, result, ThreadPool(2));
  int seen = 0;
  for (int y = 0; y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      if (x >= result.width()) {
        ASSERT_EQ(canvas(x, y), untouched) << x << ", " << y;
      } else if (table.mask().empty() || table.mask()(x, y) == 255) {
        ++seen;
        ASSERT_EQ(channels(result(x, y)), reference_sample(source, table.source_of(x, y))) << x << ", " << y;
      } else {
        ASSERT_EQ(result(x, y), Pixel{}) << x << ", " << y;
      }
    }
  }
  EXPECT_GT(seen, 0);
}

template <class Pixel>
void expect_reference_formula_on_every_target() {
  for (const Case& c : kCases) {
    Random random(5);
    Image<std::uint8_t> holes(c.source);
    for (int y = 0; y < c.source.height; ++y) {
      for (int x = 0; x < c.source.width; ++x) holes(x, y) = random.below(16) == 0 && x + y > 2 ? 0 : 255;
    }
    for (SimdTarget simd : available_simd_targets()) {
      SCOPED_TRACE(std::string(c.what) + ", " + std::string(name_of(simd)));
      expect_reference_formula<Pixel>(table_for(c, simd));
      expect_reference_formula<Pixel>(table_for(c, simd, holes));
    }
  }
}

TEST(RemapTable, EveryTargetMatchesTheReference8Bit) {
  expect_reference_formula_on_every_target<std::uint8_t>();
}

TEST(RemapTable, EveryTargetMatchesTheReference16Bit) {
  expect_reference_formula_on_every_target<std::uint16_t>();
}

TEST(RemapTable, EveryTargetMatchesTheReferenceRgb8) {
  expect_reference_formula_on_every_target<Rgb8>();
}

TEST(RemapTable, EveryTargetMatchesTheReferenceRgb16) {
  expect_reference_formula_on_every_target<Rgb16>();
}

TEST(RemapTable, AConstantImageStaysConstant) {
  for (const Case& c : kCases) {
    const RemapTable table = table_for(c, SimdTarget::automatic);
    const Image<Rgb16> source(c.source.width, c.source.height, Rgb16{65535, 1, 40000});
    Image<Rgb16> result(c.view);
    table.apply(source, result, ThreadPool(1));
    for (int y = 0; y < c.view.height; ++y) {
      for (int x = 0; x < c.view.width; ++x) {
        const bool valid = table.mask().empty() || table.mask()(x, y) == 255;
        ASSERT_EQ(result(x, y), valid ? source(0, 0) : Rgb16()) << c.what;
      }
    }
  }
}

TEST(RemapTable, RejectsOtherSizes) {
  const RemapTable table(camera(), kSource, odd_view(), Eigen::Matrix3d::Identity(), {}, ThreadPool(1));
  Image<std::uint8_t> small(100, 100), result(odd_view().size);
  EXPECT_THROW(table.apply(small, result, ThreadPool(1)), std::invalid_argument);
}

}  // namespace
}  // namespace spartan::internal
