#include "program/interrupt.h"

#include <csignal>

namespace spartan::program {
namespace {

// A signal handler can reach nothing but a variable of the file.
volatile std::sig_atomic_t asked_to_stop = 0;

extern "C" void remember(int signal) {
  asked_to_stop = 1;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void listen_for_interrupts() {
  std::signal(SIGINT, remember);
  std::signal(SIGTERM, remember);
}

bool interrupted() {
  return asked_to_stop != 0;
}

}  // namespace spartan::program
