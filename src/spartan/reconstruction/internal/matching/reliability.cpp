#include "spartan/reconstruction/internal/matching/reliability.h"

#include <cmath>
#include <limits>

namespace spartan::internal::matching {

void assess(const Evidence& evidence, const RefinementKernels& kernels, const ThreadPool& workers, const Assessed& to) {
  workers.parallel_for(0, to.disparity.height(), 32, [&](int from, int end) {
    for (int y = from; y < end; ++y) {
      kernels.reliability_row({evidence.information.row(y), evidence.relief.row(y), evidence.right_distance.row(y),
                               to.disparity.row(y), to.sigma.row(y), to.outlier_percent.row(y), to.reliable.row(y),
                               to.disparity.width(), static_cast<float>(evidence.most_percent), kReliability});
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
