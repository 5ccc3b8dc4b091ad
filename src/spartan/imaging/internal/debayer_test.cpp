#include "spartan/imaging/internal/debayer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/numerics/luma.h"
#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"

namespace spartan::internal {
namespace {

struct Pattern {
  PixelLayout layout;
  int opencv_code;  // OpenCV names a pattern by the second and third sample of the second row
};
const Pattern kPatterns[] = {{PixelLayout::bayer_rggb, cv::COLOR_BayerBG2RGB},
                             {PixelLayout::bayer_grbg, cv::COLOR_BayerGB2RGB},
                             {PixelLayout::bayer_gbrg, cv::COLOR_BayerGR2RGB},
                             {PixelLayout::bayer_bggr, cv::COLOR_BayerRG2RGB}};

template <class T>
Image<T> random_mosaic(int width, int height, int largest) {
  Random random(5);
  Image<T> mosaic(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      mosaic(x, y) = static_cast<T>(random.below(static_cast<std::uint32_t>(largest) + 1));
    }
  }
  return mosaic;
}

// The format whose samples use all bits of T.
template <class T>
PixelFormat format_of(PixelLayout layout) {
  return {layout, 8 * static_cast<int>(sizeof(T))};
}

template <class T>
void expect_as_opencv(int largest) {
  for (const ImageSize size : {ImageSize{64, 48}, ImageSize{37, 21}}) {
    const Image<T> mosaic = random_mosaic<T>(size.width, size.height, largest);
    for (const Pattern& pattern : kPatterns) {
      SCOPED_TRACE(name_of(pattern.layout));
      Image<Rgb<T>> ours(size);
      Debayerer().apply(mosaic, format_of<T>(pattern.layout), ours, ThreadPool(2));
      cv::Mat theirs;
      cv::cvtColor(as_mat(mosaic), theirs, pattern.opencv_code);
      const auto reference = as_view<Rgb<T>>(theirs);
      for (int y = 1; y + 1 < size.height; ++y) {
        for (int x = 1; x + 1 < size.width; ++x) {
          ASSERT_LE(std::abs(ours(x, y).r - reference(x, y).r), 1) << x << ", " << y;
          ASSERT_LE(std::abs(ours(x, y).g - reference(x, y).g), 1) << x << ", " << y;
          ASSERT_LE(std::abs(ours(x, y).b - reference(x, y).b), 1) << x << ", " << y;
        }
      }
    }
  }
}

TEST(Debayer, AgreesWithOpenCv8Bit) {
  expect_as_opencv<std::uint8_t>(255);
}

TEST(Debayer, AgreesWithOpenCv16Bit) {
  expect_as_opencv<std::uint16_t>(65535);
}

constexpr DebayerMethod kMethods[] = {DebayerMethod::bilinear, DebayerMethod::edge_aware};

char sample_at(PixelLayout layout, int x, int y) {
  return name_of(layout).substr(6)[static_cast<std::size_t>(2 * (y & 1) + (x & 1))];
}

template <class T>
Image<T> mosaic_of(ImageView<const Rgb<T>> colours, PixelLayout layout) {
  Image<T> mosaic(colours.size());
  for (int y = 0; y < colours.height(); ++y) {
    for (int x = 0; x < colours.width(); ++x) {
      const char sample = sample_at(layout, x, y);
      const Rgb<T> c = colours(x, y);
      mosaic(x, y) = sample == 'r' ? c.r : sample == 'g' ? c.g : c.b;
    }
  }
  return mosaic;
}

template <class T>
Image<Rgb<T>> debayered(DebayerMethod method, ImageView<const T> mosaic, PixelLayout layout, int threads = 1,
                        SimdTarget simd = SimdTarget::automatic) {
  Image<Rgb<T>> result(mosaic.size());
  Debayerer(method, simd).apply(mosaic, format_of<T>(layout), result, ThreadPool(threads));
  return result;
}

template <class T>
void expect_same(ImageView<const T> a, ImageView<const T> b) {
  ASSERT_EQ(a.size(), b.size());
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) ASSERT_EQ(a(x, y), b(x, y)) << x << ", " << y;
  }
}

