#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <optional>
#include <thread>

#include "spartan/core/files.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

ErrorCode failure_code_of(const Result<std::string>& content) {
  EXPECT_FALSE(content);
  return content ? ErrorCode::internal : content.error().code;
}

TEST(InputFile, DevicesAndPipesAreNotRead) {
  const TemporaryFolder folder;
  const std::string pipe = folder.file("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(failure_code_of(read_file(pipe)), ErrorCode::input) << "opening it would wait for a writer";
  EXPECT_EQ(failure_code_of(read_file("/dev/zero")), ErrorCode::input) << "it has no end";
  EXPECT_EQ(failure_code_of(read_calibration_text(pipe)), ErrorCode::configuration);
}

TEST(InputFile, AnErrorOfTheSystemIsNotTheEndOfTheFile) {
  // A regular file which every read() at its beginning answers with EIO.
  EXPECT_EQ(failure_code_of(read_file("/proc/self/mem")), ErrorCode::read_error);
  EXPECT_EQ(failure_code_of(read_calibration_text("/proc/self/mem")), ErrorCode::configuration);
}

TEST(InputFile, TheSizeMayBeUnknown) {
  // The size of files in /proc is 0.
  EXPECT_NE(read_file("/proc/self/status").value().find("VmSize"), std::string::npos);
}

TEST(InputFile, LargeFilesAreNotRead) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a", "12345");
  EXPECT_EQ(read_file(path, 5).value(), "12345");
  EXPECT_EQ(failure_code_of(read_file(path, 4)), ErrorCode::input);
  fs::resize_file(path, kLargestFile_bytes + 1);
  EXPECT_EQ(failure_code_of(read_file(path)), ErrorCode::input);
}

TEST(InputFile, ABeginningIsAtMostTheWholeFile) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a", "12345");
  EXPECT_EQ(read_beginning(path, 3).value(), "123");
  EXPECT_EQ(read_beginning(path, 99).value(), "12345");
}

TEST(InputFile, MissingDescriptorsAreAShortage) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a", "text");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none = before;
  none.rlim_cur = 0;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  const auto read = read_file(path);
  const Status written = write_file_atomically(path, "new");
  const auto locked = FolderLock::acquire(folder.path());
  ::setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(failure_code_of(read), ErrorCode::resources);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::resources);
  ASSERT_FALSE(locked);
  EXPECT_EQ(locked.error().code, ErrorCode::resources);
}

TEST(TemporaryFiles, OnlyThoseOfThisProgramAreRemoved) {
  const TemporaryFolder folder;
  for (const char* name :
       {"a.txt", "a.part", "a.txt.12.part", ".12.part", "12.part", "a.12.part.txt", "a.12x.part", "below/b.7.part"}) {
    folder.write(name, "x");
  }
  remove_temporary_files(folder.path());
  EXPECT_FALSE(fs::exists(folder.path() + "/a.txt.12.part"));
  for (const char* name : {"a.txt", "a.part", ".12.part", "12.part", "a.12.part.txt", "a.12x.part", "below/b.7.part"}) {
    EXPECT_TRUE(fs::exists(folder.path() + "/" + name)) << name;
  }
  const std::string own = temporary_name(folder.file("c.png"));
  folder.write(fs::path(own).filename().string(), "x");
  remove_temporary_files(folder.path());
  EXPECT_FALSE(fs::exists(own));
}

TEST(FolderLock, HasOneOwner) {
  const TemporaryFolder folder;
  {
    const auto first = FolderLock::acquire(folder.path());
    ASSERT_TRUE(first) << first.error().message();
    const auto second = FolderLock::acquire(folder.path());
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::output);
    EXPECT_NE(second.error().what.find("(id " + std::to_string(::getpid()) + ")"), std::string::npos)
        << second.error().message();
  }
  EXPECT_TRUE(fs::is_empty(folder.path())) << "the file is removed with the lock";
  EXPECT_TRUE(FolderLock::acquire(folder.path()));
}

TEST(FolderLock, TheIdOfTheOwnerIsWaitedFor) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/owner.lock";
  const int owner = ::open(path.c_str(), O_RDWR | O_CREAT, 0644);
  ASSERT_EQ(::flock(owner, LOCK_EX | LOCK_NB), 0);
  std::thread late([owner] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_EQ(::write(owner, "4711\n", 5), 5);
  });
  const auto second = FolderLock::acquire(folder.path());
  late.join();
  ::close(owner);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().what, HasSubstr("(id 4711)"));
}

