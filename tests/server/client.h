#pragma once
#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>

/// What a server answered. Header names in lower case.
struct Reply {
  int status = 0;
  std::string reason;
  std::map<std::string, std::string> headers;
  std::string body;
};

struct Event {
  std::string id, name, data;
};

/// One connection to 127.0.0.1, with nothing between the test and the bytes. Every wait ends after 30 seconds; a test
/// that meets that end fails. Each answer goes, with what it answers, to the file that PENUMBRA_EXCHANGES names, if
/// any: tests/server/run then holds it against the document of the interface.
class Client {
 public:
  explicit Client(int port);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// False when the server has closed.
  bool send(std::string_view bytes);
  /// The next response that is no interim one; nothing when the connection ends before one is complete.
  std::optional<Reply> reply(bool has_body = true);
  /// Sends a request with Host and, when there is a body or the method is POST, Content-Length; returns the reply.
  std::optional<Reply> request(std::string_view method, std::string_view path, std::string_view body = "",
                               std::string_view headers = "");
  /// Status and headers of a response whose body is read otherwise.
  std::optional<Reply> head();
  /// The next event of an event stream, comments and `retry` aside; nothing at the end.
  std::optional<Event> event();
  /// Whether the server closes the connection and says nothing more.
  bool is_closed_by_server();
  void close();
  /// Closes the way to the server, and only that.
  void finish_sending();

 private:
  bool receive();
  std::optional<Reply> read_head();
  void record(const Reply& reply, bool has_body);
  std::optional<std::string> take_until(std::string_view mark);

  int socket_;
  std::string received_;
  std::string unanswered_;  // sent, and nothing came back for it yet
  std::string asked_;       // path of the last answer
};

/// One request on a connection of its own.
Reply call(int port, std::string_view method, std::string_view path, std::string_view body = "",
           std::string_view headers = "");
/// A POST of JSON on a connection of its own.
Reply post(int port, std::string_view path, std::string_view json, std::string_view headers = "");
