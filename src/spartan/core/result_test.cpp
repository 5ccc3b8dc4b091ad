#include "spartan/core/result.h"

#include <gtest/gtest.h>

namespace spartan {
namespace {

Result<int> read(bool works) {
  if (!works) return failure(ErrorCode::input, "the file is empty", "a.png:3", "replace the file");
  return 7;
}

Result<std::string> read_more(bool works) {
  const auto number = read(works);
  if (!number) return failure(number);
  return std::to_string(*number);
}

TEST(Result, HandsErrorsOnThroughOtherTypes) {
  EXPECT_EQ(read_more(true).value(), "7");
  const auto failed = read_more(false);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::input);
  EXPECT_EQ(failed.error().message(), "a.png:3: the file is empty (replace the file)");
  const Status status = failure(read(false));
  EXPECT_FALSE(status);
}

TEST(Result, MessagesLeaveOutWhatIsNotKnown) {
  EXPECT_EQ((Error{ErrorCode::input, "what", "", ""}.message()), "what");
  EXPECT_EQ((Error{ErrorCode::input, "what", "where", ""}.message()), "where: what");
  EXPECT_EQ((Error{ErrorCode::input, "what", "", "hint"}.message()), "what (hint)");
}

}  // namespace
}  // namespace spartan
