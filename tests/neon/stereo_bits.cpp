// Prints a hash of the results of stereo matching on made pairs: the same on every processor and instruction set.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>

#include "spartan/core/threads.h"
#include "spartan/numerics/random.h"
#include "spartan/reconstruction/disparity_computer.h"

namespace {

using namespace spartan;

// A textured slope with a step, and noise of both images.
struct MadePair {
  Image<std::uint8_t> left, right;
};
MadePair make_pair(ImageSize size, std::uint64_t seed) {
  Random random(seed);
  const int wide = size.width + 80;
  Image<std::uint8_t> texture(wide, size.height);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < wide; ++x) texture(x, y) = static_cast<std::uint8_t>(40 + random.below(160));
  }
  MadePair pair{Image<std::uint8_t>(size), Image<std::uint8_t>(size)};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const int disparity = 4 + y / 6 + (x > size.width / 2 && y > size.height / 3 ? 9 : 0);
      pair.left(x, y) = static_cast<std::uint8_t>(texture(x, y) + random.below(5));
      pair.right(x, y) = static_cast<std::uint8_t>(texture(x + disparity, y) + random.below(5));
    }
  }
  return pair;
}

template <class T>
void mix(ImageView<const T> image, std::uint64_t& hash) {
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const T value = image(x, y);
      if (value != value) {  // NaN has many bit patterns
        hash = (hash ^ 0x5AU) * 0x100000001B3U;
        continue;
      }
      unsigned char bytes[sizeof(T)];
      std::memcpy(bytes, &value, sizeof(T));
      for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001B3U;
    }
  }
}

void print_bits() {
  for (const ImageSize size : {ImageSize{320, 240}, {151, 97}, {640, 333}}) {
    const MadePair pair = make_pair(size, 7);
    for (const MatchingMethod method : {MatchingMethod::sgm, MatchingMethod::block}) {
      DisparityOptions options;
      options.method = method;
      DisparityComputer computer = DisparityComputer::create(options, ThreadPool(1)).value();
      const auto result = computer.compute(pair.left, pair.right, {0, 79}).value();
      std::uint64_t hash = 0xCBF29CE484222325U;
      mix(result.disparity, hash);
      mix(result.sigma, hash);
      mix(result.outlier_percent, hash);
      std::printf("%dx%d %016llx\n", size.width, size.height, static_cast<unsigned long long>(hash));
    }
  }
}

}  // namespace

int main() {
  try {
    print_bits();
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
