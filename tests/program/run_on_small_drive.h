// Test fixture: `spartan run` on a copy of the small drive.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "program.h"
#include "run_results.h"
#include "small_drive.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan::testing {

inline nlohmann::json summary_of(const std::string& run) {
  std::ifstream file(run + "/summary.json");
  return nlohmann::json::parse(file);
}

/// Leaves only a share of a file.
inline void cut(const std::string& path, double share) {
  namespace fs = std::filesystem;
  fs::resize_file(path, static_cast<std::uintmax_t>(share * static_cast<double>(fs::file_size(path))));
}

/// Each test works on its own copy of the drive.
class RunOnSmallDrive : public ::testing::Test {
 protected:
  RunOnSmallDrive() { copy_drive(); }
  /// What was changed in the copy is as it was.
  void copy_drive() const {
    namespace fs = std::filesystem;
    fs::copy(small_runs_folder() + "/drive", drive(),
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  }

  std::string drive() const { return folder_.path() + "/drive"; }
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  std::string image(int side, int i) const { return fmt::format("{}/image_{}/{:06}.png", drive(), side, i); }
  void remove_pair(int i) const {
    std::filesystem::remove(image(0, i));
    std::filesystem::remove(image(1, i));
  }
  ProgramResult run(const std::string& output, std::vector<std::string> more = {},
                    const ProgramLimits& limits = {}) const {
    std::vector<std::string> words{"run", drive(), "-o", path(output)};
    words.insert(words.end(), kSmallDriveOptions.begin(), kSmallDriveOptions.end());
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words, limits);
  }
  /// As after run(output) on the unchanged drive, with two threads.
  void copy_finished_run(const std::string& output) const {
    std::filesystem::copy(small_runs_folder() + "/drive_run", path(output), std::filesystem::copy_options::recursive);
  }

  TemporaryFolder folder_;
};

}  // namespace spartan::testing
