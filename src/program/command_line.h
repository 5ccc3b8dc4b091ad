// Words of the command line that CLI11 does not know: misspelt commands, `spartan help run`, groups without a command.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace spartan::program {

/// An empty argument, e.g. of a shell variable that is not set, would count as an option that is not given, or name the
/// root folder.
void refuse_empty_arguments(CLI::App& app);

/// The error text for the first word that is neither a command, e.g. `spartan map foo`, nor an option in front of one,
/// e.g. `spartan --foo run`; empty where there is none.
std::string unknown_word(const CLI::App& app, const std::vector<std::string>& words);

/// "spartan rig inspect": the command that was parsed, as far as it was.
std::string command_of(const CLI::App& app);

/// Whether no command of the program or of a group was named, as in `spartan` and `spartan map`.
bool lacks_command(const CLI::App& app);

/// The words after the program's name; `help rig inspect` becomes `rig inspect --help`.
std::vector<std::string> words_of(int argc, char** argv);

/// The command line as a shell takes it.
std::string command_line(int argc, char** argv);

}  // namespace spartan::program
