#include <algorithm>

#include "spartan/camera/sample_stream.h"

namespace spartan {

ExposureBounds limit(const ExposureBounds& wanted, const ExposureBounds& possible) {
  const auto time = [&](double us) { return std::clamp(us, possible.shortest_us, possible.longest_us); };
  const auto gain = [&](double factor) { return std::clamp(factor, possible.smallest_gain, possible.largest_gain); };
  return {time(wanted.shortest_us), time(wanted.longest_us), gain(wanted.smallest_gain), gain(wanted.largest_gain)};
}

}  // namespace spartan
