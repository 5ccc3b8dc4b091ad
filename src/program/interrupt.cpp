#include "program/interrupt.h"

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

}  // namespace spartan::program
