// `spartan run` under faults of the system around it: other processes, streams, paths, changed and unreadable files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "program.h"
#include "run_results.h"
#include "small_drive.h"
#include "spartan/core/files.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using testing::byte_stable_content;
using ::testing::HasSubstr;
using testing::ProgramLimits;
using testing::ProgramResult;
using testing::run_in_shell;
using testing::run_program;
using testing::TemporaryFolder;

class RunFaults : public ::testing::Test {
 protected:
  RunFaults() { fs::copy(testing::small_runs_folder() + "/drive", drive(), fs::copy_options::recursive); }

  std::string drive() const { return folder_.path() + "/drive"; }
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  std::string image(int side, int i) const {
    return drive() + "/image_" + std::to_string(side) + "/00000" + std::to_string(i) + ".png";
  }
  std::vector<std::string> words(const std::string& output, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"run", drive(), "-o", output.empty() ? "" : path(output)};
    all.insert(all.end(), testing::kSmallDriveOptions.begin(), testing::kSmallDriveOptions.end());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ProgramResult run(const std::string& output, const std::vector<std::string>& more = {}) const {
    return run_program(words(output, more));
  }
  // Of the run of the unchanged drive.
  static std::map<std::string, std::string> expected_content() {
    return byte_stable_content(testing::small_runs_folder() + "/drive_run");
  }
  void replace_by(const std::string& file, const std::string& other) const {
    fs::remove(file);
    fs::create_symlink(other, file);
  }

  TemporaryFolder folder_;
};

TEST_F(RunFaults, OnlyOneProcessWorksOnAFolder) {
  ASSERT_EQ(run("out", {"--max-frames", "2"}).exit_code, 0);
  {
    const auto lock = FolderLock::acquire(path("out"));
    ASSERT_TRUE(lock) << lock.error().message();
    for (const std::vector<std::string>& more : {std::vector<std::string>{"--resume"}, {}}) {
      const ProgramResult second = run("out", more);
      EXPECT_EQ(second.exit_code, 5);
      EXPECT_THAT(second.err, HasSubstr("in use by another process (id " + std::to_string(::getpid()) + ")"));
    }
  }
  ASSERT_EQ(run("out", {"--resume"}).exit_code, 0) << "the lock ends with its owner";
  EXPECT_EQ(byte_stable_content(path("out")), expected_content());
  EXPECT_FALSE(fs::exists(path("out/owner.lock")));
}

TEST_F(RunFaults, ResumeWaitsForTheEndOfAKilledProcess) {
  ASSERT_EQ(run("out", {"--max-frames", "2"}).exit_code, 0);
  auto lock = FolderLock::acquire(path("out"));
  ASSERT_TRUE(lock) << lock.error().message();
  auto resumed = std::async(std::launch::async, [&] { return run("out", {"--resume"}); });
  std::this_thread::sleep_for(std::chrono::seconds(1));
  { const FolderLock released = std::move(*lock); }
  const ProgramResult result = resumed.get();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(byte_stable_content(path("out")), expected_content());
}

TEST_F(RunFaults, ConcurrentProcessesNeverWriteAFrameTwice) {
  for (int round = 0; round < 3; ++round) {
    const std::string out = "out" + std::to_string(round);
    const std::vector<std::string> second =
        round == 0 ? std::vector<std::string>{} : std::vector{std::string("--resume")};
    auto other = std::async(std::launch::async, [&] { return run(out, second); });
    const ProgramResult one = run(out, {"--resume"}), two = other.get();
    EXPECT_EQ(std::min(one.exit_code, two.exit_code), 0) << one.err << two.err;
    for (const ProgramResult& result : {one, two}) {
      EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 5) << result.err;
    }
    EXPECT_EQ(byte_stable_content(path(out)), expected_content()) << "round " << round;
  }
}

