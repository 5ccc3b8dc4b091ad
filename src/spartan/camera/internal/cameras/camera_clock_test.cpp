#include "spartan/camera/internal/cameras/camera_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace spartan::internal {
namespace {

constexpr double kRate = 1 + 40e-6;  // seconds of the host in one of the camera

// A camera at 10 Hz whose clock began somewhere else, and delays of its images.
class FakeClock {
 public:
  explicit FakeClock(std::uint64_t seed) : random_(seed) {}

  struct Image {
    std::int64_t camera_ns;
    Stamp taken, noticed;
  };
  Image next(const std::function<double(std::mt19937_64&)>& delay_s) {
    const double camera_s = 0.1 * count_++;
    const auto taken_ns = static_cast<std::int64_t>(1.8e18) + std::llround(kRate * camera_s * 1e9);
    return {std::llround(camera_s * 1e9) + 77'000'000, Stamp{taken_ns},
            Stamp{taken_ns + std::llround(delay_s(random_) * 1e9)}};
  }

 private:
  std::mt19937_64 random_;
  int count_ = 0;
};

double late_by_exponential(std::mt19937_64& random) {
  return std::exponential_distribution<double>(1 / 0.003)(random);
}

double late_by_normal(std::mt19937_64& random) {
  return std::normal_distribution<double>(0, 0.002)(random);
}

double late_by_stalls(std::mt19937_64& random) {
  const double jitter = std::exponential_distribution<double>(1 / 0.0003)(random);
  return std::uniform_real_distribution<double>(0, 1)(random) < 0.3 ? jitter + 0.08 : jitter;
}

struct Errors {
  double rms_s = 0, largest_s = 0, beyond_3_sigma = 0, rate = 0;
};

Errors errors_of(const std::function<double(std::mt19937_64&)>& delay_s, int from, int to) {
  Errors errors;
  int count = 0, beyond = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    FakeClock camera(seed);
    CameraClock clock;
    for (int i = 0; i < to; ++i) {
      const auto image = camera.next(delay_s);
      const MappedStamp mapped = clock.add(image.camera_ns, image.noticed);
      if (i < from) continue;
      const double error_s = seconds_between(image.taken, mapped.host);
      errors.rms_s += error_s * error_s;
      errors.largest_s = std::max(errors.largest_s, std::abs(error_s));
      beyond += std::abs(error_s) > 3 * mapped.sigma_s;
      ++count;
    }
    errors.rate = std::max(errors.rate, std::abs(clock.rate() - kRate));
  }
  errors.rms_s = std::sqrt(errors.rms_s / count);
  errors.beyond_3_sigma = static_cast<double>(beyond) / count;
  return errors;
}

TEST(CameraClock, FollowsTheRateAndTheEarliestArrivals) {
  // A mean delay of 3 ms, standard deviation 3 ms: what an average of arrivals would be off by.
  const Errors late = errors_of(late_by_exponential, 300, 1200);
  EXPECT_LT(late.rms_s, 0.7e-3);
  EXPECT_LT(late.rate, 15e-6);
  EXPECT_LT(late.beyond_3_sigma, 0.003);
  const Errors stalls = errors_of(late_by_stalls, 300, 1200);
  EXPECT_LT(stalls.rms_s, 0.15e-3);
  EXPECT_LT(stalls.beyond_3_sigma, 0.003);
}

TEST(CameraClock, StatesASigmaThatCoversItsErrors) {
  for (const auto& delay : {late_by_exponential, late_by_normal, late_by_stalls}) {
    EXPECT_LT(errors_of(delay, 0, 1200).beyond_3_sigma, 0.01);
    EXPECT_LT(errors_of(delay, 0, 30).beyond_3_sigma, 0.02) << "of the first images";
  }
}