template <class T>
void expect_uniform_colours_back(Rgb<T> colour) {
  for (const DebayerMethod method : kMethods) {
    for (const ImageSize size : {ImageSize{11, 8}, ImageSize{2, 2}, ImageSize{3, 70}, ImageSize{300, 3}}) {
      for (const Pattern& pattern : kPatterns) {
        SCOPED_TRACE(name_of(pattern.layout));
        const Image<Rgb<T>> uniform(size.width, size.height, colour);
        const auto mosaic = mosaic_of<T>(uniform, pattern.layout);
        expect_same<Rgb<T>>(debayered<T>(method, mosaic, pattern.layout), uniform);
        Image<T> gray(size);
        Debayerer(method).apply(mosaic, format_of<T>(pattern.layout), gray, ThreadPool(1));
        expect_same<T>(gray, Image<T>(size.width, size.height, luma(colour)));
      }
    }
  }
}

TEST(Debayer, KeepsAUniformColourUpToTheBorders) {
  expect_uniform_colours_back(Rgb8{255, 3, 128});
  expect_uniform_colours_back(Rgb16{4000, 2500, 700});
  expect_uniform_colours_back(Rgb16{65535, 0, 65535});
}

TEST(Debayer, AGrayRampStaysGray) {
  Image<Rgb16> ramp(61, 47);
  for (int y = 0; y < ramp.height(); ++y) {
    for (int x = 0; x < ramp.width(); ++x) {
      const auto level = static_cast<std::uint16_t>(1000 + 30 * x + 14 * y);
      ramp(x, y) = {level, level, level};
    }
  }
  for (const DebayerMethod method : kMethods) {
    for (const Pattern& pattern : kPatterns) {
      const auto result =
          debayered<std::uint16_t>(method, mosaic_of<std::uint16_t>(ramp, pattern.layout), pattern.layout);
      for (int y = 8; y + 8 < ramp.height(); ++y) {
        for (int x = 8; x + 8 < ramp.width(); ++x) ASSERT_EQ(result(x, y), ramp(x, y)) << x << ", " << y;
      }
    }
  }
}

// One scene with all Bayer phases: a mosaic without its first column or row has another phase.
TEST(Debayer, AllPhasesGiveTheSameImage) {
  const auto mosaic = random_mosaic<std::uint8_t>(50, 90, 255);
  const PixelLayout shifted[2][2] = {{PixelLayout::bayer_rggb, PixelLayout::bayer_grbg},
                                     {PixelLayout::bayer_gbrg, PixelLayout::bayer_bggr}};
  for (const DebayerMethod method : kMethods) {
    const auto whole = debayered<std::uint8_t>(method, mosaic, shifted[0][0]);
    for (const int dy : {0, 1}) {
      for (const int dx : {0, 1}) {
        const auto part = mosaic.view().crop(dx, dy, 50 - dx, 90 - dy);
        const auto result = debayered<std::uint8_t>(method, part, shifted[dy][dx]);
        for (int y = 8; y < 80; ++y) {
          for (int x = 8; x < 40; ++x) ASSERT_EQ(result(x, y), whole(x + dx, y + dy)) << x << ", " << y;
        }
      }
    }
  }
}

