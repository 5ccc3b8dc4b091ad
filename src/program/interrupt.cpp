#include "program/interrupt.h"

#include <fcntl.h>
#include <unistd.h>

#include <csignal>

namespace spartan::program {
namespace {

// A signal handler can only reach a variable of static storage.
volatile std::sig_atomic_t stop_requested = 0;

extern "C" void on_signal(int signal) {
  stop_requested = 1;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void listen_for_interrupts() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

bool interrupted() {
  return stop_requested != 0;
}

void accept_interrupt() {
  stop_requested = 0;
}

Status expect_not_interrupted() {
  if (interrupted()) return failure(ErrorCode::interrupted, "interrupted by the user");
  return {};
}

void ignore_write_signals() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

void reserve_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1) continue;
    // open() takes the lowest free number. The wrong direction makes each use fail with EBADF, as if it were closed.
    static_cast<void>(::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

}  // namespace spartan::program
