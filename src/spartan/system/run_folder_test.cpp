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

}  // namespace
}  // namespace spartan
