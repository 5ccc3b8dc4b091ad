// Files of config/ that the program carries inside itself: scenarios and rigs.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace spartan::program {

struct ShippedFile {
  std::string_view path;  ///< below config/, as "scenarios/quick.yaml"
  std::string_view content;
};

/// All of them, by path.
std::span<const ShippedFile> shipped_files();
std::optional<std::string_view> shipped_file(std::string_view path);

}  // namespace spartan::program
