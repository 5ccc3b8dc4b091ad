#include "spartan/camera/internal/increasing_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>
#include <vector>

namespace spartan::internal {
namespace {

using ::testing::ElementsAre;

// Rows with these stamps, then an error where `truncated` is set.
class Rows : public SensorStream {
 public:
  Rows(std::vector<std::int64_t> stamps, bool truncated) : stamps_(std::move(stamps)), truncated_(truncated) {}
  Result<std::optional<Sample>> next() override {
    if (at_ < stamps_.size()) return Sample(WheelSample{{stamps_[at_++]}, 0, 0});
    if (truncated_) return failure(ErrorCode::input, "truncated");
    return std::nullopt;
  }

 private:
  std::vector<std::int64_t> stamps_;
  std::size_t at_ = 0;
  bool truncated_;
};

struct Read {
  std::vector<std::int64_t> stamps;
  bool fault = false;
  std::int64_t discarded = 0;
};

Read read(const std::vector<std::int64_t>& stamps, bool truncated = false) {
  IncreasingStream stream(std::make_unique<Rows>(stamps, truncated));
  Read all;
  while (true) {
    const auto row = stream.next();
    all.fault = !row;
    all.discarded = stream.discarded().reversed;
    if (!row || !*row) return all;
    all.stamps.push_back(stamp_of(**row).ns);
  }
}

TEST(IncreasingStream, DiscardsAnOutlierAlone) {
  EXPECT_THAT(read({1, 2, 900, 3, 4}).stamps, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(read({1, 2, -900, 3, 4}).stamps, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(read({900, 1, 2, 3}).stamps, ElementsAre(1, 2, 3));
  EXPECT_THAT(read({1, 2, 2, 3, 3, 4}).stamps, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(read({1, 2, 900, 3, 3, 1, 4}).discarded, 3);
  EXPECT_THAT(read({}).stamps, ElementsAre());
}

TEST(IncreasingStream, ReturnsValidRowsBeforeAnError) {
  const Read all = read({1, 2, 3}, true);
  EXPECT_THAT(all.stamps, ElementsAre(1, 2, 3));
  EXPECT_TRUE(all.fault);
}

RC_GTEST_PROP(IncreasingStream, DiscardsIsolatedBurstsOnly, ()) {
  std::vector<std::int64_t> stamps, sound;
  for (std::int64_t i = 0; i < 500; ++i) {
    stamps.push_back(10 * i);
    sound.push_back(10 * i);
    if (i % 40 == 20) {
      const int burst = *rc::gen::inRange(0, 12);
      const std::int64_t jump = *rc::gen::inRange(-100000, 100000);
      for (int k = 0; k < burst; ++k) stamps.push_back(10 * i + (jump >= 0 ? 100000 + jump : -100000 + jump) + k);
    }
  }
  const Read all = read(stamps);
  RC_ASSERT(all.stamps == sound);
  RC_ASSERT(all.discarded == static_cast<std::int64_t>(stamps.size() - sound.size()));
}

}  // namespace
}  // namespace spartan::internal