TEST(CameraClock, OneWrongStampHarmsOneImageAtMost) {
  for (const std::int64_t wrong_ns : {std::int64_t{0}, std::int64_t{9'000'000'000'000}, std::int64_t{-5}}) {
    FakeClock camera(3);
    CameraClock clock;
    for (int i = 0; i < 400; ++i) {
      auto image = camera.next(late_by_exponential);
      if (i == 200) image.camera_ns = wrong_ns;
      const MappedStamp mapped = clock.add(image.camera_ns, image.noticed);
      EXPECT_EQ(mapped.trusted, i != 200) << i;
      if (i >= 100) {
        EXPECT_LT(std::abs(seconds_between(image.taken, mapped.host)), i == 200 ? 0.025 : 0.002) << i;
      }
    }
    EXPECT_EQ(clock.restarts(), 0);
  }
}

TEST(CameraClock, TheFirstStampMayBeTheWrongOne) {
  FakeClock camera(3);
  CameraClock clock;
  for (int i = 0; i < 50; ++i) {
    auto image = camera.next(late_by_exponential);
    if (i == 0) image.camera_ns += 5'000'000'000'000;
    const MappedStamp mapped = clock.add(image.camera_ns, image.noticed);
    EXPECT_LT(std::abs(seconds_between(image.taken, mapped.host)), 0.03) << i;
    EXPECT_EQ(mapped.trusted, i == 0 || i > 2) << i;
  }
}

TEST(CameraClock, ACameraThatSetsItsClockIsFollowed) {
  for (const std::int64_t step_ns : {std::int64_t{-10'000'000'000}, std::int64_t{3'600'000'000'000}}) {
    FakeClock camera(4);
    CameraClock clock;
    for (int i = 0; i < 400; ++i) {
      auto image = camera.next(late_by_exponential);
      if (i >= 200) image.camera_ns += step_ns;
      const MappedStamp mapped = clock.add(image.camera_ns, image.noticed);
      EXPECT_EQ(mapped.trusted, i != 200 && i != 201) << i;
      if (i >= 30) {
        EXPECT_LT(std::abs(seconds_between(image.taken, mapped.host)), 0.03) << i;
      }
    }
    EXPECT_EQ(clock.restarts(), 1);
  }
}

// By half an interval to two: the stamps still increase, or do again with the next image.
TEST(CameraClock, ASmallStepOfTheClockIsFollowed) {
  for (const double intervals : {-2.0, -1.5, -1.0, -0.5, 0.5, 1.0, 2.0}) {
    for (const auto& delay : {late_by_exponential, late_by_normal}) {
      FakeClock camera(5);
      CameraClock clock;
      for (int i = 0; i < 600; ++i) {
        auto image = camera.next(delay);
        if (i >= 300) image.camera_ns += std::llround(intervals * 1e8);
        const MappedStamp mapped = clock.add(image.camera_ns, image.noticed);
        if (i >= 30 && (i < 300 || i >= 320)) {
          EXPECT_LT(std::abs(seconds_between(image.taken, mapped.host)), 0.03) << intervals << " intervals, " << i;
        }
      }
      EXPECT_EQ(clock.restarts(), 1) << intervals << " intervals";
    }
  }
}

// The images of a second or three arrive together, at 10 and at 100 Hz.
TEST(CameraClock, ABurstOfLateArrivalsIsNoStepOfTheClock) {
  for (const double period_s : {0.1, 0.01}) {
    for (const double stall_s : {1.0, 3.0}) {
      CameraClock clock;
      std::mt19937_64 random(6);
      for (int i = 0; i < 3000; ++i) {
        const double taken_s = period_s * i, stall_begin_s = 1000 * period_s;
        double noticed_s = taken_s + 0.002 + std::exponential_distribution<double>(1 / 0.0005)(random);
        if (taken_s > stall_begin_s) noticed_s = std::max(noticed_s, stall_begin_s + stall_s + 1e-4 * (i - 1000));
        const MappedStamp mapped = clock.add(std::llround(taken_s * 1e9) + 5, Stamp::from_seconds(1000 + noticed_s));
        if (i > 100) {
          EXPECT_LT(std::abs(seconds_between(Stamp::from_seconds(1000 + taken_s), mapped.host)), 0.005) << i;
        }
      }
      EXPECT_EQ(clock.restarts(), 0);
    }
  }
}

}  // namespace
}  // namespace spartan::internal
