// What a client may send over one connection: the server reads it as it reads a socket, byte budgets, deadlines and
// all, and must answer every request or close. A corpus file is the client's bytes.
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "server/http/listener.h"

using namespace penumbra::http;

namespace {

/// Routes of every kind, without jobs behind them.
Router routes() {
  Router router;
  const Handler echo = [](const Request& request) {
    // Long enough to be compressed.
    return json_response(200, std::to_string(request.body.size() + request.query.size()) + std::string(2000, ' '));
  };
  const Handler stream = [](const Request&) -> Response {
    return {200, "text/event-stream", [](const Send& send) { return send("data\n\n") && false; }, {}};
  };
  router.add({"POST", "/v1/jobs", Body::json, echo});
  router.add({"GET", "/v1/jobs", Body::none, echo});
  router.add({"DELETE", "/v1/jobs/{id}", Body::none, echo});
  router.add({"POST", "/v1/jobs/{id}/cancel", Body::none, echo});
  router.add({"GET", "/v1/jobs/{id}/events", Body::none, stream});
  router.add({"GET", "/throws", Body::none, [](const Request&) -> Response { throw 1; }});
  return router;
}

ListenerSettings settings() {
  ListenerSettings settings;
  settings.connection.max_head_bytes = 4096;
  settings.connection.max_body_bytes = 4096;
  settings.connection.idle = settings.connection.request = settings.connection.response = std::chrono::seconds(2);
  return settings;
}

struct Server {
  Router router = routes();
  GuardSettings guard_settings{nullptr, 0, {}, {"https://a.example"}};
  Guard guard{guard_settings, [](const std::string&) { return std::nullopt; }};
  penumbra::metrics::Metrics metrics;
  AccessLog log{{}};
  Listener listener{settings(), router, guard, metrics, log};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Server server;
  if (size > 16'384) return 0;
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) std::abort();
  const int large = 1 << 20;
  for (const int end : ends) ::setsockopt(end, SOL_SOCKET, SO_SNDBUF, &large, sizeof large);
  if (::write(ends[0], data, size) != static_cast<ssize_t>(size)) std::abort();
  ::shutdown(ends[0], SHUT_WR);
  server.listener.serve(ends[1]);

  std::string answer;
  char buffer[65536];
  for (ssize_t count = 0; (count = ::read(ends[0], buffer, sizeof buffer)) > 0;)
    answer.append(buffer, static_cast<std::size_t>(count));
  ::close(ends[0]);
  // Nothing but responses comes back, and no line of a head has what only the client could have put there.
  if (!answer.empty() && !answer.starts_with("HTTP/1.1 ")) std::abort();
  const std::string_view head = std::string_view(answer).substr(0, answer.find("\r\n\r\n"));
  for (const char c : head) {
    if ((static_cast<unsigned char>(c) < 0x20 && c != '\r' && c != '\n') || static_cast<unsigned char>(c) >= 0x7f)
      std::abort();
  }
  return 0;
}
