#include "spartan/camera/internal/layouts/image_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "spartan/testing/tiny_recordings.h"

namespace spartan::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Names of the left and right file of each frame, "-" where one is missing.
class ImageFolder : public ::testing::Test {
 protected:
  ImageFolder() {
    std::filesystem::create_directories(folder_.path() + "/l");
    std::filesystem::create_directories(folder_.path() + "/r");
  }
  void put(const std::string& left, const std::string& right) {
    if (!left.empty()) folder_.write("l/" + left, "");
    if (!right.empty()) folder_.write("r/" + right, "");
  }
  std::vector<std::string> number(std::optional<std::size_t> announced) {
    images_ = number_images(folder_.path() + "/l", folder_.path() + "/r", announced).value();
    const auto name = [](const std::string& path) {
      return path.empty() ? std::string("-") : std::filesystem::path(path).filename().string();
    };
    std::vector<std::string> names;
    names.reserve(images_.frames.size());
    for (const ImageFiles& files : images_.frames) names.push_back(name(files.left) + " " + name(files.right));
    return names;
  }
  testing::TemporaryFolder folder_;
  NumberedImages images_;
};

TEST_F(ImageFolder, FileNumbersAreFrameNumbers) {
  put("000000.png", "000000.png");
  put("000002.png", "000001.png");
  EXPECT_THAT(number(4), ElementsAre("000000.png 000000.png", "- 000001.png", "000002.png -", "- -"));
  EXPECT_THAT(images_.remarks, IsEmpty());
  EXPECT_THAT(number(std::nullopt), ElementsAre("000000.png 000000.png", "- 000001.png", "000002.png -"));
}

TEST_F(ImageFolder, ReportsImagesBeyondTheListedFrames) {
  put("0.png", "0.png");
  put("5.png", "5.png");
  EXPECT_THAT(number(2), ElementsAre("0.png 0.png", "- -"));
  ASSERT_EQ(images_.remarks.size(), 1U);
  EXPECT_THAT(images_.remarks[0], HasSubstr("2 images have no entry among the 2 listed frames"));
}

TEST_F(ImageFolder, AnExcerptStartsAtItsLowestNumber) {
  put("000150.png", "000150.png");
  put("000151.png", "000151.png");
  EXPECT_THAT(number(2), ElementsAre("000150.png 000150.png", "000151.png 000151.png"));
  EXPECT_EQ(images_.first_number, 150);
  EXPECT_THAT(images_.remarks, ElementsAre(HasSubstr("start at 150")));
}

TEST_F(ImageFolder, OtherNamesAreUsedInSortedOrder) {
  put("b.png", "b.png");
  put("a.png", "");
  EXPECT_THAT(number(std::nullopt), ElementsAre("a.png -", "b.png b.png"));
  EXPECT_THAT(images_.remarks, ElementsAre(HasSubstr("not frame numbers")));
}

// Time stamps as names must not become a billion missing frames.
TEST_F(ImageFolder, StampsAsNamesAreNotFrameNumbers) {
  put("1403715273262142976.png", "1403715273262142976.png");
  put("1403715273312143104.png", "1403715273312143104.png");
  EXPECT_EQ(number(std::nullopt).size(), 2U);
  put("7.png", "9000000.png");
  EXPECT_EQ(number(std::nullopt).size(), 4U);
}

TEST_F(ImageFolder, IgnoresOtherFilesAndPrefersPng) {
  put("0.jpg", "0.JPG");
  put("0.png", "");
  put("readme.txt", ".DS_Store");
  EXPECT_THAT(number(std::nullopt), ElementsAre("0.png 0.JPG"));
}

TEST_F(ImageFolder, EmptyAndMissingFoldersHoldNoImages) {
  EXPECT_THAT(number(std::nullopt), IsEmpty());
  EXPECT_EQ(number_images(folder_.path() + "/none", folder_.path() + "/none", 3)->frames.size(), 3U);
}

TEST_F(ImageFolder, FindsTheMostFrequentImageSize) {
  for (int i = 0; i < 5; ++i) {
    testing::write_tiny_png(folder_.file("l/" + std::to_string(i) + ".png"), 1,
                            i == 0 ? ImageSize{9, 9} : ImageSize{12, 8});
  }
  folder_.write("l/5.png", "nonsense");
  number(std::nullopt);
  EXPECT_EQ(common_image_size(list_images(folder_.path() + "/l").value()), (ImageSize{12, 8}));
  EXPECT_FALSE(common_image_size({}));
  EXPECT_FALSE(common_image_size({{"none", "none.png"}}));
}

}  // namespace
}  // namespace spartan::internal
