// Tells a service manager how a run goes (sd_notify(3)).
#pragma once

#include <chrono>
#include <string>

namespace spartan::program {

/// Sends datagrams to the socket that NOTIFY_SOCKET names; without it, nothing. A message that cannot be sent is lost.
class ServiceNotifier {
 public:
  ServiceNotifier();
  ~ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  /// After each frame: ready with the first one.
  void frame(const std::string& status);
  /// From the loop of the run, also where no frame comes, as during a panorama. Tells twice a second that the run is
  /// alive, and the status of the last frame.
  void alive();
  void stopping();

 private:
  void send(const std::string& text) const;

  std::string address_;
  int socket_ = -1;
  std::string status_;  // of the last frame
  std::chrono::steady_clock::time_point sent_;
};

}  // namespace spartan::program
