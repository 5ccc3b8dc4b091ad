// Folders with calibrations: detection of calibration files, of pairs of files, and reading.
// The input contains the files, each after a line "=== NAME".
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "survives_writing.h"

namespace {

using spartan::testing::check_survives_writing;

constexpr spartan::ImageSize kSize{640, 480};
constexpr std::size_t kMaxFiles = 6;

// Relative names without "..", with at most two folders.
bool is_safe(std::string_view name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' ||
           c == '.' || c == ',' || c == '/';
  };
  if (name.empty() || name.size() > 60 || name.find("..") != std::string_view::npos) return false;
  if (name.front() == '/' || name.back() == '/' || name.find("//") != std::string_view::npos) return false;
  return std::all_of(name.begin(), name.end(), allowed) && std::count(name.begin(), name.end(), '/') <= 2 &&
         name.find("./") == std::string_view::npos && name != ".";
}

// Writes the files and returns their paths.
std::vector<std::string> unpack(const spartan::testing::TemporaryFolder& folder, std::string_view text) {
  constexpr std::string_view kHead = "=== ";
  std::vector<std::string> paths;
  while (text.starts_with(kHead) && paths.size() < kMaxFiles) {
    const std::size_t line = text.find('\n');
    if (line == std::string_view::npos) break;
    const std::string name(text.substr(kHead.size(), line - kHead.size()));
    text.remove_prefix(line + 1);
    const std::size_t next = text.find("\n=== ");
    // A name of an existing folder is skipped.
    std::error_code error;
    if (!is_safe(name) || std::filesystem::exists(folder.path() + "/" + name, error)) break;
    std::filesystem::create_directories(std::filesystem::path(folder.path() + "/" + name).parent_path(), error);
    if (error) break;
    paths.push_back(folder.write(name, text.substr(0, next)));
    text = next == std::string_view::npos ? std::string_view() : text.substr(next + 1);
  }
  return paths;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const spartan::testing::TemporaryFolder folder;
  const auto paths = unpack(folder, {reinterpret_cast<const char*>(data), size});
  check_survives_writing(spartan::read_calibration(folder.path(), kSize));
  for (const std::string& path : paths) check_survives_writing(spartan::read_calibration(path, kSize));
  if (paths.size() > 1) check_survives_writing(spartan::read_calibration(paths[0] + "," + paths[1]));
  return 0;
}
