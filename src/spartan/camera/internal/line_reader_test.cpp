#include "spartan/camera/internal/line_reader.h"

#include <gtest/gtest.h>

#include <random>
#include <sstream>
#include <vector>

#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

using testing::TemporaryFolder;

struct OwnedLine {
  std::string text;
  bool has_newline = false, is_too_long = false;
  bool operator==(const OwnedLine&) const = default;
};

std::vector<OwnedLine> all_lines(LineReader reader) {
  std::vector<OwnedLine> lines;
  for (;;) {
    const auto line = reader.next();
    EXPECT_TRUE(line);
    if (!line || !*line) return lines;
    lines.push_back({std::string((*line)->text), (*line)->has_newline, (*line)->is_too_long});
  }
}

std::vector<OwnedLine> lines_of_file(const TemporaryFolder& folder, const std::string& text) {
  auto reader = LineReader::open(folder.write("text", text));
  EXPECT_TRUE(reader);
  return all_lines(std::move(*reader));
}

// Oracle: std::getline.
std::vector<OwnedLine> expected_lines(const std::string& text) {
  std::vector<OwnedLine> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back({line, !stream.eof(), false});
  return lines;
}

TEST(LineReader, GivesTheLinesOfRandomTexts) {
  const TemporaryFolder folder;
  std::mt19937 random(7);
  const auto below = [&random](std::size_t end) { return random() % end; };
  for (int round = 0; round < 40; ++round) {
    std::string text;
    const std::size_t lines = below(60);
    for (std::size_t i = 0; i < lines; ++i) {
      // Blocks of 65536 bytes end at all places of lines.
      text.append(below(round % 2 == 0 ? 5 : 20000), 'x');
      text += '\n';
    }
    if (round % 3 == 0) text += "rest";
    EXPECT_EQ(lines_of_file(folder, text), expected_lines(text)) << "round " << round;
    EXPECT_EQ(all_lines(LineReader::over(text)), expected_lines(text)) << "round " << round;
  }
}

TEST(LineReader, AnOverlongLineIsMarkedAndTheNextOneIsWhole) {
  const TemporaryFolder folder;
  for (const std::size_t excess : {std::size_t{1}, std::size_t{70000}, 3 * LineReader::kLongestLine_bytes}) {
    const std::string text = "first\n" + std::string(LineReader::kLongestLine_bytes + excess, 'x') + "\nlast\n";
    const auto lines = lines_of_file(folder, text);
    ASSERT_EQ(lines.size(), 3U) << excess;
    EXPECT_FALSE(lines[0].is_too_long);
    EXPECT_TRUE(lines[1].is_too_long);
    EXPECT_EQ(lines[2], (OwnedLine{"last", true, false}));
  }
  const auto open_end = lines_of_file(folder, std::string(2 * LineReader::kLongestLine_bytes, 'x'));
  ASSERT_EQ(open_end.size(), 1U);
  EXPECT_TRUE(open_end[0].is_too_long);
  const auto longest = lines_of_file(folder, std::string(LineReader::kLongestLine_bytes, 'x') + "\n");
  ASSERT_EQ(longest.size(), 1U);
  EXPECT_FALSE(longest[0].is_too_long);
}

TEST(LineReader, ReportsReadErrors) {
  auto reader = LineReader::open("/proc/self/mem");
  ASSERT_TRUE(reader);
  const auto line = reader->next();
  ASSERT_FALSE(line);
  EXPECT_EQ(line.error().code, ErrorCode::read_error);
}

}  // namespace
}  // namespace spartan::internal
