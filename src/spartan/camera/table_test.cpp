#include "spartan/camera/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Rows = std::vector<std::vector<std::string>>;

Result<Rows> rows_of(const std::string& text, const TableFormat& format, std::size_t fields = 1) {
  auto table = TableReader::over(text, "t.csv", format);
  if (!table) return failure(table);
  Rows rows;
  for (;;) {
    const auto row = table->next(fields);
    if (!row) return failure(row);
    if (!*row) return rows;
    rows.emplace_back((*row)->begin(), (*row)->end());
  }
}

std::string fault_of(const std::string& text, const TableFormat& format, std::size_t fields = 1) {
  const auto rows = rows_of(text, format, fields);
  return rows ? "no fault" : rows.error().message();
}

const TableFormat kNamed{.separator = ',', .header = "a,b", .ends_with_newline = true};

TEST(Table, TakesOffWhatEditorsAndPeopleAdd) {
  const Rows expected{{"1", "2"}, {"3", "4"}};
  EXPECT_EQ(rows_of("1,2\n3,4\n", {}), expected);
  EXPECT_EQ(rows_of("1,2\r\n3,4\r\n", {}), expected) << "CRLF";
  EXPECT_EQ(rows_of("  1 , 2 \t\n\n   \n3,\t4   \n\n", {}), expected) << "blanks and empty lines";
  EXPECT_EQ(rows_of("# remark\n1,2\n  # another, one\n3,4\n#\n", {}), expected) << "comments";
  EXPECT_EQ(rows_of("\xEF\xBB\xBF"
                    "1,2\n3,4",
                    {}),
            expected)
      << "byte-order mark, no newline at the end";
  EXPECT_EQ(rows_of("\xEF\xBB\xBF"
                    "# made by hand\r\na, b\r\n1,2\r\n# half way\r\n3,4\r\n",
                    kNamed),
            expected);
  EXPECT_EQ(rows_of("", {}), Rows{});
  EXPECT_EQ(rows_of("a,b\n", kNamed), Rows{});
}

TEST(Table, EmptyFieldsStay) {
  EXPECT_EQ(rows_of("1,,\n,\n", {}), (Rows{{"1", "", ""}, {"", ""}}));
}

TEST(Table, RunsOfBlanksSeparateOnce) {
  EXPECT_EQ(rows_of("  1   2\t3 \r\n4\n", {.separator = ' ', .header = {}, .ends_with_newline = false}),
            (Rows{{"1", "2", "3"}, {"4"}}));
}

TEST(Table, FaultsNameFileAndLine) {
  EXPECT_THAT(fault_of("", kNamed), HasSubstr("t.csv: is empty, expected are the columns 'a,b'"));
  EXPECT_THAT(fault_of("# x\nb,a\n", kNamed), HasSubstr("t.csv:2: the columns are 'b,a', expected are 'a,b'"));
  EXPECT_THAT(fault_of("a,b,c\n1,2,3\n", kNamed), HasSubstr("t.csv:1: the columns are"));
  EXPECT_THAT(fault_of("a,b\n\n1,2\n3\n", kNamed, 2), HasSubstr("t.csv:4: 1 values where 2 are expected: '3'"));
  EXPECT_THAT(fault_of("a,b\n1,2\n3,4", kNamed, 2), HasSubstr("t.csv:3: the file breaks off in this line"));
  EXPECT_EQ(fault_of("a,b\n1,2\n3,4\n", kNamed, 2), "no fault");
}

TEST(Table, ForeignBytesAreQuotedShortAndPrintable) {
  const std::string fault = fault_of(std::string("a\0\x1B[31m", 7) + std::string(500, 'x') + "\n", kNamed);
  EXPECT_LT(fault.size(), 200U);
  for (const char c : fault) {
    EXPECT_TRUE(static_cast<unsigned char>(c) >= ' ') << static_cast<int>(c);
  }
}

TEST(Table, FilesThatCannotBeReadAreSaid) {
  const testing::TemporaryFolder folder;
  const auto missing = TableReader::open(folder.path() + "/none.csv", {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::input);
  EXPECT_THAT(missing.error().message(), HasSubstr("none.csv: is missing"));
  EXPECT_FALSE(TableReader::open(folder.path(), {})) << "a folder";
  const auto table = TableReader::open(folder.write("t.csv", "1,2\n"), {});
  ASSERT_TRUE(table);
  EXPECT_EQ(table->path(), folder.path() + "/t.csv");
}

TEST(ParseNumber, TakesTheWholeTextOrNothing) {
  EXPECT_EQ(parse_number<double>("-1.5e3"), -1500.0);
  EXPECT_EQ(parse_number<int>("42"), 42);
  for (const char* text : {"", " 1", "1 ", "1x", "nan", "NaN", "inf", "-inf", "1e999", "+1", "0x10", "1,5"}) {
    EXPECT_FALSE(parse_number<double>(text)) << text;
  }
  for (const char* text : {"1.0", "99999999999999999999", ""}) EXPECT_FALSE(parse_number<std::int64_t>(text)) << text;
}

TEST(ParseStamp, RefusesWhatDifferencesWouldOverflow) {
  EXPECT_EQ(parse_stamp_ns("1403715273262142976"), (Stamp{1403715273262142976}));
  EXPECT_EQ(parse_stamp_ns("-5"), (Stamp{-5}));
  EXPECT_FALSE(parse_stamp_ns("9223372036854775807"));
  EXPECT_FALSE(parse_stamp_ns("-9223372036854775808"));
  EXPECT_FALSE(parse_stamp_ns("1.0"));
}

RC_GTEST_PROP(Degrees, RoundTripBitForBit, ()) {
  const double radians = *rc::gen::cast<double>(rc::gen::arbitrary<std::int32_t>()) * 1e-9 *
                         (1 + *rc::gen::cast<double>(rc::gen::arbitrary<std::int16_t>()) * 1e-7);
  const auto back = parse_degrees(to_degrees(radians));
  RC_ASSERT(back.has_value());
  RC_ASSERT(*back == radians);
}

TEST(Degrees, AreShortWherePeopleWroteThem) {
  EXPECT_EQ(to_degrees(*parse_degrees("-35")), "-35");
  EXPECT_EQ(to_degrees(*parse_degrees("31.55")), "31.55");
  EXPECT_EQ(to_degrees(0), "0");
  EXPECT_FALSE(parse_degrees("nan"));
}

}  // namespace
}  // namespace spartan
