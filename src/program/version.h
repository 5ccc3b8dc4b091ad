// What the program was built from.
#pragma once

#include <string>

namespace spartan::program {

/// Version, commit, compiler, and the versions of the libraries, as `spartan --version` prints them.
std::string version_text();

}  // namespace spartan::program
