// The command line itself: unknown commands, former flags, shell completion, the manual page.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "program.h"
#include "spartan/core/files.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using testing::run_program;

constexpr const char* kCommands[] = {"demo",   "run",   "stereo",   "map",        "evaluate", "rig",     "config",
                                     "export", "info",  "simulate", "completion", "man",      "convert", "design",
                                     "dump",   "check", "inspect",  "merge",      "features", "compare", "view"};

TEST(CommandLine, NamesAWordThatIsNoCommand) {
  const auto command = run_program({"fly"});
  EXPECT_EQ(command.exit_code, 2);
  EXPECT_THAT(command.err, HasSubstr("'fly' is not a spartan command; see `spartan --help`"));
  const auto in_group = run_program({"map", "fold", "--json"});
  EXPECT_EQ(in_group.exit_code, 2);
  EXPECT_THAT(in_group.err, HasSubstr("'fold' is not a spartan map command; see `spartan map --help`"));
}

TEST(CommandLine, SuggestsTheCommandThatWasMeant) {
  EXPECT_THAT(run_program({"simulat"}).err, HasSubstr("'simulat' is not a spartan command; did you mean `simulate`?"));
  EXPECT_THAT(run_program({"rig", "inspekt"}).err, HasSubstr("did you mean `inspect`? see `spartan rig --help`"));
}

