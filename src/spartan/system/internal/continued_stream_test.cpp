#include "spartan/system/internal/continued_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;
using ::testing::DoubleNear;
using ::testing::Pointwise;

// Wheel samples with given stamps, by a clock.
class Wheels : public SampleStream {
 public:
  explicit Wheels(std::vector<double> stamps_s) : stamps_s_(std::move(stamps_s)) {}
  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds) override {
    StreamRead read;
    if (next_ == stamps_s_.size()) return StreamRead{StreamRead::State::end, {}, {}};
    read.state = StreamRead::State::sample;
    read.sample = WheelSample{Stamp::from_seconds(stamps_s_[next_++]), 0, 0};
    return read;
  }
  std::size_t previews(const std::string&) const override { return 0; }
  Result<StereoFrame> preview(const std::string&, std::size_t) override { return failure(ErrorCode::input, "none"); }

 private:
  StreamInfo info_;
  std::vector<double> stamps_s_;
  std::size_t next_ = 0;
};

std::vector<double> stamps_of(ContinuedStream& stream) {
  std::vector<double> stamps_s;
  for (auto read = stream.read(1ms); read && read->sample; read = stream.read(1ms))
    stamps_s.push_back(seconds_between(Stamp{}, stamp_of(*read->sample)));
  return stamps_s;
}

TEST(ContinuedStream, AClockThatWentBackGoesOnAfterTheRun) {
  Wheels wheels({20, 20.1, 20.2});
  std::vector<std::string> said;
  ContinuedStream stream(wheels, Log::to_function([&](LogLevel, std::string_view text) { said.emplace_back(text); }));
  stream.start_after(Stamp::from_seconds(3620));
  EXPECT_THAT(stamps_of(stream), Pointwise(DoubleNear(1e-6), std::vector<double>{3621, 3621.1, 3621.2}));
  ASSERT_EQ(said.size(), 1u);
  EXPECT_THAT(said[0], ::testing::HasSubstr("3600.0 s behind"));
}

TEST(ContinuedStream, LaterStampsAreNotChanged) {
  Wheels wheels({20, 20.1, 20.2}), first({20});
  ContinuedStream stream(wheels, Log()), new_run(first, Log());
  stream.start_after(Stamp::from_seconds(19));
  EXPECT_THAT(stamps_of(stream), Pointwise(DoubleNear(1e-6), std::vector<double>{20, 20.1, 20.2}));
  EXPECT_THAT(stamps_of(new_run), Pointwise(DoubleNear(1e-6), std::vector<double>{20.0}));
}

TEST(ContinuedStream, MovesTheImagesOfFramesWithOneImage) {
  MissingFrame missing;
  missing.stamp = Stamp::from_seconds(1);
  missing.partial.emplace();
  missing.partial->left_stamp = missing.partial->right_stamp = missing.stamp;
  Sample sample = missing;
  move_stamps(sample, 500'000'000);
  const auto& moved = std::get<MissingFrame>(sample);
  EXPECT_EQ(moved.stamp, Stamp::from_seconds(1.5));
  EXPECT_EQ(moved.partial->left_stamp, Stamp::from_seconds(1.5));
  EXPECT_EQ(moved.partial->right_stamp, Stamp::from_seconds(1.5));
}

}  // namespace
}  // namespace spartan::internal
