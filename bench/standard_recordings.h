// Command-line arguments of the benchmarks on the standard recordings.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <string>
#include <vector>

namespace spartan {

struct RecordingArguments {
  std::string folder;
  std::vector<std::string> scenarios;
  std::map<std::string, std::string> options;  // "--pairs" → "10"

  int number(const std::string& option) const { return std::stoi(options.at(option)); }
};

/// `defaults`: every option with its default; each option takes one value. "--from" is always an option.
inline RecordingArguments read_arguments(const std::vector<std::string>& words,
                                         const std::map<std::string, std::string>& defaults) {
  const char* const home = std::getenv("HOME");
  RecordingArguments arguments{std::string(home != nullptr ? home : "") + "/.cache/spartan/recordings", {}, defaults};
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--from" && i + 1 < words.size()) {
      arguments.folder = words[++i];
    } else if (defaults.contains(words[i]) && i + 1 < words.size()) {
      arguments.options[words[i]] = words[i + 1];
      ++i;
    } else {
      arguments.scenarios.push_back(words[i]);
    }
  }
  return arguments;
}

/// Runs a benchmark and returns the exit code of main(); prints exceptions and returns 1.
inline int run_benchmark(int argc, char** argv, void (*run)(const std::vector<std::string>& words)) {
  try {
    run({argv + 1, argv + argc});
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", argv[0], e.what());
    return 1;
  }
}

}  // namespace spartan
