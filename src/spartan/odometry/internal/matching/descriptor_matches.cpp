#include "spartan/odometry/internal/matching/descriptor_matches.h"

#include <algorithm>
#include <limits>

namespace spartan::internal {
namespace {

// Nearest of `others` by descriptor distance, with the distance of the second nearest; both are squared.
struct Nearest {
  int index = -1;
  double distance = std::numeric_limits<double>::infinity();
  double second = std::numeric_limits<double>::infinity();
};

std::vector<Nearest> nearest_of(const std::vector<Feature>& features, const std::vector<Feature>& others,
                                const ThreadPool& workers) {
  std::vector<Nearest> result(features.size());
  workers.parallel_for(0, static_cast<int>(features.size()), 64, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const Feature& feature = features[static_cast<std::size_t>(i)];
      Nearest& best = result[static_cast<std::size_t>(i)];
      for (std::size_t k = 0; k < others.size(); ++k) {
        if (others[k].sign != feature.sign) continue;
        const double distance = squared_distance(feature.descriptor, others[k].descriptor);
        if (distance < best.distance) {
          best.second = best.distance;
          best.distance = distance;
          best.index = static_cast<int>(k);
        } else {
          best.second = std::min(best.second, distance);
        }
      }
    }
  });
  return result;
}

}  // namespace

std::vector<DescriptorMatch> mutual_matches(const std::vector<Feature>& first, const std::vector<Feature>& second,
                                            double ratio, const ThreadPool& workers) {
  const std::vector<Nearest> from_first = nearest_of(first, second, workers);
  const std::vector<Nearest> from_second = nearest_of(second, first, workers);
  std::vector<DescriptorMatch> matches;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Nearest& best = from_first[i];
    if (best.index < 0 || !(best.distance < ratio * ratio * best.second)) continue;
    if (from_second[static_cast<std::size_t>(best.index)].index != static_cast<int>(i)) continue;
    matches.push_back({static_cast<int>(i), best.index});
  }
  return matches;
}

}  // namespace spartan::internal
