// `spartan stereo`, `spartan map build` and `spartan rig inspect` with image files whose pixel format only the rig
// states.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <type_traits>

#include "program.h"
#include "spartan/image_io/image_io.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::run_program;

// A gray world in front of cameras of any kind: the pair of the small drive, its samples written anew.
class ImageFiles : public ::testing::Test {
 protected:
  static Image<std::uint8_t> seen_by(int side) {
    return read_gray8(fmt::format("{}/drive/image_{}/000000.png", testing::small_runs_folder(), side)).value();
  }
  template <class Pixel>
  void write_images(auto pixel_of) {
    for (const int side : {0, 1}) {
      const auto gray = seen_by(side);
      Image<Pixel> image(gray.size());
      for (int y = 0; y < gray.height(); ++y) {
        for (int x = 0; x < gray.width(); ++x) {
          if constexpr (std::is_invocable_v<decltype(pixel_of), int>) {
            image(x, y) = pixel_of(gray(x, y));
          } else {
            image(x, y) = pixel_of(gray(x, y), x, y);
          }
        }
      }
      ASSERT_TRUE(write_png(file_of(side), image.view()));
    }
  }
  std::string file_of(int side) const { return folder_.file(side == 0 ? "left.png" : "right.png"); }

  std::string rig_file(const std::string& format) const {
    constexpr const char* kRig =
        "schema: 1\n"
        "cameras:\n"
        "  left: {{size_px: [320, 240], model: pinhole, focal_px: [260, 260], centre_px: [159.5, 119.5], axes: "
        "optical, translation_m: [0, 0, 0]{0}}}\n"
        "  right: {{size_px: [320, 240], model: pinhole, focal_px: [260, 260], centre_px: [159.5, 119.5], axes: "
        "optical, translation_m: [0.12, 0, 0]{0}}}\n"
        "pairs:\n  stereo: {{left: left, right: right}}\n";
    return folder_.write("rig.yaml", fmt::format(kRig, format));
  }
  testing::ProgramResult run(std::vector<std::string> words, const std::string& format) const {
    const std::vector<std::string> rest{file_of(0), file_of(1),          "--rig",  rig_file(format),
                                        "-o",       folder_.file("out"), "--json", "--force"};
    words.insert(words.end(), rest.begin(), rest.end());
    return run_program(words);
  }
  // In percent, of `stereo`.
  double density(const std::string& format) const {
    const auto result = run({"stereo"}, format);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? json::parse(result.out)["density_percent"].get<double>() : 0;
  }
  void expect_a_map(const std::string& format) const {
    const auto result = run({"map", "build", "--gravity", "0,0,-1"}, format);
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  // Of `rig inspect`, whose rig is right to the last digit.
  void expect_judged_good(const std::string& format) const {
    SCOPED_TRACE(format);
    const auto result = run_program({"rig", "inspect", rig_file(format), file_of(0), file_of(1), "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json pair = json::parse(result.out)["pairs"]["stereo"];
    EXPECT_EQ(pair["verdict"], "good") << pair["findings"];
    EXPECT_GT(pair["inliers"], 80);
    EXPECT_LT(pair["row_error_px"]["after"]["mean"], 0.3);
  }

  testing::TemporaryFolder folder_;
};

TEST_F(ImageFiles, MosaicsAndDeepSamples) {
  write_images<std::uint8_t>([](int level) { return static_cast<std::uint8_t>(level); });
  const double gray = density("");
  EXPECT_GT(gray, 70);
  EXPECT_NEAR(density(", pixel_layout: bayer_rggb"), gray, 10);
  write_images<std::uint16_t>([](int level) { return static_cast<std::uint16_t>(level * 16); });
  EXPECT_NEAR(density(", bits: 12"), gray, 2);
  EXPECT_NEAR(density(", pixel_layout: bayer_rggb, bits: 12"), gray, 10);
  expect_a_map(", pixel_layout: bayer_rggb, bits: 12");
  write_images<std::uint16_t>([](int level) { return static_cast<std::uint16_t>(level * 256); });
  EXPECT_NEAR(density(", bits: 12, bit_alignment: high"), gray, 2);
}

// A yellowish world: a mosaic that is taken for gray is full of checks.
int coloured(int level, int x, int y) {
  const bool red = x % 2 == 0 && y % 2 == 0, blue = x % 2 == 1 && y % 2 == 1;
  return blue ? level / 3 : red ? level : level * 4 / 5;
}

TEST_F(ImageFiles, CalibrationsAreCheckedWithThem) {
  write_images<std::uint16_t>([](int level) { return static_cast<std::uint16_t>(level * 16); });
  expect_judged_good(", bits: 12");
  write_images<std::uint8_t>([](int level, int x, int y) { return static_cast<std::uint8_t>(coloured(level, x, y)); });
  expect_judged_good(", pixel_layout: bayer_rggb");
  write_images<std::uint16_t>(
      [](int level, int x, int y) { return static_cast<std::uint16_t>(16 * coloured(level, x, y)); });
  expect_judged_good(", pixel_layout: bayer_rggb, bits: 12");
  write_images<Rgb8>([](int level) {
    return Rgb8{static_cast<std::uint8_t>(level), static_cast<std::uint8_t>(level * 4 / 5),
                static_cast<std::uint8_t>(level / 3)};
  });
  expect_judged_good(", pixel_layout: rgb");
}

TEST_F(ImageFiles, ColoursOfAGrayRigAreReduced) {
  write_images<std::uint8_t>([](int level) { return static_cast<std::uint8_t>(level); });
  const double gray = density("");
  write_images<Rgb8>([](int level) {
    const auto l = static_cast<std::uint8_t>(level);
    return Rgb8{l, l, l};
  });
  EXPECT_EQ(density(""), gray);
  expect_a_map("");
  const auto refused = run({"stereo"}, ", pixel_layout: bayer_rggb");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("rgb of 8 bits, but the rig specifies 320 × 240 bayer_rggb of 8 bits"));
}

}  // namespace
}  // namespace spartan
