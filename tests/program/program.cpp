#include "program.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace spartan::testing {
namespace {

struct Pipe {
  Pipe() {
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe can be made");
  }
  std::array<int, 2> ends{};
};

[[noreturn]] void become(const std::vector<std::string>& arguments, const ProgramLimits& limits, const Pipe& out,
                         const Pipe& err) {
  ::dup2(out.ends[1], STDOUT_FILENO);
  ::dup2(err.ends[1], STDERR_FILENO);
  if (limits.largest_file_bytes) {
    const rlimit limit{*limits.largest_file_bytes, *limits.largest_file_bytes};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  std::vector<char*> words;
  words.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  ::execv(words.front(), words.data());
  ::_exit(127);
}

using Clock = std::chrono::steady_clock;

// Reads both pipes to their ends, and sends the signals that are due meanwhile.
void listen(pid_t child, const ProgramLimits& limits, const Pipe& out, const Pipe& err, ProgramResult& result) {
  bool killed = false, interrupted = false;
  const Clock::time_point start = Clock::now();
  std::array<pollfd, 2> inputs{{{out.ends[0], POLLIN, 0}, {err.ends[0], POLLIN, 0}}};
  int open = 2;
  while (open > 0) {
    ::poll(inputs.data(), inputs.size(), 5);
    const auto elapsed = Clock::now() - start;
    if (limits.kill_after && !killed && elapsed >= *limits.kill_after) killed = ::kill(child, SIGKILL) == 0;
    if (limits.interrupt_once_there && !interrupted && ::access(limits.interrupt_once_there->c_str(), F_OK) == 0)
      interrupted = ::kill(child, SIGINT) == 0;
    for (pollfd& input : inputs) {
      if (input.fd < 0 || (input.revents & (POLLIN | POLLHUP)) == 0) continue;
      std::array<char, 4096> buffer{};
      const ssize_t count = ::read(input.fd, buffer.data(), buffer.size());
      if (count > 0) {
        (input.fd == out.ends[0] ? result.out : result.err).append(buffer.data(), static_cast<std::size_t>(count));
      } else {
        input.fd = -1;
        --open;
      }
    }
  }
}

}  // namespace

namespace {

std::string program_path() {
  const char* const program = std::getenv("SPARTAN_PROGRAM");
  if (program == nullptr) throw std::runtime_error("SPARTAN_PROGRAM is not set; run through ctest");
  return program;
}

ProgramResult run_words(const std::vector<std::string>& words, const ProgramLimits& limits) {
  const Pipe out, err;
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process can be made");
  if (child == 0) become(words, limits, out, err);
  ::close(out.ends[1]);
  ::close(err.ends[1]);
  ProgramResult result;
  listen(child, limits, out, err, result);
  ::close(out.ends[0]);
  ::close(err.ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  return result;
}

}  // namespace

ProgramResult run_program(const std::vector<std::string>& arguments, const ProgramLimits& limits) {
  std::vector<std::string> words{program_path()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run_words(words, limits);
}

ProgramResult run_in_shell(const std::string& script, const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"/bin/sh", "-c", script, program_path()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run_words(words, {});
}

std::string small_runs_folder() {
  return (std::filesystem::path(program_path()).parent_path().parent_path() / "tests" / "small_runs").string();
}

}  // namespace spartan::testing