TEST(CommandLine, NamesAnUnknownOptionBeforeTheCommand) {
  const auto alone = run_program({"--bogus"}), before_run = run_program({"--bogus=1", "run", "x"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.err, HasSubstr("'--bogus' is not an option of spartan; see `spartan --help`"));
  EXPECT_THAT(before_run.err, HasSubstr("'--bogus' is not an option of spartan"));
  EXPECT_THAT(run_program({"map", "--bogus"}).err, HasSubstr("'--bogus' is not an option of spartan map"));
}

TEST(CommandLine, WithoutACommandListsTheCommands) {
  const auto program = run_program({}), group = run_program({"map"});
  EXPECT_EQ(program.exit_code, 2);
  EXPECT_EQ(group.exit_code, 2);
  EXPECT_EQ(program.out, run_program({"--help"}).out);
  EXPECT_EQ(group.out, run_program({"map", "--help"}).out);
  EXPECT_THAT(group.out, HasSubstr("merge"));
}

TEST(CommandLine, HelpIsACommandToo) {
  EXPECT_EQ(run_program({"help"}).out, run_program({"--help"}).out);
  const auto help = run_program({"help", "rig", "inspect"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_EQ(help.out, run_program({"rig", "inspect", "--help"}).out);
  EXPECT_THAT(run_program({"help", "fly"}).err, HasSubstr("'fly' is not a spartan command"));
}

TEST(CommandLine, AcceptsFormerFlagsWithAWarning) {
  const std::string drive = testing::small_runs_folder() + "/drive";
  const testing::TemporaryFolder folder;
  const auto result = run_program({"rig", "inspect", drive + "/calib.txt", "--recording", drive, "--shots", "2",
                                   "--picture", folder.path() + "/rows.png"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("--shots is now called --frames"));
  EXPECT_THAT(result.err, HasSubstr("--picture is now called --figure"));
  EXPECT_EQ(run_program({"rig", "inspect", drive + "/calib.txt", "--recording", drive, "--shots", "0"}).exit_code, 2);
}

TEST(CommandLine, DisparityRangeThatCannotBeSearchedIsAWrongOption) {
  const std::string drive = testing::small_runs_folder() + "/drive";
  const testing::TemporaryFolder folder;
  const auto stereo = [&](std::vector<std::string> range) {
    std::vector<std::string> words{"stereo", drive + "/image_0/000000.png", drive + "/image_1/000000.png", "-o",
                                   folder.path() + "/out"};
    words.insert(words.end(), range.begin(), range.end());
    return run_program(words);
  };
  const auto empty = stereo({"--min-disparity", "5", "--max-disparity", "2"});
  EXPECT_EQ(empty.exit_code, 2);
  EXPECT_THAT(empty.err, HasSubstr("--min-disparity, --max-disparity: the range from 5 to 2 px is empty"));
  const auto wide = stereo({"--max-disparity", "320"});
  EXPECT_EQ(wide.exit_code, 2);
  EXPECT_THAT(wide.err, HasSubstr("exceeds the image, which is 320 px wide"));
}

// The words of an option line of a help text: "  --fps FLOAT   Frames per second …", with the lines that continue it.
std::vector<std::string> option_texts(const std::string& help) {
  std::vector<std::string> texts;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  -")) {
      texts.push_back(line);
    } else if (line.starts_with("    ") && !texts.empty()) {
      texts.back() += " " + line.substr(line.find_first_not_of(' '));
    } else {
      texts.emplace_back();
    }
  }
  return texts;
}

TEST(CommandLine, HelpStatesTheDefaultOfEveryOptionWithAValue) {
  const std::regex takes_value(" (TEXT|INT|UINT|FLOAT|HOW|WHICH|S|M,M,…)(:| |$)");
  int options = 0;
  for (const std::string command :
       {"demo", "run", "stereo", "map build", "map info", "map merge", "map export", "evaluate", "rig inspect",
        "rig convert", "rig design", "features compare", "config dump", "config check", "export", "simulate", "view"}) {
    std::vector<std::string> words;
    std::istringstream parts(command);
    for (std::string word; parts >> word;) words.push_back(word);
    words.emplace_back("--help");
    const auto result = run_program(words);
    ASSERT_EQ(result.exit_code, 0) << command;
    for (const std::string& text : option_texts(result.out)) {
      if (!std::regex_search(text, takes_value) || text.find("REQUIRED") != std::string::npos) continue;
      ++options;
      EXPECT_THAT(text, ::testing::AnyOf(HasSubstr("default"), HasSubstr("Repeatable"))) << command;
    }
  }
  EXPECT_GT(options, 40);
}

TEST(CommandLine, VersionNamesTheCommitAndTheLibraries) {
  const auto result = run_program({"--version"});
  ASSERT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, ::testing::ContainsRegex("^spartan [0-9.]+ \\(commit [0-9a-z-]+\\)"));
  for (const char* library : {"OpenCV 4.", "Eigen 3.", "Highway 1."}) EXPECT_THAT(result.out, HasSubstr(library));
}

// What is there stays, byte by byte, and is replaced with --force.
TEST(CommandLine, OutputThatExistsIsReplacedWithForceOnly) {
  const std::string runs = testing::small_runs_folder(), drive = runs + "/drive", run = runs + "/drive_run";
  const std::string left = drive + "/image_0/000000.png", right = drive + "/image_1/000000.png";
  const std::string source = testing::source_folder();
  const testing::TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::vector<std::string>>> commands{
      {"trajectory.tum", {"export", run, "--format", "tum"}},
      {"stereo/disparity.pfm", {"stereo", left, right}},
      {"map/map.tif", {"map", "build", left, right, "--rig", drive + "/calib.txt"}},
      {"design/feasible.csv", {"rig", "design", source + "/config/requirements/rover.yaml"}},
      {"run/run.sqlite", {"run", drive, "--max-frames", "2", "--odometry-only"}},
  };
  for (auto [output, words] : commands) {
    const std::string file = folder.path() + "/" + output;
    std::filesystem::create_directories(std::filesystem::path(file).parent_path());
    std::ofstream(file) << "mine";
    const std::string parent = output.substr(0, output.find('/'));
    words.insert(words.end(), {"-o", folder.path() + "/" + parent});
    const auto refused = run_program(words);
    EXPECT_EQ(refused.exit_code, 5) << output;
    EXPECT_THAT(refused.err, HasSubstr("--force")) << output;
    EXPECT_EQ(read_file(file).value(), "mine") << output;
    words.emplace_back("--force");
    const auto replaced = run_program(words);
    EXPECT_TRUE(replaced.exit_code == 0 || replaced.exit_code == 6) << output << ": " << replaced.err;
    EXPECT_NE(read_file(file).value(), "mine") << output;
  }
}

TEST(CommandLine, ForceLeavesAFolderAloneThatHoldsNoRun) {
  const testing::TemporaryFolder folder;
  const std::string note = folder.write("note.txt", "mine");
  const std::string drive = testing::small_runs_folder() + "/drive";
  const auto result = run_program({"run", drive, "-o", folder.path(), "--force"});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_EQ(read_file(note).value(), "mine");
}

// The former run is lost only when a frame of the new one was processed.
TEST(CommandLine, ForceKeepsTheFormerRunWhereTheNewOneCannotStart) {
  const testing::TemporaryFolder folder;
  const std::string drive = testing::small_runs_folder() + "/drive", run = folder.path() + "/run";
  const auto again = [&](const std::string& recording) {
    return run_program({"run", recording, "-o", run, "--max-frames", "2", "--odometry-only", "--force"});
  };
  ASSERT_EQ(again(drive).exit_code, 0) << "nothing is there yet";
  const std::string former = read_file(run + "/trajectory_odometry.tum").value();
  std::filesystem::copy(drive, folder.path() + "/broken", std::filesystem::copy_options::recursive);
  for (const char* side : {"image_0", "image_1"}) {
    for (const auto& entry : std::filesystem::directory_iterator(folder.path() + "/broken/" + side))
      std::ofstream(entry.path()) << "no image";
  }
  EXPECT_EQ(again(folder.path() + "/broken").exit_code, 3);
  EXPECT_EQ(again(folder.path() + "/missing").exit_code, 3);
  EXPECT_EQ(read_file(run + "/trajectory_odometry.tum").value(), former);
  // A recording inside of the folder that it would replace.
  std::filesystem::copy(drive, run + "/recording", std::filesystem::copy_options::recursive);
  const auto inside = again(run + "/recording");
  EXPECT_EQ(inside.exit_code, 5);
  EXPECT_THAT(inside.err, HasSubstr("holds 'recording', which is not of this command"));
  EXPECT_TRUE(std::filesystem::exists(run + "/recording/calib.txt"));
  std::filesystem::remove_all(run + "/recording");
  EXPECT_EQ(again(drive).exit_code, 0);
  EXPECT_EQ(list_folder(folder.path()).value(), (std::vector<std::string>{"broken", "run"})) << "nothing is left";
}

TEST(CommandLine, CompletionKnowsEveryCommandAndIsValidBash) {
  const testing::TemporaryFolder folder;
  for (const char* shell : {"bash", "zsh", "fish"}) {
    const auto script = run_program({"completion", shell});
    ASSERT_EQ(script.exit_code, 0) << script.err;
    for (const char* command : kCommands) EXPECT_THAT(script.out, HasSubstr(command)) << shell;
    EXPECT_THAT(script.out, HasSubstr("max-disparity")) << shell;
    if (shell != std::string("bash")) continue;
    const std::string file = folder.write("spartan.bash", script.out);
    EXPECT_EQ(std::system(fmt::format("bash -n '{}'", file).c_str()), 0);
  }
}

TEST(CommandLine, ManualPageDescribesEveryCommandAndFlag) {
  const auto page = run_program({"man"});
  ASSERT_EQ(page.exit_code, 0) << page.err;
  EXPECT_TRUE(page.out.starts_with(".TH"));
  for (const char* command : kCommands) EXPECT_THAT(page.out, HasSubstr(command));
  EXPECT_THAT(page.out, HasSubstr("\\-\\-max\\-disparity"));
}

}  // namespace
}  // namespace spartan