TEST_F(RunFaults, TemporaryFilesOfAKilledProcessAreRemoved) {
  ASSERT_EQ(run("out", {"--max-frames", "2"}).exit_code, 0);
  std::ofstream(path("out/terrain/0.pfm.4711.part")) << "half";
  std::ofstream(path("out/notes.part")) << "of the user";
  ASSERT_EQ(run("out", {"--resume"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(path("out/terrain/0.pfm.4711.part")));
  EXPECT_TRUE(fs::exists(path("out/notes.part")));
}

TEST_F(RunFaults, AnEmptyArgumentIsAUsageError) {
  for (const std::vector<std::string>& command : {words(""),
                                                  {"demo", "-o", ""},
                                                  {"simulate", "quick", "-o", ""},
                                                  {"map", "merge", "a", "b", "-o", ""},
                                                  {"stereo", image(0, 0), image(1, 0), "-o", ""},
                                                  {"stereo", image(0, 0), image(1, 0), "-o", path("out"), "--mask", ""},
                                                  {"evaluate", "run", "--truth", ""},
                                                  {"map", "info", ""},
                                                  {"export", "run", "--format", "tum", "-o", ""}}) {
    const ProgramResult result = run_program(command);
    EXPECT_EQ(result.exit_code, 2) << command.front();
    EXPECT_THAT(result.err, HasSubstr("the argument is empty"));
  }
}

TEST_F(RunFaults, AFullOrClosedErrorStreamDoesNotEndADrive) {
  for (const std::string redirect : {"2>/dev/full", "2>&-", "2>&- <&-"}) {
    const ProgramResult result = run_in_shell(R"("$0" "$@" )" + redirect, words("out" + redirect.substr(3, 1)));
    EXPECT_EQ(result.exit_code, 0) << redirect;
    EXPECT_EQ(byte_stable_content(path("out" + redirect.substr(3, 1))), expected_content()) << redirect;
    fs::remove_all(path("out" + redirect.substr(3, 1)));
  }
}

TEST_F(RunFaults, AClosedOrFullStandardOutputIsAnErrorOfTheOutput) {
  const std::vector<std::string> dump{"config", "dump", "--all"};
  EXPECT_EQ(run_in_shell(R"("$0" "$@" >/dev/full)", dump).exit_code, 5);
  EXPECT_EQ(run_in_shell(R"("$0" "$@" >&-)", dump).exit_code, 5);
  // The reader of the pipe ends before anything is written.
  const ProgramResult gone = run_in_shell(R"({ sleep 0.3; "$0" "$@"; echo "exit $?" >&2; } | :)", dump);
  EXPECT_THAT(gone.err, HasSubstr("exit 5"));
}

TEST_F(RunFaults, AFileSizeLimitIsAnErrorOfTheOutput) {
  ProgramLimits limits;
  limits.largest_file_bytes = 300'000;
  const ProgramResult limited = run_program(words("out"), limits);
  EXPECT_EQ(limited.signal, 0);
  EXPECT_EQ(limited.exit_code, 5) << limited.err;
}

TEST_F(RunFaults, PathsNeedNotBeUtf8) {
  const std::string strange = path("bad\xff");
  fs::rename(drive(), strange);
  const ProgramResult result = run_program({"run", strange, "-o", path("out"), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(nlohmann::json::parse(result.out)["input"].get<std::string>(), HasSubstr("bad\xEF\xBF\xBD"));
  const ProgramResult score = run_program({"evaluate", path("out"), "--truth", strange, "--json"});
  EXPECT_EQ(score.exit_code, 0) << score.err;
}

TEST_F(RunFaults, HostilePathsAreInputErrors) {
  fs::create_symlink(path("loop"), path("loop"));
  const std::string fifo = path("fifo"), longest(300, 'x');
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  for (const std::string& bad : {path("loop"), fifo, longest, std::string("/dev/zero")}) {
    EXPECT_EQ(run_program({"evaluate", bad, "--truth", drive()}).exit_code, 3) << bad;
    EXPECT_EQ(run_program({"evaluate", drive() + "/poses.txt", "--truth", bad}).exit_code, 3) << bad;
    EXPECT_EQ(run_program({"stereo", bad, image(1, 0), "-o", path("stereo")}).exit_code, 3) << bad;
    EXPECT_EQ(run_program({"run", bad, "-o", path("out")}).exit_code, 3) << bad;
    EXPECT_EQ(run_program({"map", "info", bad}).exit_code, 3) << bad;
    EXPECT_EQ(run_program({"export", bad, "--format", "tum", "-o", path("x")}).exit_code, 3) << bad;
    const int code = run_program({"config", "check", bad}).exit_code;
    EXPECT_TRUE(code == 3 || code == 4) << bad;
  }
}

TEST_F(RunFaults, AnImageThatCannotBeReadNowEndsTheRunAndIsReadByTheNext) {
  const std::string original = testing::content_of(image(0, 5));
  replace_by(image(0, 5), "/proc/self/mem");  // a regular file that open() accepts and read() answers with EIO
  const ProgramResult result = run("out");
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr(image(0, 5) + ": cannot be read: "));
  fs::remove(image(0, 5));
  std::ofstream(image(0, 5), std::ios::binary) << original;
  ASSERT_EQ(run("out", {"--resume"}).exit_code, 0);
  EXPECT_EQ(byte_stable_content(path("out")), expected_content());
}

TEST_F(RunFaults, TooFewFileDescriptorsEndTheRunAndNoFrameIsSkipped) {
  const ProgramResult result = run_in_shell(R"(ulimit -n 12; "$0" "$@" --threads 1)", words("out"));
  EXPECT_THAT(result.err, ::testing::Not(HasSubstr("skipped")));
  if (result.err.find("Sanitizer") != std::string::npos) GTEST_SKIP() << "a sanitizer needs descriptors of its own";
  ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 5 || result.exit_code == 3) << result.err;
  ASSERT_EQ(run("out", {"--resume"}).exit_code, 0);
  EXPECT_EQ(byte_stable_content(path("out")), expected_content());
}

TEST_F(RunFaults, ResumingNoticesAChangedImage) {
  ASSERT_EQ(run("out", {"--max-frames", "8"}).exit_code, 0);
  const auto before = byte_stable_content(path("out"));
  const std::string original = testing::content_of(image(0, 3));
  fs::copy_file(image(0, 4), image(0, 3), fs::copy_options::overwrite_existing);
  const ProgramResult resumed = run("out", {"--resume"});
  EXPECT_EQ(resumed.exit_code, 4);
  EXPECT_THAT(resumed.err, HasSubstr("has changed"));
  EXPECT_EQ(byte_stable_content(path("out")).at("run.sqlite"), before.at("run.sqlite"));
  std::ofstream(image(0, 3), std::ios::binary) << original;
  EXPECT_EQ(run("out", {"--resume"}).exit_code, 0);
  EXPECT_EQ(byte_stable_content(path("out")), expected_content());
}

TEST_F(RunFaults, ResumingAcceptsThatAFrameWasMissingAllTheTime) {
  fs::remove(image(1, 3));
  std::ofstream(image(0, 4)) << "damaged";
  ASSERT_EQ(run("out", {"--max-frames", "8"}).exit_code, 0);
  EXPECT_EQ(run("out", {"--resume"}).exit_code, 0);
}

TEST_F(RunFaults, OutOfMemoryIsSaid) {
  const ProgramResult result = run_in_shell(R"(ulimit -v 420000; "$0" "$@" --threads 1)", words("out"));
  if (result.exit_code == 127) GTEST_SKIP() << "the libraries do not fit";
  if (result.err.find("Sanitizer") != std::string::npos) GTEST_SKIP() << "a sanitizer needs more address space";
  ASSERT_TRUE(result.exit_code == 5 || result.exit_code == 0) << result.exit_code << result.err;
  if (result.exit_code == 5) {
    EXPECT_THAT(result.err, HasSubstr("memory"));
  }
  ASSERT_EQ(run("out", {"--resume"}).exit_code, 0);
  EXPECT_EQ(byte_stable_content(path("out")), expected_content());
}

}  // namespace
}  // namespace spartan
