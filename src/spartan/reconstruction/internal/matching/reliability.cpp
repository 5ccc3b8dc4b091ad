#include "spartan/reconstruction/internal/matching/reliability.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace spartan::internal::matching {
namespace {

// Logistic regression of |error| > 1 px:
//   ln(p / (1 − p)) = kOffset + kDistance log₂(1 + right distance) + kInformation log₂(information)
constexpr float kOffset = 4.586F, kDistance = 0.571F, kInformation = -0.882F;
// σ² = kScale² / information + kFloor². Neighbouring fits share pixels, which the information does not know.
constexpr float kScale = 4.5F, kFloor = 0.04F;

constexpr int kMostDistance = 16;
constexpr float kLogitStep = 0.125F;
constexpr int kLogits = 129;  // −8 … 8

struct Tables {
  std::array<float, kMostDistance + 1> of_distance{};
  std::array<std::uint8_t, kLogits> percent{};
  Tables() {
    for (int i = 0; i <= kMostDistance; ++i)
      of_distance[static_cast<std::size_t>(i)] = kOffset + kDistance * std::log2(1 + static_cast<float>(i));
    for (int i = 0; i < kLogits; ++i) {
      const double logit = kLogitStep * static_cast<float>(i - kLogits / 2);
      percent[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::lround(100 / (1 + std::exp(-logit))));
    }
  }
};

const Tables& tables() {
  static const Tables instance;
  return instance;
}

// log₂, linear between powers of two: within 0.09.
float about_log2(float value) {
  return static_cast<float>(std::bit_cast<std::int32_t>(value) - 0x3F800000) * (1.0F / (1 << 23));
}

}  // namespace

std::uint8_t outlier_percent(float information, int right_distance) {
  const Tables& t = tables();
  const float logit = t.of_distance[static_cast<std::size_t>(std::min(right_distance, kMostDistance))] +
                      kInformation * about_log2(information);
  const int index = static_cast<int>(std::lrintf(logit * (1 / kLogitStep))) + kLogits / 2;
  return t.percent[static_cast<std::size_t>(std::clamp(index, 0, kLogits - 1))];
}

float disparity_sigma(float information) {
  return std::sqrt(kScale * kScale / information + kFloor * kFloor);
}

void assess(const Evidence& evidence, const ThreadPool& workers, const Assessed& to) {
  workers.parallel_for(0, to.disparity.height(), 32, [&](int from, int end) {
    for (int y = from; y < end; ++y) {
      for (int x = 0; x < to.disparity.width(); ++x) {
        const float information = evidence.information(x, y);
        const std::uint8_t percent = outlier_percent(information, evidence.right_distance(x, y));
        to.outlier_percent(x, y) = percent;
        to.sigma(x, y) = disparity_sigma(information);
        if (percent > evidence.most_percent) to.disparity(x, y) = std::numeric_limits<float>::quiet_NaN();
      }
    }
  });
}

void clear_unknown(const ThreadPool& workers, const Assessed& to) {
  workers.parallel_for(0, to.disparity.height(), 32, [&](int from, int end) {
    for (int y = from; y < end; ++y) {
      for (int x = 0; x < to.disparity.width(); ++x) {
        if (!std::isnan(to.disparity(x, y))) continue;
        to.sigma(x, y) = std::numeric_limits<float>::quiet_NaN();
        to.outlier_percent(x, y) = 100;
      }
    }
  });
}

}  // namespace spartan::internal::matching
