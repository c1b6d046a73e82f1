#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "api/problem.h"

namespace penumbra::http {

/// What one client may take of the server's time and memory.
struct ConnectionLimits {
  std::size_t max_head_bytes = 64u << 10;  // request line and header fields
  std::size_t max_body_bytes = 8u << 20;
  std::chrono::milliseconds idle = std::chrono::seconds(15);  // between two requests
  /// For a whole request or response; bodies get a second more for every 64 KiB that have arrived.
  std::chrono::milliseconds request = std::chrono::seconds(30), response = std::chrono::seconds(30);
  std::chrono::milliseconds stop_grace = std::chrono::seconds(2);  // for what is under way when the server stops
};

/// One accepted socket with total deadlines and byte budgets. Owned and used by one thread.
class Connection {
 public:
  /// Takes the socket over. `stop_descriptor` becomes readable when the server stops.
  Connection(int socket, int stop_descriptor, const ConnectionLimits& limits);
  /// Closes; what the client still sends is read for a moment, so that it can read the last answer.
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  enum class End { closed };  // by the client, by idleness, or by the server's stop
  /// The next request up to its empty line; or the problem to refuse it with.
  std::variant<std::string, api::Problem, End> next_head();

  /// From here on `read` yields `head`, then `body_bytes` from the socket, and then the end.
  /// `is_interim_known`: the client takes interim answers (RFC 9110, 15.2).
  void begin(std::string head, std::size_t body_bytes, bool is_interim_known);
  /// As recv: bytes read, 0 at the end, −1 when they do not come in time.
  ssize_t read(char* to, std::size_t size);
  /// The client may still be sending what nobody will read.
  void abandon_request() { body_left_ = std::numeric_limits<std::size_t>::max(); }
  /// At the end, what the client still sends is read for so long.
  void linger_for(std::chrono::milliseconds time) { linger_ = time; }
  /// Whether `read` has yielded the whole request.
  bool is_read() const { return body_left_ == 0; }

  /// As send, but all or nothing: false when the client does not take it in time. The first write of a response waits
  /// for the second, to travel with it.
  bool write(std::string_view bytes);
  bool finish_response();

  /// False when the client has gone. Does not wait. Who has closed but the way to here may still want the answer:
  /// before it has begun, an interim one is sent now and then, which the system of a client that has gone refuses.
  bool is_client_there();
  /// Whether the client can still be written to, as far as is known.
  bool is_open() const { return !is_broken_; }
  bool is_stopping() const;

  /// The address of the other side, without its port.
  const std::string& client() const { return client_; }
  /// Bytes that were given to the system so far.
  std::uint64_t sent_bytes() const { return sent_bytes_; }

 private:
  using Clock = std::chrono::steady_clock;
  enum class Ready { yes, timeout, stopping };

  Ready wait(short events, Clock::time_point deadline, bool wakes_on_stop) const;
  /// Appends what the socket has to unread_; 0 at the end, −1 when nothing comes before `deadline`.
  ssize_t receive(Clock::time_point deadline);
  Clock::time_point within_grace(Clock::time_point deadline) const;
  bool send_all(std::string_view bytes);

  const int socket_, stop_descriptor_;
  const ConnectionLimits limits_;
  const std::string client_;
  std::uint64_t sent_bytes_ = 0;
  std::string unread_;  // received, not yet asked for
  std::string head_;
  std::size_t head_read_ = 0;
  std::size_t body_left_ = 0;
  Clock::time_point request_deadline_;
  mutable std::optional<Clock::time_point> stop_deadline_;
  std::chrono::milliseconds linger_ = std::chrono::seconds(1);
  std::string held_;
  bool is_first_write_ = true;
  bool is_interim_known_ = false;
  Clock::time_point next_probe_;
  bool is_broken_ = false;
};

}  // namespace penumbra::http
