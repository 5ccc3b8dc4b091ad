// Ctrl-C stops a command after its current step.
#pragma once

namespace spartan::program {

/// Makes SIGINT and SIGTERM set a flag; a second signal ends the program at once.
void listen_for_interrupts();
/// Whether the user interrupted the program. Long loops check it between steps and return an error of code
/// `interrupted`.
bool interrupted();

}  // namespace spartan::program
