// spartan view: a run in a browser.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>

#include "program/commands.h"
#include "program/interrupt.h"
#include "program/recording_arguments.h"
#include "spartan/system/run_folder.h"
#include "viewer/view_server.h"

namespace spartan::program {
namespace {

using namespace std::chrono_literals;

struct ViewArguments {
  std::string run, recording, address = "127.0.0.1";
  int port = 0;
  bool follow = false;
  RecordingArguments reading;
};

// With --follow the run may not have begun, or have written a part of its files only.
Result<viewer::ViewServer> open_run(const viewer::ViewRequest& request, bool follow, const Context& context) {
  bool told = false;
  for (;;) {
    auto server = viewer::ViewServer::create(request);
    std::error_code error;
    const bool may_begin =
        follow && !server &&
        (server.error().code == ErrorCode::input || server.error().code == ErrorCode::configuration) &&
        !std::filesystem::exists(RunFolder{request.run}.summary(), error);
    if (!may_begin || interrupted()) return server;
    if (!told) context.log.info("waiting for the run to begin");
    told = true;
    std::this_thread::sleep_for(200ms);
  }
}

Result<ExitCode> view_command(const Context& context, const ViewArguments& a) {
  const auto options = open_options(a.reading);
  if (!options) return failure(options);
  auto server = open_run({a.run, a.recording, *options}, a.follow, context);
  if (!server) return interrupted() ? Result<ExitCode>(kInterrupted) : failure(server);
  const auto port = server->bind(a.address, a.port);
  if (!port) return failure(port);
  const std::string host = a.address.find(':') == std::string::npos ? a.address : "[" + a.address + "]";
  if (Status s = print(fmt::format("http://{}:{}/\n", host, *port)); !s) return failure(s);
  std::thread answers([&server] { server->serve(); });
  while (!interrupted()) std::this_thread::sleep_for(50ms);
  server->stop();
  answers.join();
  accept_interrupt();
  return kDone;
}

}  // namespace

void add_view(CLI::App& app, Context& context) {
  auto a = std::make_shared<ViewArguments>();
  CLI::App* command =
      add_command(app, context, "view", "Show a run in a browser: images, disparities, the map in 3D, health and times",
                  "view my_run", [&context, a] { return view_command(context, *a); });
  command->add_option("run", a->run, "Run folder; a run may be going on in it.")->required();
  command->add_flag("--follow", a->follow, "Wait for the run to begin (default: it is an error if there is none).");
  command->add_option("--recording", a->recording,
                      "Recording that was run, for its images (default: as the run states it, or what it records). How "
                      "it is read is by default as the run has read it, and the calibration is that of the run.");
  add_recording_options(*command, a->reading);
  command->add_option("--port", a->port, "Port to listen at (default 0: any that is free; the address is printed).")
      ->check(CLI::Range(0, 65535));
  command->add_option("--address", a->address,
                      "Address or name to listen at (default 127.0.0.1: this computer only). With another one, such as "
                      "0.0.0.0 for all, anybody who reaches it sees the run; the page opens by this name, a numeric "
                      "address, or the host name of this computer, also with .local.");
}

}  // namespace spartan::program
