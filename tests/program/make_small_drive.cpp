// Renders the small drive once for all tests of the program: make_small_drive OUT.
#include <exception>
#include <filesystem>
#include <iostream>

#include "small_drive.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    std::filesystem::remove_all(argv[1]);
    spartan::testing::write_small_drive(argv[1]);
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 1;
  }
  return 0;
}
