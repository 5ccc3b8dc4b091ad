#include "spartan/system/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "spartan/core/files.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

TEST(CheckRunFolder, AcceptsANewAndAnEmptyFolderAndCreatesNothing) {
  const testing::TemporaryFolder temporary;
  const RunFolder folder{temporary.path() + "/run"};
  EXPECT_TRUE(check_run_folder(folder, false));
  EXPECT_FALSE(std::filesystem::exists(folder.path));
  std::filesystem::create_directory(folder.path);
  EXPECT_TRUE(check_run_folder(folder, false));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path));
}

TEST(CheckRunFolder, RefusesAFolderThatAnotherProcessWorksOn) {
  const testing::TemporaryFolder temporary;
  const RunFolder folder{temporary.path() + "/run"};
  const auto owned = prepare_run_folder(folder, false);
  ASSERT_TRUE(owned);
  for (const bool resume : {false, true}) {
    const Status usable = check_run_folder(folder, resume);
    ASSERT_FALSE(usable);
    EXPECT_EQ(usable.error().code, ErrorCode::output);
    EXPECT_THAT(usable.error().what, HasSubstr(std::to_string(::getpid())));
  }
}

TEST(CheckRunFolder, ContinuesOnlyWithResumeWhatIsThere) {
  const testing::TemporaryFolder temporary;
  const RunFolder folder{temporary.path() + "/run"};
  ASSERT_TRUE(prepare_run_folder(folder, false));  // and released
  EXPECT_TRUE(check_run_folder(folder, true));
  const Status usable = check_run_folder(folder, false);
  ASSERT_FALSE(usable);
  EXPECT_THAT(usable.error().what, HasSubstr("already exists"));
  const RunFolder file{temporary.path() + "/file"};
  ASSERT_TRUE(write_file_atomically(file.path, "text"));
  EXPECT_FALSE(check_run_folder(file, true));
}

TEST(RunInput, IsNotedWithAbsolutePathsAndCompletesWhatIsGiven) {
  const testing::TemporaryFolder temporary;
  const RunFolder folder{temporary.path()};
  const std::string recording = temporary.path() + "/dr\xC3\xADve: 'a' #1";
  std::filesystem::create_directory(recording);
  OpenOptions open;
  open.format = RecordingFormat::images;
  open.left_images = "l*.png";
  open.right_images = "r*.png";
  open.times_file = "times.txt";
  open.bits = 12;
  open.pair_tolerance_s = 0.02;
  ASSERT_TRUE(write_run_input({recording + "/../" + recording.substr(temporary.path().size() + 1), open}, folder));
  const auto noted = complete_run_input({}, folder);
  ASSERT_TRUE(noted) << noted.error().message();
  EXPECT_EQ(noted->recording, std::filesystem::canonical(recording).string());
  EXPECT_EQ(noted->open.format, open.format);
  EXPECT_EQ(noted->open.left_images, open.left_images);
  EXPECT_EQ(noted->open.times_file, std::filesystem::current_path().string() + "/times.txt");
  EXPECT_EQ(noted->open.bits, 12);
  EXPECT_EQ(noted->open.pair_tolerance_s, 0.02);
  EXPECT_EQ(noted->open.rig_file, folder.rig());
  OpenOptions given;
  given.fps = 10;
  const auto completed = complete_run_input({"elsewhere", given}, folder);
  ASSERT_TRUE(completed);
  EXPECT_EQ(completed->recording, "elsewhere");
  EXPECT_EQ(completed->open.fps, 10);
  EXPECT_EQ(completed->open.times_file, "") << "the rate was given instead";
  EXPECT_EQ(completed->open.right_images, open.right_images);
  std::filesystem::remove(recording);
  EXPECT_EQ(complete_run_input({}, folder)->recording, "") << "it is not there any more";
  ASSERT_TRUE(write_file_atomically(folder.input(), "fps: many\n"));
  EXPECT_EQ(complete_run_input({}, folder).error().code, ErrorCode::configuration);
}

TEST(RunInput, OfAnOlderVersionIsThatOfTheSummary) {
  const testing::TemporaryFolder temporary;
  const RunFolder folder{temporary.path()};
  EXPECT_EQ(complete_run_input({}, folder)->recording, "");
  ASSERT_TRUE(write_file_atomically(folder.summary(), "{\"input\": \"" + temporary.path() + "\"}"));
  EXPECT_EQ(complete_run_input({}, folder)->recording, temporary.path());
}

}  // namespace
}  // namespace spartan
