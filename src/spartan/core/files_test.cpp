#include "spartan/core/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>

#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using testing::content_of;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::size_t entries(const std::string& folder) {
  const std::filesystem::directory_iterator begin(folder);
  return static_cast<std::size_t>(std::distance(begin, {}));
}

TEST(Files, WritingReplacesTheContent) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a.txt", "a long old content");
  const std::string content("new\0bytes", 9);
  ASSERT_TRUE(write_file_atomically(path, content));
  EXPECT_EQ(content_of(path), content);
  EXPECT_EQ(read_file(path).value(), content);
  EXPECT_EQ(entries(folder.path()), 1U) << "no temporary file remains";
}

TEST(Files, EmptyFilesRoundTrip) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder.file("empty"), ""));
  EXPECT_EQ(read_file(folder.file("empty")).value(), "");
}

TEST(Files, AllOfSeveralFilesAreWrittenOrNone) {
  const TemporaryFolder folder;
  const std::string first = folder.write("first", "old"), second = folder.file("second");
  std::filesystem::create_directory(second);
  const Status status = write_files_atomically({{first, "new"}, {second, "new"}});
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::output);
  EXPECT_EQ(status.error().where, second);
  EXPECT_EQ(content_of(first), "old");
  EXPECT_FALSE(write_files_atomically({{first, "new"}, {folder.path() + "/none/third", "new"}}));
  EXPECT_EQ(content_of(first), "old");
  EXPECT_EQ(entries(folder.path()), 2U);
  std::filesystem::remove(second);
  ASSERT_TRUE(write_files_atomically({{first, "new"}, {second, "newer"}}));
  EXPECT_EQ(content_of(first) + content_of(second), "newnewer");
}

TEST(Files, ReadErrorsNameTheFile) {
  const TemporaryFolder folder;
  const auto missing = read_file(folder.path() + "/none");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::input);
  EXPECT_EQ(missing.error().where, folder.path() + "/none");
  EXPECT_FALSE(read_file(folder.path())) << "a folder is not a file";
}

TEST(Files, AFolderIsListedInTheOrderOfTheNames) {
  const TemporaryFolder folder;
  for (const char* name : {"b", "a.png", ".hidden"}) folder.write(name, "");
  std::filesystem::create_directory(folder.path() + "/below");
  EXPECT_EQ(list_folder(folder.path()).value(), (std::vector<std::string>{".hidden", "a.png", "b", "below"}));
  EXPECT_TRUE(list_folder(folder.path() + "/below")->empty());
  for (const char* name : {"/none", "/b"}) {
    const auto names = list_folder(folder.path() + name);
    ASSERT_FALSE(names) << name;
    EXPECT_EQ(names.error().code, ErrorCode::input);
    EXPECT_EQ(names.error().where, folder.path() + name);
  }
}

TEST(Files, WritingIntoAMissingFolderFails) {
  const TemporaryFolder folder;
  const Status status = write_file_atomically(folder.path() + "/none/a.txt", "text");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::output);
  EXPECT_EQ(status.error().where, folder.path() + "/none/a.txt");
  EXPECT_FALSE(status.error().hint.empty());
}

TEST(Files, WritingWithoutPermissionFails) {
  // /proc rejects new files, even from root.
  const Status status = write_file_atomically("/proc/spartan_test", "text");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::output);
}

TEST(Files, AFailedWriteKeepsTheOldContent) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a.txt", "old");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1000;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const Status status = write_file_atomically(path, std::string(5000, 'x'));
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::output);
  EXPECT_NE(status.error().hint.find("ulimit"), std::string::npos);
  EXPECT_EQ(content_of(path), "old");
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(Files, CreatesFoldersWithParents) {
  const TemporaryFolder folder;
  ASSERT_TRUE(make_folder(folder.path() + "/a/b/c"));
  EXPECT_TRUE(std::filesystem::is_directory(folder.path() + "/a/b/c"));
  EXPECT_TRUE(make_folder(folder.path() + "/a/b/c")) << "exists already";
  const std::string file = folder.write("file", "x");
  for (const std::string& path : {file, file + "/below"}) {
    const Status status = make_folder(path);
    ASSERT_FALSE(status) << path;
    EXPECT_EQ(status.error().code, ErrorCode::output);
  }
}

TEST(Files, OnlyRegularFilesAreReplaced) {
  const TemporaryFolder folder;
  const std::string fifo = folder.path() + "/fifo", other = folder.path() + "/other";
  const std::string device = folder.path() + "/device";  // a link, since a failing test must not replace the device
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/null", device);
  for (const std::string& path : {fifo, device}) {
    const Status written = write_files_atomically({{other, "x"}, {path, "x"}});
    ASSERT_FALSE(written) << path;
    EXPECT_EQ(written.error().code, ErrorCode::output);
    EXPECT_THAT(written.error().message(), HasSubstr(path + ": is not a regular file"));
    const std::string temporary = folder.write("new.part", "x");
    EXPECT_FALSE(publish_file(temporary, path));
    EXPECT_FALSE(std::filesystem::exists(temporary)) << path;
    EXPECT_FALSE(std::filesystem::is_regular_file(path)) << path;
  }
  EXPECT_FALSE(std::filesystem::exists(other)) << "and its temporary file is removed";
  std::filesystem::create_symlink("nowhere", other);
  EXPECT_TRUE(write_file_atomically(other, "x")) << "a link is replaced";
  EXPECT_TRUE(std::filesystem::is_regular_file(other));
}

}  // namespace
}  // namespace spartan
