#include "program/service_notifier.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>

namespace spartan::program {
namespace {

constexpr std::chrono::milliseconds kSendEvery{500};

}  // namespace

ServiceNotifier::ServiceNotifier() {
  const char* const address = std::getenv("NOTIFY_SOCKET");
  if (address == nullptr || (address[0] != '/' && address[0] != '@')) return;
  address_ = address;
  if (address_.size() >= sizeof(sockaddr_un::sun_path)) return;
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
}

ServiceNotifier::~ServiceNotifier() {
  if (socket_ >= 0) ::close(socket_);
}

void ServiceNotifier::send(const std::string& text) const {
  if (socket_ < 0) return;
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::copy(address_.begin(), address_.end(), to.sun_path);
  if (address_[0] == '@') to.sun_path[0] = '\0';  // an abstract socket
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  static_cast<void>(
      ::sendto(socket_, text.data(), text.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to), length));
}

void ServiceNotifier::frame(const std::string& status) {
  if (status_.empty()) send("READY=1\nSTATUS=" + status);
  status_ = status;
}

void ServiceNotifier::alive() {
  const auto now = std::chrono::steady_clock::now();
  if (now - sent_ < kSendEvery) return;
  send(status_.empty() ? "WATCHDOG=1" : "WATCHDOG=1\nSTATUS=" + status_);
  sent_ = now;
}

void ServiceNotifier::stopping() {
  if (!status_.empty()) send("STOPPING=1\n");
}

}  // namespace spartan::program
