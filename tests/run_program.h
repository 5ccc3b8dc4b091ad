// Runs the program as a user does.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "spartan/testing/temporary_folder.h"

namespace spartan::testing {

struct ProgramResult {
  int exit_code = -1;
  std::string out, err;
};

/// `spartan ARGUMENTS…`; the program is named by SPARTAN_PROGRAM (set by CTest). `prefix` goes before it, as
/// "env LC_ALL=C" does. Arguments are quoted for the shell.
inline ProgramResult run_program(const std::vector<std::string>& arguments, const std::string& prefix = {}) {
  const char* const program = std::getenv("SPARTAN_PROGRAM");
  if (program == nullptr) throw std::runtime_error("SPARTAN_PROGRAM is not set");
  const auto quoted = [](const std::string& word) {
    std::string result = "'";
    for (const char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return result + "'";
  };
  const TemporaryFolder folder;
  std::string command = prefix + " " + quoted(program);
  for (const std::string& argument : arguments) command += " " + quoted(argument);
  command += " >" + quoted(folder.file("out")) + " 2>" + quoted(folder.file("err")) + " </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder.file("out")), content_of(folder.file("err"))};
}

}  // namespace spartan::testing
