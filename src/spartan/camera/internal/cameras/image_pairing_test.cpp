#include "spartan/camera/internal/cameras/image_pairing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>
#include <set>
#include <string>
#include <vector>

namespace spartan::internal {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;

const ImagePairing::Time kStart{};

StampedImage image_at(int time_ms, std::int64_t frame_id = -1, bool trusted = true) {
  StampedImage image;
  image.stamp = Stamp{time_ms * 1'000'000LL};
  image.trusted = trusted;
  image.image.frame_id = frame_id;
  image.image.complete = kStart + milliseconds(time_ms);
  return image;
}

// Each pair as the times of its images in ms, "100+102", "100+" alone.
std::vector<std::string> take_all(ImagePairing& pairing, int now_ms) {
  std::vector<std::string> texts;
  while (const auto pair = pairing.take(kStart + milliseconds(now_ms))) {
    const auto text = [&](std::size_t side) {
      return pair->images[side] ? std::to_string(pair->images[side]->stamp.ns / 1'000'000) : std::string();
    };
    texts.push_back(text(0) + "+" + text(1));
  }
  return texts;
}

TEST(ImagePairing, PairsByStamps) {
  ImagePairing pairing(0.005, milliseconds(200));
  for (const int time : {0, 100, 200}) pairing.add(0, image_at(time));
  for (const int time : {2, 104, 197}) pairing.add(1, image_at(time));
  EXPECT_THAT(take_all(pairing, 210), ElementsAre("0+2", "100+104", "200+197"));
}

TEST(ImagePairing, AnImageWithoutAPartnerComesAloneAsSoonAsThatIsKnown) {
  ImagePairing pairing(0.005, milliseconds(200));
  for (const int time : {0, 100, 300}) pairing.add(0, image_at(time));
  for (const int time : {0, 200}) pairing.add(1, image_at(time));
  EXPECT_THAT(take_all(pairing, 300), ElementsAre("0+0", "100+", "+200")) << "the last one waits";
  EXPECT_EQ(pairing.next_timeout(), kStart + milliseconds(500));
  EXPECT_THAT(take_all(pairing, 499), ElementsAre());
  EXPECT_THAT(take_all(pairing, 500), ElementsAre("300+"));
  EXPECT_FALSE(pairing.next_timeout());
}

TEST(ImagePairing, FrameIdsDecideWhereAStampIsWrong) {
  ImagePairing pairing(0.005, milliseconds(200));
  for (int i = 0; i < 4; ++i) {
    pairing.add(0, image_at(100 * i, 7 + i));
    pairing.add(1, image_at(100 * i, 65000 + i));
  }
  EXPECT_THAT(take_all(pairing, 300), ElementsAre("0+0", "100+100", "200+200", "300+300"));
  // The stamp of the left image is 60 ms off; the right one is there.
  pairing.add(0, image_at(460, 11, false));
  pairing.add(1, image_at(400, 65004));
  // The left camera has no image, and the right one has a wrong stamp that would fit the next left one.
  pairing.add(1, image_at(600, 65005, false));
  pairing.add(0, image_at(600, 13));
  pairing.add(1, image_at(601, 65006));
  EXPECT_THAT(take_all(pairing, 610), ElementsAre("460+400", "+600", "600+601"));
}

TEST(ImagePairing, TriggersDecideWhereThereAreAny) {
  ImagePairing pairing(0.005, milliseconds(200));
  const auto add = [&](int side, int time_ms, std::int64_t trigger) {
    StampedImage image = image_at(time_ms);
    image.trigger = trigger;
    pairing.add(side, std::move(image));
  };
  add(0, 0, 7);
  add(1, 3, 7);
  add(0, 100, 8);
  add(1, 130, 8);  // sent late
  add(0, 200, 9);  // the right camera has none
  add(0, 300, 10);
  add(1, 300, 10);
  const auto first = pairing.take(kStart + milliseconds(310)), second = pairing.take(kStart + milliseconds(310));
  ASSERT_TRUE(first && first->is_complete() && second && second->is_complete());
  EXPECT_FALSE(pairing.is_apart(*first));
  EXPECT_TRUE(pairing.is_apart(*second));
  EXPECT_THAT(take_all(pairing, 310), ElementsAre("200+", "300+300"));
}

TEST(ImagePairing, ACameraThatCountsFromANewStartIsFollowed) {
  ImagePairing pairing(0.005, milliseconds(200));
  for (int i = 0; i < 10; ++i) {
    pairing.add(0, image_at(100 * i, i));
    pairing.add(1, image_at(100 * i, i < 5 ? i : i - 5));
  }
  EXPECT_EQ(take_all(pairing, 900).size(), 10u);
  pairing.add(0, image_at(1000, 10));
  pairing.add(1, image_at(1050, 5, false));
  EXPECT_THAT(take_all(pairing, 1050), ElementsAre("1000+1050")) << "the new difference of the ids is known";
}

// Any images may be missing; delays within the tolerance; every image comes out once, and no pair is of two triggers.
RC_GTEST_PROP(ImagePairing, EveryImageComesOutOnceAndNoPairIsOfTwoTriggers, ()) {
  ImagePairing pairing(0.005, milliseconds(150));
  const auto kept = *rc::gen::container<std::vector<std::pair<bool, bool>>>(
      rc::gen::pair(rc::gen::weightedElement<bool>({{4, true}, {1, false}}),
                    rc::gen::weightedElement<bool>({{4, true}, {1, false}})));
  const auto skews = *rc::gen::container<std::vector<int>>(kept.size(), rc::gen::inRange(-4, 5));
  const bool ids = *rc::gen::arbitrary<bool>();
  std::size_t images = 0, pairs = 0, both = 0, out = 0;
  const auto drain = [&](int now_ms) {
    while (const auto pair = pairing.take(kStart + milliseconds(now_ms))) {
      out += pair->is_complete() ? 2 : 1;
      pairs += pair->is_complete();
      if (!pair->is_complete()) continue;
      RC_ASSERT(std::abs(seconds_between(pair->images[0]->stamp, pair->images[1]->stamp)) < 0.0051);
    }
  };
  int now_ms = 0;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    now_ms = static_cast<int>(i) * 100 + 10;
    const auto id = ids ? static_cast<std::int64_t>(i) : -1;
    if (kept[i].first) pairing.add(0, image_at(now_ms, id));
    if (kept[i].second) pairing.add(1, image_at(now_ms + skews[i], id));
    images += kept[i].first + kept[i].second;
    both += kept[i].first && kept[i].second;
    drain(now_ms + 5);
  }
  drain(now_ms + 1000);
  RC_ASSERT(out == images);
  RC_ASSERT(pairs == both);
}

}  // namespace
}  // namespace spartan::internal
