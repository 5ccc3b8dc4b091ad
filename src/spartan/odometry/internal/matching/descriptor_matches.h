// Features of two images with the most similar descriptors.
#pragma once

#include <vector>

#include "spartan/core/threads.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"

namespace spartan::internal {

/// Indices of two features.
struct DescriptorMatch {
  int first = 0, second = 0;
};

/// Features of the same sign that are each other's nearest by descriptor distance, where the distance from the first is
/// less than `ratio` times that to the second nearest (Lowe, IJCV 60, 2004, §7.1). In the order of `first`; identical
/// for any number of threads.
std::vector<DescriptorMatch> mutual_matches(const std::vector<Feature>& first, const std::vector<Feature>& second,
                                            double ratio, const ThreadPool& workers);

}  // namespace spartan::internal
