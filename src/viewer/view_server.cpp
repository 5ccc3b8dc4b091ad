#include "viewer/view_server.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <httplib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "spartan/figures/scene_files.h"
#include "viewer/page_files.h"
#include "viewer/run_view.h"

namespace spartan::viewer {

namespace {

constexpr const char* kJson = "application/json";

std::string in_lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_loopback(const std::string& address) {
  return address == "127.0.0.1" || address == "localhost" || address == "::1";
}

// The hosts by which the page may be asked for at an address. Beside them, at another address than the loopback's, all
// numeric ones.
std::vector<std::string> hosts_of(const std::string& address) {
  std::vector<std::string> hosts{"localhost", "127.0.0.1", "[::1]"};
  if (is_loopback(address)) return hosts;
  hosts.push_back(in_lower_case(address));
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return hosts;
  const std::string own = in_lower_case(name.data()), label = own.substr(0, own.find('.'));
  for (const std::string& host : {own, label, label + ".local"}) {
    if (std::find(hosts.begin(), hosts.end(), host) == hosts.end()) hosts.push_back(host);
  }
  return hosts;
}

// A page of another site may have a name that leads here (DNS rebinding): it is not answered.
bool names_this_computer(const httplib::Request& request, const std::string& address,
                         const std::vector<std::string>& hosts) {
  std::string host = in_lower_case(request.get_header_value("Host"));
  const std::size_t port = host.rfind(':');
  if (port != std::string::npos && host.find(']', port) == std::string::npos) host.resize(port);
  if (std::find(hosts.begin(), hosts.end(), host) != hosts.end()) return true;
  // Of another address also numbers: rebinding needs a name.
  return !is_loopback(address) && (host.starts_with('[') || host.find_first_not_of("0123456789.") == std::string::npos);
}

void answer(const Result<std::string>& content, const char* type, httplib::Response& response) {
  if (content) {
    response.status = content->empty() ? 204 : 200;
    return response.set_content(*content, type);
  }
  response.status = content.error().code == ErrorCode::input ? 404 : 500;
  response.set_content(content.error().message(), "text/plain; charset=utf-8");
}

std::optional<std::size_t> number_in(const httplib::Request& request, const char* name) {
  const std::string text = request.get_param_value(name);
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// Answers with what `member` gives for the number in the query.
auto numbered(RunView& view, Result<std::string> (RunView::*member)(std::size_t), const char* name, const char* type) {
  return [&view, member, name, type](const httplib::Request& request, httplib::Response& response) {
    const auto number = number_in(request, name);
    if (number) return answer((view.*member)(*number), type, response);
    response.status = 400;
    response.set_content(fmt::format("{}: must be a number", name), "text/plain; charset=utf-8");
  };
}

}  // namespace

struct ViewServer::State {
  std::unique_ptr<RunView> view;
  httplib::Server server;
  std::string address;
  std::vector<std::string> hosts;        // hosts_of(address)
  std::atomic<bool> has_served = false;  // serve() has returned

  void add_routes();
};

void ViewServer::State::add_routes() {
  server.set_payload_max_length(1024);  // no request has a body
  server.set_keep_alive_timeout(1);     // an idle page does not keep stop() waiting
  // Without SO_REUSEPORT, which cpp-httplib sets: two views must not share a port.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  });
  server.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
    if (names_this_computer(request, address, hosts)) return httplib::Server::HandlerResponse::Unhandled;
    response.status = 403;
    response.set_content(fmt::format("not a name of this page; it can be opened by {}{}\n", fmt::join(hosts, ", "),
                                     is_loopback(address) ? "" : ", or by a numeric address of this computer"),
                         "text/plain; charset=utf-8");
    return httplib::Server::HandlerResponse::Handled;
  });
  server.set_default_headers(
      {{"Cache-Control", "no-store"},
       {"Content-Security-Policy", "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'"},
       {"X-Content-Type-Options", "nosniff"}});
  for (const auto& files : {page_files(), internal::scene_files()}) {
    for (const EmbeddedFile& file : files) {
      server.Get(file.path, [&file](const httplib::Request&, httplib::Response& response) {
        response.set_content(std::string(file.content), file.type);
      });
    }
  }
  server.Get("/api/run", [this](const httplib::Request&, httplib::Response& response) {
    answer(view->overview(), kJson, response);
  });
  server.Get("/api/map", [this](const httplib::Request&, httplib::Response& response) {
    answer(view->map(), "application/octet-stream", response);
  });
  server.Get("/api/frames", numbered(*view, &RunView::frames, "from", kJson));
  server.Get("/api/landmarks", numbered(*view, &RunView::landmarks, "frame", kJson));
  server.Get("/api/image", numbered(*view, &RunView::image, "frame", "image/jpeg"));
  server.Get("/api/disparity", numbered(*view, &RunView::disparity, "view", "image/png"));
}

ViewServer::ViewServer(std::unique_ptr<State> state) : state_(std::move(state)) {}
ViewServer::ViewServer(ViewServer&&) noexcept = default;
ViewServer& ViewServer::operator=(ViewServer&&) noexcept = default;
ViewServer::~ViewServer() = default;

Result<ViewServer> ViewServer::create(const ViewRequest& request) {
  auto view = RunView::open(request);
  if (!view) return failure(view);
  auto state = std::make_unique<State>();
  state->view = std::move(*view);
  state->add_routes();
  return ViewServer(std::move(state));
}

Result<int> ViewServer::bind(const std::string& address, int port) {
  state_->address = address;
  state_->hosts = hosts_of(address);
  if (port != 0 && state_->server.bind_to_port(address, port)) return port;
  const int any = state_->server.bind_to_any_port(address);
  if (any <= 0) {
    return failure(ErrorCode::usage, fmt::format("'{}' is not an address or a name of this computer", address),
                   "--address", "0.0.0.0: all of its addresses; leave --address out: this computer only");
  }
  if (port == 0) return any;
  return failure(ErrorCode::output, fmt::format("port {} of {} cannot be used", port, address), "--port",
                 "another program uses it, or it is reserved for root: leave --port out");
}

void ViewServer::serve() {
  state_->server.listen_after_bind();
  state_->has_served = true;
}

// Of a server that does not serve yet, stop() of cpp-httplib does nothing.
void ViewServer::stop() {
  using namespace std::chrono_literals;
  while (!state_->has_served) {
    state_->server.stop();
    std::this_thread::sleep_for(10ms);
  }
}

}  // namespace spartan::viewer