TEST(FolderLock, AnOwnerThatIsAboutToEndIsNamedToo) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/owner.lock";
  const int owner = ::open(path.c_str(), O_RDWR | O_CREAT, 0644);
  ASSERT_EQ(::flock(owner, LOCK_EX | LOCK_NB), 0);
  std::thread ends([owner, &path] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    fs::remove(path);
    EXPECT_EQ(::write(owner, "4711\n", 5), 5);
  });
  const auto second = FolderLock::acquire(folder.path());
  ends.join();
  ::close(owner);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().what, HasSubstr("(id 4711)"));
}

TEST(FolderLock, AKilledOwnerIsWaitedFor) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/owner.lock";
  const int owner = ::open(path.c_str(), O_RDWR | O_CREAT, 0644);
  ASSERT_EQ(::flock(owner, LOCK_EX | LOCK_NB), 0);
  std::thread ends([owner] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    ::close(owner);
  });
  const auto lock = FolderLock::acquire(folder.path(), FolderLock::kOfKilledProcess);
  ends.join();
  EXPECT_TRUE(lock) << lock.error().message();
}

TEST(FolderLock, TheProcessThatCreatedTheFolderIsWaitedFor) {
  const TemporaryFolder folder;
  std::optional<FolderLock> lock;
  std::thread late([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    lock = FolderLock::acquire(folder.path()).value();
  });
  const Status owned = FolderLock::expect_free(folder.path());
  late.join();
  ASSERT_FALSE(owned);
  EXPECT_THAT(owned.error().what, HasSubstr("(id " + std::to_string(::getpid()) + ")"));
}

TEST(FolderLock, IsNotRefusedForAnotherProcessThatOnlyLooks) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/owner.lock";
  const int other = ::open(path.c_str(), O_RDWR | O_CREAT, 0644);
  ASSERT_EQ(::flock(other, LOCK_SH | LOCK_NB), 0);
  std::thread looks([other] {
    std::this_thread::sleep_for(std::chrono::milliseconds(15));
    ::close(other);
  });
  const auto lock = FolderLock::acquire(folder.path());
  looks.join();
  EXPECT_TRUE(lock) << lock.error().message();
}

TEST(FolderLock, AskingForTheOwnerChangesNothing) {
  const TemporaryFolder folder;
  EXPECT_TRUE(FolderLock::expect_free(folder.path()));
  EXPECT_TRUE(fs::is_empty(folder.path()));
  const auto lock = FolderLock::acquire(folder.path());
  ASSERT_TRUE(lock);
  const Status owned = FolderLock::expect_free(folder.path());
  ASSERT_FALSE(owned);
  EXPECT_EQ(owned.error().code, ErrorCode::output);
  EXPECT_NE(owned.error().what.find("(id " + std::to_string(::getpid()) + ")"), std::string::npos);
  EXPECT_FALSE(FolderLock::acquire(folder.path())) << "the owner still has it";
}

TEST(FolderLock, EndsWithAKilledProcess) {
  const TemporaryFolder folder;
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const auto lock = FolderLock::acquire(folder.path());
    const char done = lock ? 'y' : 'n';
    static_cast<void>(!::write(ready[1], &done, 1));
    ::pause();
    ::_exit(0);
  }
  char done = 0;
  ASSERT_EQ(::read(ready[0], &done, 1), 1);
  EXPECT_EQ(done, 'y');
  EXPECT_FALSE(FolderLock::acquire(folder.path()));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_TRUE(FolderLock::acquire(folder.path()));
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(FolderLock, MovesWithItsValue) {
  const TemporaryFolder folder;
  FolderLock kept;
  EXPECT_FALSE(kept.owns());
  {
    auto lock = FolderLock::acquire(folder.path());
    ASSERT_TRUE(lock);
    kept = std::move(*lock);
  }
  EXPECT_TRUE(kept.owns());
  EXPECT_FALSE(FolderLock::acquire(folder.path()));
}

}  // namespace
}  // namespace spartan
