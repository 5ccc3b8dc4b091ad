#include "spartan/core/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Log, WithoutASinkDiscardsMessages) {
  ::testing::internal::CaptureStderr();
  const Log log;
  log.error("discarded");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Log, TheFileReceivesLevelInfoAndAbove) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.write("log.txt", "earlier\n");
  ::testing::internal::CaptureStderr();
  {
    Log log = Log::to_terminal(LogLevel::error);
    const Log copy = log;  // NOLINT(performance-unnecessary-copy-initialization): that copies share the file is tested
    const LogFile attached = log.attach_file(path);
    log.debug("a detail");
    copy.info("a {brace} is no format");
    log.warning("a warning");
    log.error("an error");
  }
  const std::string terminal = ::testing::internal::GetCapturedStderr();
  const std::string file = testing::content_of(path);
  EXPECT_THAT(file, HasSubstr("earlier\n"));
  EXPECT_THAT(file, HasSubstr("info: a {brace} is no format\n"));
  EXPECT_THAT(file, HasSubstr("warning: a warning\n"));
  EXPECT_THAT(file, HasSubstr("error: an error\n"));
  EXPECT_THAT(file, Not(HasSubstr("a detail")));
  EXPECT_THAT(terminal, HasSubstr("an error"));
  EXPECT_THAT(terminal, Not(HasSubstr("a warning")));
}

TEST(Log, AFileThatCannotBeOpenedIsIgnored) {
  ::testing::internal::CaptureStderr();
  Log log = Log::to_terminal(LogLevel::info);
  const LogFile attached = log.attach_file("/proc/none/log.txt");
  log.info("still printed");
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("still printed"));
}

TEST(Log, AFileIsWrittenWhileItIsAttached) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/log.txt";
  Log log;
  {
    const LogFile attached = log.attach_file(path);
    log.info("the first run");
  }
  log.info("another run");
  EXPECT_THAT(testing::content_of(path), HasSubstr("the first run"));
  EXPECT_THAT(testing::content_of(path), Not(HasSubstr("another run")));
}

}  // namespace
}  // namespace spartan
