#include "spartan/camera/internal/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numbers>

#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::vector<std::vector<std::string>> rows_of(const std::string& text, const TableFormat& format = {}) {
  const TemporaryFolder folder;
  auto table = TableReader::open(folder.write("t.csv", text), format);
  EXPECT_TRUE(table) << table.error().message();
  std::vector<std::vector<std::string>> rows;
  while (true) {
    const auto row = table->next();
    EXPECT_TRUE(row) << row.error().message();
    if (!row || !*row) return rows;
    rows.emplace_back((*row)->begin(), (*row)->end());
  }
}

TEST(Table, IgnoresBlanksCommentsAndCarriageReturns) {
  EXPECT_THAT(rows_of("# a remark\r\n1, 2 ,3\r\n\r\n   \n4,5,6"),
              ElementsAre(ElementsAre("1", "2", "3"), ElementsAre("4", "5", "6")));
  EXPECT_THAT(rows_of("1  2\t 3  \n", {.separator = ' ', .header = {}, .ends_with_newline = false}),
              ElementsAre(ElementsAre("1", "2", "3")));
  EXPECT_THAT(rows_of("a,b\n1,,2\n", {.separator = ',', .header = "a,b", .ends_with_newline = false}),
              ElementsAre(ElementsAre("1", "", "2")));
  EXPECT_THAT(rows_of(""), ElementsAre());
}

TEST(Table, ErrorsNameFileAndLine) {
  const TemporaryFolder folder;
  const auto missing = TableReader::open(folder.path() + "/none.csv", {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::input);
  EXPECT_THAT(missing.error().message(), HasSubstr("none.csv"));
  EXPECT_FALSE(TableReader::open(folder.path(), {})) << "a folder is not a table";

  const TableFormat format{.separator = ',', .header = "a,b", .ends_with_newline = true};
  const auto other = TableReader::open(folder.write("h.csv", "a,c\n"), format);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message(), HasSubstr("h.csv:1: the columns are 'a,c', expected 'a,b'"));

  auto table = TableReader::open(folder.write("t.csv", "a,b\n1,2\n3\n4,5"), format);
  ASSERT_TRUE(table);
  EXPECT_TRUE(table->next(2));
  const auto few = table->next(2);
  ASSERT_FALSE(few);
  EXPECT_THAT(few.error().message(), HasSubstr("t.csv:3: 1 values, expected 2: '3'"));
  const auto broken = table->next(2);
  ASSERT_FALSE(broken);
  EXPECT_THAT(broken.error().message(), HasSubstr("t.csv:4: the file is truncated"));
}

TEST(Table, ParsesCompleteAndFiniteNumbersOnly) {
  EXPECT_EQ(parse_number<double>("-1.5e3"), -1500);
  EXPECT_EQ(parse_number<std::int64_t>("-9223372036854775808"), INT64_MIN);
  for (const char* bad : {"", " 1", "1 ", "1x", "nan", "inf", "-inf", "1e999", "0x10", "1,5", "--1"}) {
    EXPECT_FALSE(parse_number<double>(bad)) << bad;
  }
  EXPECT_FALSE(parse_number<std::int64_t>("9223372036854775808"));
  EXPECT_FALSE(parse_number<int>("1.0"));
  EXPECT_TRUE(parse_stamp_ns("1403636580838555648"));
  EXPECT_FALSE(parse_stamp_ns("9223372036854775807")) << "differences would overflow";
}

RC_GTEST_PROP(Table, RadiansRoundTripThroughDegrees, ()) {
  const double radians = *rc::gen::map(rc::gen::inRange<std::int64_t>(-4000000000000, 4000000000000),
                                       [](std::int64_t v) { return static_cast<double>(v) / 1.1e12; });
  RC_ASSERT(parse_degrees(to_degrees(radians)) == radians);
}

TEST(Table, WritesShortDegrees) {
  EXPECT_EQ(to_degrees(35 * std::numbers::pi / 180), "35");
  EXPECT_EQ(to_degrees(-std::numbers::pi / 2), "-90");
  EXPECT_EQ(to_degrees(0), "0");
}

}  // namespace
}  // namespace spartan::internal
