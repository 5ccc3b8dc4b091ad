// The first call of a matcher in a new process, which includes what the system takes to hand out memory: that differs
// by a factor of two from process to process, so the matchers take turns and medians are compared.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "spartan/numerics/median.h"
#include "stereo_speed.h"

namespace spartan {

inline constexpr const char* kFirstCall = "--first-call";

/// Prints the milliseconds of one call. `matcher`: "1" or "2" threads of Spartan, or "SGBM" (padded).
inline void print_first_call(const SpeedPair& pair, const std::string& matcher, int disparities) {
  const double ms = milliseconds([&] {
    if (matcher == "SGBM") {
      opencv_disparity(pair.left, pair.right, disparities, {matcher, cv::StereoSGBM::MODE_SGBM});
      return;
    }
    auto computer = must(DisparityComputer::create({}, ThreadPool(std::stoi(matcher))));
    must(computer.compute(pair.left, pair.right, {0, disparities - 1}));
  });
  fmt::print("{}\n", ms);
}

/// Runs this program `rounds` times for each matcher, in turn.
inline void compare_first_calls(const std::string& recordings, int disparities, int rounds) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::vector<std::string> matchers{"1", "2", "SGBM"};
  std::map<std::string, std::vector<double>> times;
  for (int round = 0; round < rounds; ++round) {
    for (const std::string& matcher : matchers) {
      const std::string command =
          fmt::format("'{}' {} {} {} --from '{}'", program, kFirstCall, matcher, disparities, recordings);
      const std::unique_ptr<FILE, int (*)(FILE*)> output(popen(command.c_str(), "r"), pclose);
      double ms = 0;
      if (output == nullptr || std::fscanf(output.get(), "%lf", &ms) != 1) {
        fmt::print("\nno first calls: {} failed\n", command);
        return;
      }
      times[matcher].push_back(ms);
    }
  }
  fmt::print("\nFirst calls of {} processes, {} disparities\n{:<26} {:>8} {:>8} {:>8} {:>12}\n", rounds, disparities,
             "", "least ms", "median", "largest", "SGBM's share");
  const double rival = median(times["SGBM"]);
  for (const std::string& matcher : matchers) {
    const auto [least, largest] = std::minmax_element(times[matcher].begin(), times[matcher].end());
    const std::string name = matcher == "SGBM" ? "SGBM, padded" : "Spartan, threads: " + matcher;
    fmt::print("{:<26} {:8.1f} {:8.1f} {:8.1f} {:>12}\n", name, *least, median(times[matcher]), *largest,
               fmt::format("1/{:.1f}", rival / median(times[matcher])));
  }
}

}  // namespace spartan
