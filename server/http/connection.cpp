#include "server/http/connection.h"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "api/problems.h"
#include "server/http/request_head.h"

namespace penumbra::http {

namespace {

constexpr std::size_t receive_bytes = 16u << 10;
constexpr std::string_view interim_answer = "HTTP/1.1 100 Continue\r\n\r\n";
constexpr auto probe_interval = std::chrono::seconds(1);

/// Time for so many bytes at 64 KiB/s, the least a client must manage.
std::chrono::milliseconds time_for(std::size_t bytes) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(bytes >> 6));
}

std::string client_of(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  std::array<char, NI_MAXHOST> text{};
  auto* any = reinterpret_cast<sockaddr*>(&address);
  if (::getpeername(socket, any, &size) != 0 ||
      ::getnameinfo(any, size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) != 0)
    return "unknown";
  return text.data();
}

}  // namespace

Connection::Connection(int socket, int stop_descriptor, const ConnectionLimits& limits)
    : socket_(socket), stop_descriptor_(stop_descriptor), limits_(limits), client_(client_of(socket)) {}

Connection::~Connection() {
  ::shutdown(socket_, SHUT_WR);
  // Closing with unread bytes resets the connection, and the client may then never see the answer.
  const Clock::time_point deadline = within_grace(Clock::now() + linger_);
  while (!is_broken_ && (body_left_ > 0 || !unread_.empty())) {
    unread_.clear();
    if (receive(deadline) <= 0) break;
  }
  ::close(socket_);
}

Connection::Ready Connection::wait(short events, Clock::time_point deadline, bool wakes_on_stop) const {
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    std::array<pollfd, 2> watched{pollfd{socket_, events, 0}, pollfd{stop_descriptor_, POLLIN, 0}};
    const int ready = ::poll(watched.data(), wakes_on_stop ? 2 : 1, static_cast<int>(std::max<std::int64_t>(0, left)));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return Ready::timeout;
    if (watched[0].revents != 0) return Ready::yes;
    return Ready::stopping;
  }
}

bool Connection::is_stopping() const {
  pollfd watched{stop_descriptor_, POLLIN, 0};
  return ::poll(&watched, 1, 0) > 0;
}

Connection::Clock::time_point Connection::within_grace(Clock::time_point deadline) const {
  if (!stop_deadline_ && is_stopping()) stop_deadline_ = Clock::now() + limits_.stop_grace;
  return stop_deadline_ ? std::min(deadline, *stop_deadline_) : deadline;
}

ssize_t Connection::receive(Clock::time_point deadline) {
  while (true) {
    const std::size_t before = unread_.size();
    unread_.resize(before + receive_bytes);
    const ssize_t count = ::recv(socket_, unread_.data() + before, receive_bytes, MSG_DONTWAIT);
    unread_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(0, count)));
    if (count > 0) return count;
    if (count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) {
      is_broken_ = true;
      return 0;
    }
    Ready ready = wait(POLLIN, within_grace(deadline), !stop_deadline_);
    if (ready == Ready::stopping) ready = wait(POLLIN, within_grace(deadline), false);
    if (ready == Ready::timeout) return -1;
  }
}

std::variant<std::string, api::Problem, Connection::End> Connection::next_head() {
  if (unread_.empty() && wait(POLLIN, Clock::now() + limits_.idle, true) != Ready::yes) return End::closed;
  request_deadline_ = Clock::now() + limits_.request;
  std::size_t searched = 0;
  while (true) {
    // An empty line or two before a request are common and harmless (RFC 9112, 2.2).
    if (searched == 0) unread_.erase(0, std::min(unread_.find_first_not_of("\r\n"), unread_.size()));
    const std::size_t end = end_of_head(unread_, searched > 3 ? searched - 3 : 0);
    if (end <= limits_.max_head_bytes) {
      std::string head = unread_.substr(0, end);
      unread_.erase(0, end);
      return head;
    }
    // TLS, and what is no HTTP at all, need not be waited for.
    if (!may_be_request(unread_)) return api::bad_request("this is not HTTP");
    if (unread_.size() > limits_.max_head_bytes) return api::headers_too_large(limits_.max_head_bytes);
    searched = unread_.size();
    const ssize_t count = receive(request_deadline_);
    if (count < 0) return api::request_timeout();
    if (count == 0) return End::closed;
  }
}

void Connection::begin(std::string head, std::size_t body_bytes, bool is_interim_known) {
  head_ = std::move(head);
  head_read_ = 0;
  body_left_ = body_bytes;
  is_first_write_ = true;
  is_interim_known_ = is_interim_known;
  next_probe_ = {};
}

ssize_t Connection::read(char* to, std::size_t size) {
  if (head_read_ < head_.size()) {
    const std::size_t count = std::min(size, head_.size() - head_read_);
    std::memcpy(to, head_.data() + head_read_, count);
    head_read_ += count;
    return static_cast<ssize_t>(count);
  }
  if (body_left_ == 0) return 0;
  if (unread_.empty()) {
    const ssize_t received = receive(request_deadline_);
    if (received <= 0) return -1;
    request_deadline_ += time_for(static_cast<std::size_t>(received));
  }
  const std::size_t count = std::min({size, body_left_, unread_.size()});
  std::memcpy(to, unread_.data(), count);
  unread_.erase(0, count);
  body_left_ -= count;
  return static_cast<ssize_t>(count);
}

bool Connection::send_all(std::string_view bytes) {
  Clock::time_point deadline = Clock::now() + limits_.response;
  while (!bytes.empty() && !is_broken_) {
    const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count > 0) {
      sent_bytes_ += static_cast<std::uint64_t>(count);
      bytes.remove_prefix(static_cast<std::size_t>(count));
      deadline += time_for(static_cast<std::size_t>(count));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) {
      Ready ready = wait(POLLOUT, within_grace(deadline), !stop_deadline_);
      if (ready == Ready::stopping) ready = wait(POLLOUT, within_grace(deadline), false);
      is_broken_ = ready == Ready::timeout;
    } else {
      is_broken_ = true;
    }
  }
  return !is_broken_;
}

bool Connection::write(std::string_view bytes) {
  const bool is_interim = bytes.starts_with(interim_answer.substr(0, interim_answer.find("Continue")));
  if (is_first_write_ && !is_interim) {
    is_first_write_ = false;
    held_ = bytes;
    return !is_broken_;
  }
  // Large bodies are not worth a copy.
  constexpr std::size_t most_joined = 64u << 10;
  if (!held_.empty() && bytes.size() <= most_joined) {
    held_ += bytes;
    return finish_response();
  }
  return finish_response() && send_all(bytes);
}

bool Connection::finish_response() {
  const std::string held = std::move(held_);
  held_.clear();
  return send_all(held);
}

bool Connection::is_client_there() {
  pollfd watched{socket_, POLLRDHUP, 0};
  if (is_broken_ || ::poll(&watched, 1, 0) < 0 || (watched.revents & (POLLHUP | POLLERR)) != 0) return false;
  if ((watched.revents & POLLRDHUP) == 0) return true;
  if (!is_interim_known_ || !is_first_write_) return false;
  if (Clock::now() < next_probe_) return true;
  next_probe_ = Clock::now() + probe_interval;
  return send_all(interim_answer);
}

}  // namespace penumbra::http