template <class T>
void expect_same_bytes_everywhere(int largest) {
  for (const DebayerMethod method : kMethods) {
    for (const ImageSize size : {ImageSize{2, 2}, ImageSize{5, 131}, ImageSize{613, 67}}) {
      const auto mosaic = random_mosaic<T>(size.width, size.height, largest);
      const auto expected = debayered<T>(method, mosaic, PixelLayout::bayer_gbrg, 1, SimdTarget::sse4);
      Image<T> gray(size), expected_gray(size);
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) expected_gray(x, y) = luma(expected(x, y));
      }
      for (const SimdTarget simd : available_simd_targets()) {
        SCOPED_TRACE(name_of(simd));
        expect_same<Rgb<T>>(debayered<T>(method, mosaic, PixelLayout::bayer_gbrg, 2, simd), expected);
        Debayerer(method, simd).apply(mosaic, format_of<T>(PixelLayout::bayer_gbrg), gray, ThreadPool(2));
        expect_same<T>(gray, expected_gray);
      }
    }
  }
}

TEST(Debayer, ThreadsAndTargetsGiveTheSameBytes) {
  expect_same_bytes_everywhere<std::uint8_t>(255);
  expect_same_bytes_everywhere<std::uint16_t>(65535);
  expect_same_bytes_everywhere<std::uint16_t>(4095);
}

// Reference implementation of the edge-aware method, pixel by pixel in double precision (docs/math/imaging.md). Results
// are in 8-bit levels; `unit` is the size of one of them.
template <class T>
class ReferenceEdgeAware {
 public:
  ReferenceEdgeAware(ImageView<const T> mosaic, const PixelFormat& format, double unit)
      : mosaic_(mosaic), layout_(format.layout), unit_(unit), largest_(format.full_scale() / unit) {}

  double red(int x, int y) const { return other(x, y, 'r'); }
  double blue(int x, int y) const { return other(x, y, 'b'); }
  double green(int x, int y) const {
    return is(x, y, 'g') ? level(x, y) : std::clamp(level(x, y) + mixed_difference(x, y), 0.0, largest_);
  }

 private:
  static int mirror(int i, int size) {
    while (i < 0 || i >= size) i = i < 0 ? -i : 2 * (size - 1) - i;
    return i;
  }
  bool is(int x, int y, char colour) const {
    return sample_at(layout_, mirror(x, mosaic_.width()), mirror(y, mosaic_.height())) == colour;
  }
  double level(int x, int y) const { return mosaic_(mirror(x, mosaic_.width()), mirror(y, mosaic_.height())) / unit_; }
  double difference(int x, int y, int dx, int dy) const {
    const double missing = (level(x - dx, y - dy) + level(x + dx, y + dy)) / 2 +
                           5.0 / 32 * (2 * level(x, y) - level(x - 2 * dx, y - 2 * dy) - level(x + 2 * dx, y + 2 * dy));
    return is(x, y, 'g') ? level(x, y) - missing : missing - level(x, y);
  }
  double weight(int x, int y, int dx, int dy) const {
    double sum = 1;
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        sum += std::abs(difference(x + i - dx, y + j - dy, dx, dy) - difference(x + i + dx, y + j + dy, dx, dy));
      }
    }
    return 1 / (sum * sum);
  }
  double mixed_difference(int x, int y) const {
    double sum = 0, total = 0;
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const double w = weight(x + dx, y + dy, std::abs(dx), std::abs(dy));
      sum += w *
             (difference(x, y, std::abs(dx), std::abs(dy)) + difference(x + dx, y + dy, std::abs(dx), std::abs(dy))) /
             2;
      total += w;
    }
    return sum / total;
  }
  double edge_strength(int x, int y, int dx, int dy) const {
    const double before = green(x - dx, y - dy), behind = green(x + dx, y + dy);
    return std::abs(before - behind) + std::abs(2 * green(x, y) - before - behind);
  }
  // Green minus the colour, blended from two axes.
  double between(int x, int y, char colour, int ax, int ay, int bx, int by) const {
    const double a0 = minus(x - ax, y - ay, colour), a1 = minus(x + ax, y + ay, colour);
    const double b0 = minus(x - bx, y - by, colour), b1 = minus(x + bx, y + by, colour);
    const double a = 1 / (1 + edge_strength(x, y, ax, ay) + std::abs(a0 - a1));
    const double b = 1 / (1 + edge_strength(x, y, bx, by) + std::abs(b0 - b1));
    return (a * (a0 + a1) + b * (b0 + b1)) / (2 * (a + b));
  }
  double minus(int x, int y, char colour) const {
    if (is(x, y, colour)) return green(x, y) - level(x, y);
    return is(x, y, 'g') ? between(x, y, colour, 0, 1, 1, 0) : between(x, y, colour, 1, 1, -1, 1);
  }
  double other(int x, int y, char colour) const { return std::clamp(green(x, y) - minus(x, y, colour), 0.0, largest_); }

  ImageView<const T> mosaic_;
  PixelLayout layout_;
  double unit_, largest_;
};

