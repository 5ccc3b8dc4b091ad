// `spartan demo` from outside: what it leaves, and its page in a browser.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>

#include "program.h"
#include "small_scenario.h"
#include "spartan/testing/doc_example.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using testing::content_of;
using ::testing::HasSubstr;
using testing::run_program;

TEST(Demo, LeavesARecordingARunAndAPageWithoutErrors) {
  const testing::TemporaryFolder folder;
  folder.write("small_rig.yaml", testing::kSmallRig);
  const std::string scenario = folder.write("small.yaml", testing::kSmallScenario), out = folder.path() + "/demo";
  const auto result = run_program({"demo", scenario, "-o", out, "-q"});
  if (result.err.find("no simulator") != std::string::npos) GTEST_SKIP() << "built without Embree";
  ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 6) << result.err;
  EXPECT_TRUE(fs::exists(out + "/recording/recording.yaml"));
  EXPECT_TRUE(fs::exists(out + "/run/summary.json"));
  const std::string page = content_of(out + "/report.html");
  for (const char* part : {"Images", "Trajectories on the global map", "Disparity errors", "True elevation",
                           "Time and memory", "position error, RMS, SE3 alignment",
                           "position error, RMS, first poses aligned", "run/summary.json", "spartan demo "}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  for (const char* part : {"frames/s", "ATE, m", "ATE, first poses aligned, m"})
    EXPECT_THAT(result.out, HasSubstr(part));
  const std::string check = testing::source_folder() + "/scripts/check_page " + out + "/report.html";
  const int status = std::system(check.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "no Chromium to look at the page with";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(Demo, LeavesAnExistingFolderAsItIs) {
  const testing::TemporaryFolder folder;
  folder.write("small_rig.yaml", testing::kSmallRig);
  const std::string scenario = folder.write("small.yaml", testing::kSmallScenario);
  folder.write("demo/recording/mine.txt", "mine");
  const auto result = run_program({"demo", scenario, "-o", folder.path() + "/demo", "-q"});
  if (result.err.find("no simulator") != std::string::npos) GTEST_SKIP() << "built without Embree";
  EXPECT_EQ(result.exit_code, 5) << result.err;
  EXPECT_EQ(content_of(folder.path() + "/demo/recording/mine.txt"), "mine");
}

}  // namespace
}  // namespace spartan
