#include "spartan/camera/internal/frame_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/camera/internal/layouts/spartan_format.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TableReader table(const std::string& text, TableFormat format = {}) {
  return TableReader::over(text, "t", std::move(format)).value();
}
template <class T>
std::string error_of(const Result<T>& result) {
  if (result) return "no fault";
  EXPECT_EQ(result.error().code, ErrorCode::input);
  return result.error().message();
}

TEST(KittiTimes, AreReadToTheNanosecond) {
  EXPECT_THAT(*read_kitti_times(table("0.000000e+00\n1.037875e-01\r\n 2.5 \n1403715273.262142976\n")),
              ElementsAre(Stamp{0}, Stamp{103787500}, Stamp{2500000000}, Stamp{1403715273262142976}));
  EXPECT_THAT(*read_kitti_times(table("")), ElementsAre());
}

TEST(KittiTimes, ErrorsNameTheLine) {
  EXPECT_THAT(error_of(read_kitti_times(table("0\n1.0x\n"))), HasSubstr("t:2: '1.0x' is not a time"));
  EXPECT_THAT(error_of(read_kitti_times(table("0\nnan\n"))), HasSubstr("t:2"));
  EXPECT_THAT(error_of(read_kitti_times(table("9.1e9\n"))), HasSubstr("t:1: the time is out of range"));
}

TEST(KittiRawTimes, AreDates) {
  const auto read = [](const std::string& text) { return read_kitti_raw_times(table(text, kitti_raw_times_format())); };
  EXPECT_THAT(*read("1970-01-01 00:00:00\n1970-01-02 00:00:00.000000001\n2011-09-26 13:02:25.964389445\r\n"),
              ElementsAre(Stamp{0}, Stamp{86'400'000'000'001}, Stamp{1317042145964389445}));
  for (const char* text :
       {"2011-09-26\n", "2011-13-26 13:02:25\n", "2011-02-30 13:02:25\n", "2011-09-26 24:02:25\n",
        "2011-09-26 13:60:25\n", "2011-09-26 13:02:99\n", "2011/09/26 13:02:25\n", "-001-09-26 13:02:25\n",
        "9999-09-26 13:02:25\n", "2011-09-26 13:02:9000000000\n", "2011-09-26 13:02:2x\n", "2011-09-26 1:02:25\n"}) {
    EXPECT_THAT(error_of(read(text)), HasSubstr("t:1: ")) << text;
  }
}

TEST(EurocImages, AreListedWithTheirStamps) {
  const auto images = read_euroc_images(table("#timestamp [ns],filename\r\n20,a.png\r\n10, b.png\r\n"));
  ASSERT_TRUE(images);
  EXPECT_THAT(images->stamps, ElementsAre(Stamp{20}, Stamp{10}));
  EXPECT_THAT(images->files, ElementsAre("a.png", "b.png"));
  EXPECT_THAT(error_of(read_euroc_images(table("10,a.png\n20\n"))), HasSubstr("t:2: 1 values, expected 2"));
  EXPECT_THAT(error_of(read_euroc_images(table("a.png,10\n"))), HasSubstr("t:1: the first column"));
  EXPECT_THAT(error_of(read_euroc_images(table("10,\n"))), HasSubstr("t:1: the file name is empty"));
}

class SpartanFrames : public ::testing::Test {
 protected:
  Result<std::vector<FrameEntry>> read(const std::string& rows) const {
    return read_spartan_frames(table(std::string(kFramesHeader) + "\n" + rows, spartan_frames_format()), "/rec",
                               testing::tiny_rig());
  }
};

TEST_F(SpartanFrames, HoldTheirColumns) {
  const auto frames = read("7,3,stereo,1000,1001,images/a.png,images/b.png,-35,39,2500,1.5,12\n");
  ASSERT_TRUE(frames) << frames.error().message();
  ASSERT_EQ(frames->size(), 1U);
  const FrameEntry& entry = frames->front();
  EXPECT_EQ(entry.frame_id, 7);
  EXPECT_EQ(entry.position_id, 3);
  EXPECT_EQ(entry.pair, "stereo");
  EXPECT_EQ(entry.left_stamp, Stamp{1000});
  EXPECT_EQ(entry.right_stamp, Stamp{1001});
  EXPECT_EQ(entry.left_file, "/rec/images/a.png");
  EXPECT_EQ(entry.right_file, "/rec/images/b.png");
  EXPECT_DOUBLE_EQ(entry.pan_rad, -35 * M_PI / 180);
  EXPECT_DOUBLE_EQ(entry.tilt_rad, 39 * M_PI / 180);
  EXPECT_EQ(entry.exposure_us, 2500);
  EXPECT_EQ(entry.gain, 1.5);
  EXPECT_EQ(entry.bits, 12);
}

TEST_F(SpartanFrames, EmptyImageFieldsStayEmpty) {
  const auto frames = read("0,0,stereo,1,1,,b.png,0,0,0,0,8\n");
  ASSERT_TRUE(frames);
  EXPECT_EQ(frames->front().left_file, "");
}

TEST_F(SpartanFrames, ErrorsNameLineAndColumn) {
  const std::vector<std::string> good{"0", "0", "stereo", "1", "1", "a", "b", "0", "0", "0", "0", "8"};
  const std::vector<std::pair<std::size_t, std::string>> columns{
      {0, "frame_id"}, {1, "position_id"}, {2, "pair"},        {3, "left_stamp_ns"}, {4, "right_stamp_ns"},
      {7, "pan_deg"},  {8, "tilt_deg"},    {9, "exposure_us"}, {10, "gain"},         {11, "bits"}};
  for (const auto& [column, name] : columns) {
    for (const std::string value : {"", "x", "nan"}) {
      std::string row;
      for (std::size_t i = 0; i < good.size(); ++i) row += (i ? "," : "") + (i == column ? value : good[i]);
      EXPECT_THAT(error_of(read("# remark\n" + row + "\n")), HasSubstr("t:3: " + name)) << row;
    }
  }
  EXPECT_THAT(error_of(read("0,0,stereo,1,1,a,b,0,0,0,0,7\n")), HasSubstr("t:2: bits is '7'"));
  EXPECT_THAT(error_of(read("0,0,stereo,1,1,a,b,0,0,0,0,17\n")), HasSubstr("t:2: bits is '17'"));
  EXPECT_THAT(error_of(read("0,0,stereo,1,1,a,b,0,0,0,0\n")), HasSubstr("t:2: 11 values, expected 12"));
  EXPECT_THAT(error_of(read("0,0,stereo,1,1,a,b,0,0,0,0,8")), HasSubstr("t:2: the file is truncated"));
}

}  // namespace
}  // namespace spartan::internal
