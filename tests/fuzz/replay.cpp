// Runs a fuzz target on its seeds and on COUNT pseudo-random mutations of them: `replay_NAME SEED_FOLDER COUNT`.
// The inputs are the same in every run. A crash or an uncaught exception fails the test.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/files.h"
#include "spartan/numerics/random.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using spartan::Random;

std::vector<std::string> read_seeds(const std::string& folder) {
  std::vector<std::string> paths, seeds;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path().string());
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) seeds.push_back(spartan::read_file(path).value());
  return seeds;
}

std::size_t random_position(const std::string& text, Random& random) {
  return random.below(static_cast<std::uint32_t>(text.size() + 1));
}

// Applies one random mutation: a flipped bit, a random byte, truncation, a deleted, duplicated or spliced part, or a
// special token.
void mutate(std::string& text, const std::vector<std::string>& seeds, Random& random) {
  static constexpr std::array<std::string_view, 16> kTokens{
      "nan", "inf", "-1", "0",  "1e999", "99999999999999999999", "-9223372036854775808", "\n", ",", ":", "[",
      "{}",  "&a",  "*a", "\t", " "};
  const std::size_t at = random_position(text, random);
  const std::size_t length = std::min<std::size_t>(1 + random.below(1U << random.below(8)), text.size() - at);
  switch (random.below(7)) {
    case 0:
      if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << random.below(8)));
      break;
    case 1:
      if (at < text.size()) text[at] = static_cast<char>(random.below(256));
      break;
    case 2:
      text.resize(at);
      break;
    case 3:
      text.erase(at, length);
      break;
    case 4:
      text.insert(random_position(text, random), text.substr(at, length));
      break;
    case 5: {
      const std::string& other = seeds[random.below(static_cast<std::uint32_t>(seeds.size()))];
      text = text.substr(0, at) + other.substr(random_position(other, random));
      break;
    }
    default:
      text.replace(at, std::min<std::size_t>(length, random.below(4)), kTokens[random.below(kTokens.size())]);
  }
}

void run(const std::string& input) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("usage: replay_NAME SEED_FOLDER COUNT [FILE that receives each input before it is run]\n", stderr);
    return 2;
  }
  const std::vector<std::string> seeds = read_seeds(argv[1]);
  if (seeds.empty()) {
    std::fprintf(stderr, "no seeds in %s\n", argv[1]);
    return 2;
  }
  int runs = 0;
  try {
    for (const std::string& seed : seeds) run(seed);
    run("");
    Random random(1);
    for (const int count = std::stoi(argv[2]); runs < count; ++runs) {
      std::string input = seeds[random.below(static_cast<std::uint32_t>(seeds.size()))];
      for (std::uint32_t changes = 1 + random.below(4); changes > 0; --changes) mutate(input, seeds, random);
      if (argc > 3 && !spartan::write_file_atomically(argv[3], input)) return 2;
      run(input);
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "mutation %d: uncaught: %s\n", runs, e.what());
    return 1;
  }
  std::printf("%zu seeds and %d mutations: no errors\n", seeds.size(), runs);
  return 0;
}
