#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/strict_yaml.h"

namespace spartan {
namespace {

// Optimal string alignment distance: insertions, deletions, substitutions, exchanges of neighbours.
std::size_t distance(std::string_view a, std::string_view b) {
  // d[i][k]: of the first i letters of a and the first k letters of b.
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t k = 0; k <= b.size(); ++k) d[0][k] = k;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t k = 1; k <= b.size(); ++k) {
      const std::size_t replaced = a[i - 1] == b[k - 1] ? 0 : 1;
      d[i][k] = std::min({d[i - 1][k] + 1, d[i][k - 1] + 1, d[i - 1][k - 1] + replaced});
      const bool exchanged = i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1];
      if (exchanged) d[i][k] = std::min(d[i][k], d[i - 2][k - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string closest_name(std::string_view word, const std::vector<std::string>& names) {
  std::string closest;
  std::size_t least = word.size() / 3 + 1;
  for (const std::string& name : names) {
    if (const std::size_t d = distance(word, name); d < least) {
      least = d;
      closest = name;
    }
  }
  return closest;
}

}  // namespace spartan
