// Makes once what many tests of the program begin with, a small recording and its finished run:
// make_small_runs OUT drive|stops.
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "program.h"
#include "small_drive.h"
#include "small_scenario.h"

namespace spartan::testing {
namespace {

namespace fs = std::filesystem;

void must_finish(const std::vector<std::string>& arguments) {
  const ProgramResult result = run_program(arguments);
  if (result.exit_code != 0 && result.exit_code != 6) throw std::runtime_error(result.err);
}

void make_drive(const std::string& out) {
  fs::remove_all(out + "/drive");
  fs::remove_all(out + "/drive_run");
  write_small_drive(out + "/drive");
  std::vector<std::string> run{"run", out + "/drive", "-o", out + "/drive_run", "--threads", "2"};
  run.insert(run.end(), kSmallDriveOptions.begin(), kSmallDriveOptions.end());
  must_finish(run);
}

void make_stops(const std::string& out) {
  fs::remove_all(out + "/stops");
  fs::create_directories(out + "/stops");
  std::ofstream(out + "/stops/small_rig.yaml") << kSmallRig;
  std::string scenario = kSmallScenario;
  scenario.replace(scenario.find("[0]"), 3, "[0, 0.2]");
  std::ofstream(out + "/stops/small.yaml") << scenario;
  const ProgramResult made = run_program({"simulate", out + "/stops/small.yaml", "-o", out + "/stops/rec"});
  if (made.err.find("no simulator") != std::string::npos) return;  // built without Embree: the tests are skipped
  if (made.exit_code != 0) throw std::runtime_error(made.err);
  must_finish({"run", out + "/stops/rec", "-o", out + "/stops/whole", "--threads", "2"});
}

}  // namespace
}  // namespace spartan::testing

int main(int argc, char** argv) {
  const std::string part = argc == 3 ? argv[2] : "";
  if (part != "drive" && part != "stops") return 2;
  try {
    part == "drive" ? spartan::testing::make_drive(argv[1]) : spartan::testing::make_stops(argv[1]);
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 1;
  }
  return 0;
}
