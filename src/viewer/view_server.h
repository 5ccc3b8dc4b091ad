// The page that shows a run in a browser, served on this computer: images, disparities, the map in 3D, health and
// times.
#pragma once

#include <memory>
#include <string>

#include "spartan/camera/recording.h"
#include "spartan/core/result.h"

namespace spartan::viewer {

/// What is shown.
struct ViewRequest {
  std::string run;        ///< run folder; a run may be going on in it
  std::string recording;  ///< the recording that was run, for images; empty: as the run states it, or none
  OpenOptions open;       ///< how to read the recording
};

/// Serves the page and the data that it asks for, by HTTP. The page loads nothing from other computers, and answers are
/// for requests to a name of this computer only, so that no other page in the browser can read them.
class ViewServer {
 public:
  /// Codes: `input` (not a run), `store_damaged`, `configuration`.
  static Result<ViewServer> create(const ViewRequest& request);
  ViewServer(ViewServer&&) noexcept;
  ViewServer& operator=(ViewServer&&) noexcept;
  ~ViewServer();

  /// Binds to a port of `address`; 0: any that is free. Returns the port. Codes: `output` (the port is in use), `usage`
  /// (not an address of this computer).
  Result<int> bind(const std::string& address, int port);
  /// Answers until stop(), which another thread calls, once.
  void serve();
  void stop();

 private:
  struct State;
  explicit ViewServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan::viewer
