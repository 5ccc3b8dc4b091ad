#include "spartan/calibration_io/internal/calibration_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/calibration_io/internal/text_matrices.h"

namespace spartan::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(CalibrationText, WordsAreSeparatedByAnyWhiteSpace) {
  EXPECT_THAT(split_words(""), IsEmpty());
  EXPECT_THAT(split_words(" \t\r\n"), IsEmpty());
  EXPECT_THAT(split_words("one"), ElementsAre("one"));
  EXPECT_THAT(split_words("  a b\t\tc\r\nd\v\fe "), ElementsAre("a", "b", "c", "d", "e"));
}

TEST(CalibrationText, LinesAreCountedFromOneAndTheLastNeedsNoEnd) {
  const TextMatrices matrices = TextMatrices::parse("a: 1 2 # more\n\nlone\r\nb: 3", "file", ':');
  EXPECT_THAT(matrices.numbers("a", 2).value(), ElementsAre(1, 2));
  EXPECT_THAT(matrices.numbers("b", 1).value(), ElementsAre(3));
  ASSERT_EQ(matrices.words().size(), 1U);
  EXPECT_EQ(matrices.where("b"), "file:4");
  EXPECT_TRUE(TextMatrices::parse("", "file", ':').words().empty());
}

}  // namespace
}  // namespace spartan::internal
