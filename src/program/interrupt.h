// Ctrl-C: stop after the step at hand.
#pragma once

namespace spartan::program {

/// From now on SIGINT and SIGTERM only set a mark; a second one ends the program at once.
void listen_for_interrupts();
/// Whether the user asked to stop. Long loops ask between steps and return an error of code `interrupted`.
bool interrupted();

}  // namespace spartan::program
