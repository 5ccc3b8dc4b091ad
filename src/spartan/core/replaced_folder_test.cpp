#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>

#include "spartan/core/files.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::array<std::string_view, 2> kKnown{"data", "more"};

class ReplacedFolderTest : public ::testing::Test {
 protected:
  void SetUp() override { folder_.write("out/data", "former"); }
  std::string out() const { return folder_.path() + "/out"; }
  std::string data() const { return read_file(out() + "/data").value_or(""); }
  std::string refused(const std::string& path) const {
    const auto replaced = ReplacedFolder::set_aside(path, kKnown);
    EXPECT_FALSE(replaced) << path;
    if (replaced) return "";
    EXPECT_EQ(replaced.error().code, ErrorCode::output);
    return replaced.error().message();
  }
  // Names beside the folder: nothing may stay behind.
  std::vector<std::string> around() const { return list_folder(folder_.path()).value(); }
  testing::TemporaryFolder folder_;
};

TEST_F(ReplacedFolderTest, ComesBackInThePlaceOfTheNewOne) {
  {
    const auto replaced = ReplacedFolder::set_aside(out() + "/", kKnown);
    ASSERT_TRUE(replaced) << replaced.error().message();
    EXPECT_FALSE(fs::exists(out()));
    folder_.write("out/data", "new");
    folder_.write("out/other", "new");
  }
  EXPECT_EQ(data(), "former");
  EXPECT_FALSE(fs::exists(out() + "/other"));
  EXPECT_EQ(around(), std::vector<std::string>{"out"});
}

TEST_F(ReplacedFolderTest, IsGoneWhenItIsDiscarded) {
  {
    auto replaced = ReplacedFolder::set_aside(out(), kKnown);
    ASSERT_TRUE(replaced);
    folder_.write("out/data", "new");
    ReplacedFolder moved = std::move(*replaced);
    moved.discard();
  }
  EXPECT_EQ(data(), "new");
  EXPECT_EQ(around(), std::vector<std::string>{"out"});
}

TEST_F(ReplacedFolderTest, AFolderWithAnythingElseIsLeftAlone) {
  folder_.write("out/thesis.txt", "mine");
  EXPECT_THAT(refused(out()), HasSubstr("holds 'thesis.txt', which is not of this command: it is not replaced"));
  EXPECT_EQ(data(), "former");
}

TEST_F(ReplacedFolderTest, LinksFilesAndTheCurrentFolderAreLeftAlone) {
  fs::create_directory_symlink(out(), folder_.path() + "/link");
  EXPECT_THAT(refused(folder_.path() + "/link"), HasSubstr("is a link"));
  EXPECT_THAT(refused(folder_.path() + "/link/"), HasSubstr("is a link"));
  EXPECT_THAT(refused(out() + "/data"), HasSubstr("is not a folder"));
  const fs::path before = fs::current_path();
  fs::current_path(out());
  EXPECT_THAT(refused("."), HasSubstr("is the current folder"));
  EXPECT_THAT(refused(out()), HasSubstr("is the current folder"));
  fs::current_path(before);
  EXPECT_EQ(data(), "former");
}

TEST_F(ReplacedFolderTest, NothingAndAnEmptyFolderNeedNoReplacement) {
  fs::create_directory(folder_.path() + "/empty");
  for (const char* name : {"/none", "/empty"}) {
    const auto replaced = ReplacedFolder::set_aside(folder_.path() + name, kKnown);
    EXPECT_TRUE(replaced) << name;
  }
  EXPECT_TRUE(fs::exists(folder_.path() + "/empty"));
}

TEST_F(ReplacedFolderTest, AFolderInUseIsLeftAlone) {
  const auto lock = FolderLock::acquire(out());
  ASSERT_TRUE(lock);
  EXPECT_THAT(refused(out()), HasSubstr("is in use by another process"));
  EXPECT_EQ(data(), "former");
}

}  // namespace
}  // namespace spartan
