// `spartan stereo`, `spartan map build` and `spartan rig inspect` with picture files whose meaning only the rig knows.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <type_traits>

#include "program.h"
#include "spartan/core/image_io.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::run_program;

// A gray world in front of cameras of any kind: the pair of the small drive, its samples written anew.
class PictureFiles : public ::testing::Test {
 protected:
  static Image<std::uint8_t> seen_by(int eye) {
    return read_gray8(fmt::format("{}/image_{}/000000.png", testing::small_drive_folder(), eye)).value();
  }
  template <class Pixel>
  void write_eyes(auto pixel_of) {
    for (const int eye : {0, 1}) {
      const auto gray = seen_by(eye);
      Image<Pixel> picture(gray.size());
      for (int y = 0; y < gray.height(); ++y) {
        for (int x = 0; x < gray.width(); ++x) {
          if constexpr (std::is_invocable_v<decltype(pixel_of), int>) {
            picture(x, y) = pixel_of(gray(x, y));
          } else {
            picture(x, y) = pixel_of(gray(x, y), x, y);
          }
        }
      }
      ASSERT_TRUE(write_png(eye_file(eye), picture.view()));
    }
  }
  std::string eye_file(int eye) const { return folder_.file(eye == 0 ? "left.png" : "right.png"); }

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
    const std::vector<std::string> rest{eye_file(0), eye_file(1),         "--rig", rig_file(format),
                                        "-o",        folder_.file("out"), "--json"};
    words.insert(words.end(), rest.begin(), rest.end());
    return run_program(words);
  }
  // In percent, of `stereo`.
  double density(const std::string& format) const {
    const auto told = run({"stereo"}, format);
    EXPECT_EQ(told.exit_code, 0) << told.err;
    return told.exit_code == 0 ? json::parse(told.out)["density_percent"].get<double>() : 0;
  }
  void expect_a_map(const std::string& format) const {
    const auto told = run({"map", "build", "--gravity", "0,0,-1"}, format);
    EXPECT_EQ(told.exit_code, 0) << told.err;
  }

  // Of `rig inspect`, whose rig is right to the last digit.
  void expect_judged_good(const std::string& format) const {
    SCOPED_TRACE(format);
    const auto told = run_program({"rig", "inspect", rig_file(format), eye_file(0), eye_file(1), "--json"});
    ASSERT_EQ(told.exit_code, 0) << told.err;
    const json pair = json::parse(told.out)["pairs"]["stereo"];
    EXPECT_EQ(pair["verdict"], "good") << pair["findings"];
    EXPECT_GT(pair["inliers"], 80);
    EXPECT_LT(pair["row_error_px"]["after"]["mean"], 0.3);
  }

  testing::TemporaryFolder folder_;
};

TEST_F(PictureFiles, MosaicsAndDeepSamples) {
  write_eyes<std::uint8_t>([](int level) { return static_cast<std::uint8_t>(level); });
  const double gray = density("");
  EXPECT_GT(gray, 70);
  EXPECT_NEAR(density(", pixel_layout: bayer_rggb"), gray, 10);
  write_eyes<std::uint16_t>([](int level) { return static_cast<std::uint16_t>(level * 16); });
  EXPECT_NEAR(density(", bits: 12"), gray, 2);
  EXPECT_NEAR(density(", pixel_layout: bayer_rggb, bits: 12"), gray, 10);
  expect_a_map(", pixel_layout: bayer_rggb, bits: 12");
  write_eyes<std::uint16_t>([](int level) { return static_cast<std::uint16_t>(level * 256); });
  EXPECT_NEAR(density(", bits: 12, bit_alignment: high"), gray, 2);
}

// A yellowish world: a mosaic that is taken for gray is full of checks.
int coloured(int level, int x, int y) {
  const bool red = x % 2 == 0 && y % 2 == 0, blue = x % 2 == 1 && y % 2 == 1;
  return blue ? level / 3 : red ? level : level * 4 / 5;
}

TEST_F(PictureFiles, CalibrationsAreJudgedByThem) {
  write_eyes<std::uint16_t>([](int level) { return static_cast<std::uint16_t>(level * 16); });
  expect_judged_good(", bits: 12");
  write_eyes<std::uint8_t>([](int level, int x, int y) { return static_cast<std::uint8_t>(coloured(level, x, y)); });
  expect_judged_good(", pixel_layout: bayer_rggb");
  write_eyes<std::uint16_t>(
      [](int level, int x, int y) { return static_cast<std::uint16_t>(16 * coloured(level, x, y)); });
  expect_judged_good(", pixel_layout: bayer_rggb, bits: 12");
  write_eyes<Rgb8>([](int level) {
    return Rgb8{static_cast<std::uint8_t>(level), static_cast<std::uint8_t>(level * 4 / 5),
                static_cast<std::uint8_t>(level / 3)};
  });
  expect_judged_good(", pixel_layout: rgb");
}

TEST_F(PictureFiles, ColoursOfAGrayRigAreReduced) {
  write_eyes<std::uint8_t>([](int level) { return static_cast<std::uint8_t>(level); });
  const double gray = density("");
  write_eyes<Rgb8>([](int level) {
    const auto l = static_cast<std::uint8_t>(level);
    return Rgb8{l, l, l};
  });
  EXPECT_EQ(density(""), gray);
  expect_a_map("");
  const auto refused = run({"stereo"}, ", pixel_layout: bayer_rggb");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("rgb of 8 bits, the rig says 320 × 240 bayer_rggb of 8 bits"));
}

}  // namespace
}  // namespace spartan
