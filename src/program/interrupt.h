// Signals: Ctrl-C stops a command after its current step.
#pragma once

#include "spartan/core/result.h"

namespace spartan::program {

/// Makes SIGINT and SIGTERM set a flag; a second signal ends the program at once.
void listen_for_interrupts();
/// Whether the user interrupted the program. Long loops check it between steps and return an error of code
/// `interrupted`.
bool interrupted();
/// The same as an error, for steps that follow each other.
Status expect_not_interrupted();
/// For a command that users end by an interrupt: from now on it counts as not interrupted.
void accept_interrupt();

/// Ignores SIGPIPE and SIGXFSZ: a closed pipe and the limit of the file size (ulimit -f) are errors of the write.
void ignore_write_signals();
/// Opens the standard streams that are closed, so that no file that the program opens takes their place. Reading from
/// and writing to them fails.
void reserve_standard_streams();

}  // namespace spartan::program
