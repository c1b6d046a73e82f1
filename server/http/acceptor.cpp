#include "server/http/acceptor.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <memory>
#include <system_error>
#include <utility>

namespace penumbra::http {

namespace {

/// Connections that may wait to be accepted: a burst of clients is let in at once.
constexpr int backlog = 4096;
constexpr std::chrono::milliseconds log_interval(1000);
/// So that no failure, however long it lasts, keeps a core busy.
constexpr std::chrono::milliseconds pause_after_abort(1), pause_after_failure(50);

/// A listening socket; −1 with errno where there is none.
int listen_on(const addrinfo& address) {
  const int socket = ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC, address.ai_protocol);
  if (socket < 0) return -1;
  const int yes = 1;
  // Not SO_REUSEPORT, which would let a second server share the port in silence.
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (address.ai_family == AF_INET6) ::setsockopt(socket, IPPROTO_IPV6, IPV6_V6ONLY, &yes, sizeof yes);
  if (::bind(socket, address.ai_addr, address.ai_addrlen) == 0 && ::listen(socket, backlog) == 0) return socket;
  const int error = errno;
  ::close(socket);
  errno = error;
  return -1;
}

/// Whether the error is one of the connection that was to be accepted: the next may be well (accept(2)).
bool is_of_one_connection(int error) {
  switch (error) {
    case ECONNABORTED:
    case EINTR:
    case ENETDOWN:
    case EPROTO:
    case ENOPROTOOPT:
    case EHOSTDOWN:
    case ENONET:
    case EHOSTUNREACH:
    case EOPNOTSUPP:
    case ENETUNREACH:
    case EPERM:
      return true;
    default:
      return false;
  }
}

}  // namespace

Acceptor::Acceptor(const std::string& host, int port) : socket_(-1) {
  addrinfo wanted{}, *found = nullptr;
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  const std::string service = std::to_string(port), place = "cannot listen on " + host + ":" + service;
  if (const int error = ::getaddrinfo(host.c_str(), service.c_str(), &wanted, &found); error != 0)
    throw std::system_error(std::make_error_code(std::errc::address_not_available), place + ": " + gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, ::freeaddrinfo);
  for (const addrinfo* address = found; address != nullptr && socket_ < 0; address = address->ai_next)
    socket_ = listen_on(*address);
  if (socket_ < 0) throw std::system_error(errno, std::generic_category(), place);
}

Acceptor::~Acceptor() { close(); }

int Acceptor::port() const {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

void Acceptor::start(std::function<void(int socket)> take) {
  accepting_ = std::jthread([this, take = std::move(take)] { accept_all(take); });
}

void Acceptor::accept_all(const std::function<void(int socket)>& take) {
  auto may_log = std::chrono::steady_clock::now();
  while (!is_closing_) {
    const int connection = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection >= 0) {
      const int yes = 1;
      ::setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      take(connection);
      continue;
    }
    const int error = errno;
    if (is_closing_) return;
    if (const auto now = std::chrono::steady_clock::now(); now >= may_log) {
      spdlog::error("a connection could not be accepted: {}", std::generic_category().message(error));
      may_log = now + log_interval;
    }
    std::this_thread::sleep_for(is_of_one_connection(error) ? pause_after_abort : pause_after_failure);
  }
}

void Acceptor::close() {
  if (is_closing_.exchange(true)) return;
  // Wakes the thread that accepts.
  ::shutdown(socket_, SHUT_RDWR);
  if (accepting_.joinable()) accepting_.join();
  ::close(socket_);
}

}  // namespace penumbra::http
