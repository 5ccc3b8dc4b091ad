// Shell completion and the man page, generated from the definition of the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace spartan::program {

/// A completion script for `shell` (bash, zsh or fish): commands, options, and files elsewhere.
std::string completion_script(const CLI::App& app, const std::string& shell);

/// The man page spartan(1) in roff.
std::string man_page(const CLI::App& app, const std::string& version);

}  // namespace spartan::program
