#pragma once
#include <atomic>
#include <functional>
#include <string>
#include <thread>

namespace penumbra::http {

/// Accepts connections on one address until it is closed, whatever single tries come to: what the system cannot give is
/// logged, at most once a second, and asked for again a moment later. May be shared between threads.
class Acceptor {
 public:
  /// Listens; port 0 is any free one. Throws std::system_error when the address cannot be had.
  Acceptor(const std::string& host, int port);
  /// Closes.
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  int port() const;
  /// Hands each connection over from now on, in a thread of its own; `take` owns the socket and must not throw.
  void start(std::function<void(int socket)> take);
  /// Returns when the address is free again and nothing more is handed over.
  void close();

 private:
  void accept_all(const std::function<void(int socket)>& take);

  int socket_;
  std::atomic<bool> is_closing_ = false;
  std::jthread accepting_;
};

}  // namespace penumbra::http