template <class T>
void expect_as_the_formula(const PixelFormat& format, double unit) {
  SCOPED_TRACE(::testing::Message() << name_of(format.layout) << " of " << format.bits << " bits");
  auto mosaic = random_mosaic<T>(23, 17, (1 << format.bits) - 1);
  const int shift = format.alignment == BitAlignment::high ? 16 - format.bits : 0;
  for (int y = 0; y < mosaic.height(); ++y) {
    for (int x = 0; x < mosaic.width(); ++x) mosaic(x, y) = static_cast<T>(mosaic(x, y) << shift);
  }
  Image<Rgb<T>> result(mosaic.size());
  Debayerer(DebayerMethod::edge_aware).apply(mosaic, format, result, ThreadPool(1));
  const ReferenceEdgeAware<T> reference(mosaic, format, unit);
  // Rounding of the result (½ level) and of the differences; single precision.
  const double tolerance = 0.65 / unit + 1e-3;
  for (int y = 0; y < mosaic.height(); ++y) {
    for (int x = 0; x < mosaic.width(); ++x) {
      ASSERT_NEAR(result(x, y).r / unit, reference.red(x, y), tolerance) << x << ", " << y;
      ASSERT_NEAR(result(x, y).g / unit, reference.green(x, y), tolerance) << x << ", " << y;
      ASSERT_NEAR(result(x, y).b / unit, reference.blue(x, y), tolerance) << x << ", " << y;
    }
  }
}

// At any bit depth and alignment, gradients are in 1/256 of full scale.
TEST(Debayer, EdgeAwareFollowsItsFormula) {
  for (const Pattern& pattern : kPatterns) {
    expect_as_the_formula<std::uint8_t>({pattern.layout, 8}, 1);
    expect_as_the_formula<std::uint16_t>({pattern.layout, 10, BitAlignment::low}, 4);
    expect_as_the_formula<std::uint16_t>({pattern.layout, 12, BitAlignment::low}, 16);
    expect_as_the_formula<std::uint16_t>({pattern.layout, 12, BitAlignment::high}, 256);
    expect_as_the_formula<std::uint16_t>({pattern.layout, 16}, 256);
  }
}

TEST(Debayer, LumaHasTheFullRange) {
  EXPECT_EQ(luma(Rgb8{255, 255, 255}), 255);
  EXPECT_EQ(luma(Rgb16{65535, 65535, 65535}), 65535);
  EXPECT_EQ(luma(Rgb8{255, 0, 0}), 76);
}

TEST(Debayer, RejectsImagesThatAreNotMosaics) {
  Image<std::uint8_t> image(4, 4), other(5, 4);
  const auto refuses = [&](PixelFormat format, const Image<std::uint8_t>& mosaic) {
    EXPECT_THROW(Debayerer().apply(mosaic, format, image, ThreadPool(1)), std::invalid_argument);
  };
  refuses({PixelLayout::gray, 8}, image);
  refuses({PixelLayout::bayer_rggb, 8}, other);
  refuses({PixelLayout::bayer_rggb, 12}, image);
}

}  // namespace
}  // namespace spartan::internal
