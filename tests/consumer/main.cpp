// What somebody else writes to use Spartan with images of their own.
#include <cstdio>

#include "spartan/core/image.h"
#include "spartan/core/trajectory.h"

int main() {
  const spartan::Image<std::uint8_t> image(64, 48);
  spartan::Trajectory drive;
  for (const int second : {0, 1, 2}) drive.push_back({.stamp = {second * 1'000'000'000LL}, .pose = {}});
  const auto read_back = spartan::parse_tum(spartan::to_tum(drive), "memory");
  std::printf("%d x %d pixels, %zu poses\n", image.width(), image.height(), read_back ? read_back->size() : 0);
  return read_back && read_back->size() == drive.size() ? 0 : 1;
}
