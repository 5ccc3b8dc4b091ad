#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

// Of Middlebury 2014, reduced: the principal points differ.
constexpr const char* kText = R"(cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]
cam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]
doffs=131.111
baseline=193.001
width=2964
height=1988
ndisp=280
isint=0
vmin=31
vmax=257
dyavg=0.918
dymax=1.516
)";

class MiddleburyCalib : public ::testing::Test {
 protected:
  Result<LoadedRig> read(std::string text, const std::string& from = "", const std::string& to = "") {
    if (!from.empty()) text.replace(text.find(from), from.size(), to);
    folder_.write("calib.txt", text);
    return read_calibration(folder_.path());
  }
  std::string error(const std::string& from, const std::string& to) {
    const auto rig = read(kText, from, to);
    return rig ? "" : rig.error().message();
  }
  testing::TemporaryFolder folder_;
};

TEST_F(MiddleburyCalib, HoldsARectifiedPair) {
  const auto loaded = read(kText);
  ASSERT_TRUE(loaded) << loaded.error().message();
  EXPECT_EQ(loaded->format, CalibrationFormat::middlebury);
  const Rig& rig = loaded->rig;
  EXPECT_EQ(rig.cameras[0].size, (ImageSize{2964, 1988}));
  EXPECT_EQ(std::get<PinholeModel>(rig.cameras[1].model).cx, 1307.839);
  EXPECT_NEAR(rig.right_from_left(rig.pairs[0]).translation().x(), -0.193001, 1e-12);
}

TEST_F(MiddleburyCalib, RejectsWhatItCannotBe) {
  EXPECT_THAT(error("baseline=193.001", "baseline=-1"), HasSubstr("calib.txt:4: baseline: must be above zero"));
  EXPECT_THAT(error("baseline=193.001\n", ""), HasSubstr("baseline"));
  EXPECT_THAT(error("doffs=131.111", "doffs=0"), HasSubstr("doffs: must be cx of cam1 minus cx of cam0, 131.111"));
  EXPECT_THAT(error("0 3997.684 1011.728; 0 0 1]\ncam1", "0 3997.684; 0 0 1]\ncam1"), HasSubstr("nine numbers"));
  EXPECT_THAT(error("cam1=[3997.684 0", "cam1=[3997.684 5"),
              HasSubstr("cam1: is not the matrix of a rectified camera"));
  EXPECT_THAT(error("width=2964", "width=29.64"), HasSubstr("whole numbers"));
  EXPECT_THAT(error("cam0=[3997.684 0", "cam0=[nan 0"), HasSubstr("cam0"));
}

}  // namespace
}  // namespace spartan
