#include "server/http/listener.h"

#include <httplib.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>

#include "server/http/adapter.h"
#include "server/http/held_bodies.h"
#include "server/http/problems.h"
#include "server/http/request_head.h"
#include "server/http/threads.h"
#include "server/store/job_store.h"

namespace penumbra::http {

namespace {

using HandlerResponse = httplib::Server::HandlerResponse;

constexpr int backlog = 4096, overload_retry_s = 2;
constexpr std::size_t refusing_threads = 8;
constexpr auto longest_stop = std::chrono::seconds(4);

/// A connection as the library sees it.
class ConnectionStream : public httplib::Stream {
 public:
  explicit ConnectionStream(Connection& connection) : connection_(connection) {}
  bool is_readable() const override { return true; }
  bool is_writable() const override { return connection_.is_client_there(); }
  ssize_t read(char* to, std::size_t size) override { return connection_.read(to, size); }
  ssize_t write(const char* from, std::size_t size) override {
    return connection_.write({from, size}) ? static_cast<ssize_t>(size) : -1;
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  /// The library refuses descriptors that select() could not watch; it never watches this one.
  socket_t socket() const override { return INVALID_SOCKET; }

 private:
  Connection& connection_;
};

class TaskQueue : public httplib::TaskQueue {
 public:
  explicit TaskQueue(std::size_t max_threads) : threads_(max_threads) {}
  void enqueue(std::function<void()> task) override { threads_.run(std::move(task)); }
  void shutdown() override { threads_.finish(); }

 private:
  Threads threads_;
};

/// The library hands a handler nothing of its connection but this function, which is a field meant for clients.
struct Progress {
  const Connection* connection;
  Exchange* exchange;
  HeldBodies::Place* body;
  bool operator()(std::uint64_t, std::uint64_t) const { return connection->is_client_there(); }
};

/// Null for a request that the library refuses before it asks.
Exchange* exchange_of(const httplib::Request& request) {
  const auto* progress = request.progress.target<Progress>();
  return progress == nullptr ? nullptr : progress->exchange;
}

std::optional<std::string_view> field_of(const httplib::Request& request, const char* name) {
  const auto field = request.headers.find(name);
  return field == request.headers.end() ? std::nullopt : std::optional<std::string_view>(field->second);
}

std::string joined(const std::vector<std::string>& methods) {
  std::string text;
  for (const std::string& method : methods) text += method + (method == "GET" ? ", HEAD, " : ", ");
  return text + "OPTIONS";
}

Response response_to(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const api::InvalidBody& invalid) {
    return problem_response(invalid.problem());
  } catch (const store::StorageFull&) {
    return problem_response(insufficient_storage());
  } catch (const store::StoreFailed&) {
    return stopping_response();
  } catch (const std::exception& error) {
    spdlog::error("a request failed: {}", error.what());
  } catch (...) {
    spdlog::error("a request failed");
  }
  return problem_response(internal_error());
}

}  // namespace

class Listener::Implementation : public httplib::Server {
 public:
  Implementation(const ListenerSettings& settings, const Router& router, Guard& guard, metrics::Metrics& metrics,
                 const AccessLog& log)
      : settings_(settings),
        router_(router),
        guard_(guard),
        metrics_(metrics),
        log_(log),
        stop_descriptor_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (stop_descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
    configure();
  }

  ~Implementation() override {
    finish();
    ::close(stop_descriptor_);
  }

  int open() {
    const bool is_bound = settings_.port == 0 ? (port_ = bind_to_any_port(settings_.host)) > 0
                                              : bind_to_port(settings_.host, port_ = settings_.port);
    const std::string address = settings_.host + ":" + std::to_string(settings_.port);
    // The library's own backlog of 5 makes a burst of clients wait a second for the next try.
    if (!is_bound || ::listen(svr_sock_, backlog) != 0)
      throw std::system_error(errno, std::generic_category(), "cannot listen on " + address);
    accepting_ = std::jthread([this] { listen_after_bind(); });
    while (!is_running()) std::this_thread::yield();
    return port_;
  }

  void finish() {
    const std::uint64_t one = 1;
    if (::write(stop_descriptor_, &one, sizeof one) < 0) spdlog::error("cannot wake the connections");
    {
      std::unique_lock lock(mutex_);
      connection_ended_.wait_for(lock, longest_stop, [&] { return connections_ == 0; });
    }
    stop();
    if (accepting_.joinable()) accepting_.join();
  }

  bool process_and_close_socket(socket_t socket) override {
    const bool is_welcome = count_connection(1) <= settings_.max_connections;
    try {
      Connection connection(socket, stop_descriptor_, settings_.connection);
      if (is_welcome && !connection.is_stopping()) {
        serve(connection);
      } else {
        Exchange exchange = exchange_on(connection);
        // Few threads refuse, and there may be many to refuse.
        const bool is_stopping = connection.is_stopping();
        connection.linger_for(std::chrono::milliseconds(is_stopping ? 0 : 100));
        const char* const reason = is_stopping ? "the server is stopping" : "too many connections are open";
        refuse(connection, exchange, unavailable(reason), overload_retry_s);
        note(connection, exchange);
      }
    } catch (const std::exception& error) {
      spdlog::error("a connection failed: {}", error.what());
    }
    count_connection(-1);
    return true;
  }

 private:
  void configure() {
    new_task_queue = [this] { return new TaskQueue(settings_.max_connections + refusing_threads); };
    set_tcp_nodelay(true);
    // Not SO_REUSEPORT, which would let a second server share the port in silence.
    set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    set_pre_routing_handler([this](const auto& request, auto& response) { return before_body(request, response); });
    // Only for routes that `before_body` has found.
    Post("/v1/[a-z]{1,20}", [this](const auto& request, auto& response) {
      const Router::Match match = router_.find(request.method, request.path);
      put(match.route->handler(asked(request, match.id)), response);
    });
    set_expect_100_continue_handler([this](const auto& request, auto& response) {
      const Router::Match match = router_.find(request.method, request.path);
      if (!match.route || match.route->body == Body::none) return 100;
      const auto caller = guard_.identify(*match.route, field_of(request, "Authorization"));
      const auto problem = refusal_of_body(request);
      if (const auto* refusal = std::get_if<Response>(&caller)) {
        put(*refusal, response);
      } else if (problem) {
        put(problem_response(*problem), response);
      } else {
        return 100;
      }
      return response.status;
    });
    set_error_handler(httplib::Server::Handler([](const auto&, auto& response) {
      if (response.body.empty()) put(problem_response(plain_problem(response.status)), response);
    }));
    // Without it the library puts the text of the exception into a header field.
    set_exception_handler(
        [](const auto&, auto& response, const std::exception_ptr& thrown) { put(response_to(thrown), response); });
    set_post_routing_handler([this](const auto& request, auto& response) { complete(request, response); });
  }

  void complete(const httplib::Request& request, httplib::Response& response) {
    response.set_header("Date", http_date());
    response.set_header("X-Content-Type-Options", "nosniff");
    const bool is_body_unread = request.get_header_value<std::uint64_t>("Content-Length") != request.body.size();
    if (is_body_unread && !response.has_header("Connection")) response.set_header("Connection", "close");
    // The library promises five requests a connection, and ranges; neither is so.
    response.headers.erase("Keep-Alive");
    response.headers.erase("Accept-Ranges");
    if (response.status == 204 || response.status == 304) response.headers.erase("Content-Length");
    if (Exchange* exchange = exchange_of(request)) {
      for (const auto& [name, value] : guard_.fields_for(*exchange)) response.set_header(name, value);
      exchange->status = response.status;
      metrics_.count_request(exchange->route, exchange->method, response.status);
    }
  }

  /// The request with who asks.
  static Request asked(const httplib::Request& from, std::string id) {
    Request request = request_of(from, std::move(id));
    if (const Exchange* exchange = exchange_of(from)) {
      request.caller = exchange->caller;
      request.client = exchange->client;
    }
    return request;
  }

  Response answer_options(const Exchange& exchange, const std::vector<std::string>& methods, bool is_preflight) {
    Response response{204, "", std::string(), {{"Allow", joined(methods)}}};
    if (!is_preflight || exchange.origin.empty()) return response;
    for (auto& field : guard_.preflight_fields(joined(methods))) response.headers.push_back(std::move(field));
    return response;
  }

  /// Answers everything but a body that may be read, which the library then reads and hands to the Post handler.
  HandlerResponse before_body(const httplib::Request& request, httplib::Response& response) {
    Exchange* exchange = exchange_of(request);
    if (exchange == nullptr) return HandlerResponse::Unhandled;
    const Router::Match match = router_.find(request.method == "HEAD" ? "GET" : request.method, request.path);
    if (!match.name.empty()) exchange->route = match.name;
    if (request.method == "OPTIONS" && (!match.allowed.empty() || request.path == "*")) {
      put(answer_options(*exchange, match.allowed, request.has_header("Access-Control-Request-Method")), response);
    } else if (match.allowed.empty()) {
      put(problem_response(not_found("there is nothing at this path")), response);
    } else if (!match.route) {
      const std::string allowed = joined(match.allowed);
      Response refusal = problem_response(method_not_allowed("this path knows " + allowed));
      refusal.headers.emplace_back("Allow", allowed);
      put(refusal, response);
    } else if (auto refusal = guard_.admit(*match.route, match.id, field_of(request, "Authorization"), *exchange)) {
      put(*refusal, response);
    } else if (match.route->body == Body::none) {
      put(match.route->handler(asked(request, match.id)), response);
    } else if (const auto problem = refusal_of_body(request)) {
      put(problem_response(*problem), response);
    } else if (!request.progress.target<Progress>()->body->take(
                   request.get_header_value<std::uint64_t>("Content-Length"))) {
      put(problem_response(unavailable("the server holds too many large bodies"), overload_retry_s), response);
    } else {
      return HandlerResponse::Unhandled;
    }
    return HandlerResponse::Handled;
  }

  static Exchange exchange_on(const Connection& connection) {
    Exchange exchange;
    exchange.client = connection.client();
    exchange.sent_bytes = connection.sent_bytes();
    return exchange;
  }

  void serve(Connection& connection) {
    bool goes_on = true;
    while (goes_on) {
      auto head = connection.next_head();
      if (std::holds_alternative<Connection::End>(head)) return;
      Exchange exchange = exchange_on(connection);
      goes_on = answer(connection, head, exchange);
      note(connection, exchange);
    }
  }

  /// False when the connection ends with this request.
  bool answer(Connection& connection, std::variant<std::string, api::Problem, Connection::End>& head,
              Exchange& exchange) {
    RequestHead request;
    if (const auto* text = std::get_if<std::string>(&head)) {
      request = check_head(*text, settings_.connection.max_body_bytes);
    } else {
      request.problem = std::get<api::Problem>(std::move(head));
    }
    exchange.method = std::move(request.method);
    exchange.target = std::move(request.target);
    exchange.trace = parse_traceparent(request.traceparent.value_or(""));
    const bool is_id_sane = request.request_id && is_request_id(*request.request_id);
    exchange.request_id = is_id_sane ? *request.request_id : fresh_request_id();
    exchange.origin = guard_.allowed_origin(request.origin.value_or(""));
    if (request.problem) {
      refuse(connection, exchange, *request.problem);
      return false;
    }
    connection.begin(std::move(request.text), request.body_bytes);
    ConnectionStream stream(connection);
    HeldBodies::Place body(held_bodies_);
    const bool is_last = request.is_last || connection.is_stopping();
    bool is_closed = false;
    const bool is_well = process_request(stream, is_last, is_closed, [&](httplib::Request& r) {
      r.progress = Progress{&connection, &exchange, &body};
    });
    return connection.finish_response() && is_well && !is_last && !is_closed && connection.is_read();
  }

  void refuse(Connection& connection, Exchange& exchange, const api::Problem& problem, int retry_after_s = 0) {
    exchange.status = problem.status;
    if (exchange.request_id.empty()) exchange.request_id = fresh_request_id();
    metrics_.count_request(exchange.route, exchange.method.empty() ? "none" : exchange.method, problem.status);
    const Response response = retry_after_s > 0 ? problem_response(problem, retry_after_s) : problem_response(problem);
    connection.write(closing_text(response, guard_.fields_for(exchange)));
    connection.finish_response();
    connection.abandon_request();
  }

  /// What became of a request goes to the metrics and the log.
  void note(const Connection& connection, Exchange& exchange) {
    const auto took = std::chrono::steady_clock::now() - exchange.start;
    exchange.sent_bytes = connection.sent_bytes() - exchange.sent_bytes;
    metrics_.request_took(exchange.route, exchange.status, std::chrono::duration<double>(took).count());
    log_.write(exchange);
  }

  std::size_t count_connection(int by) {
    metrics_.connections_changed(by);
    const std::lock_guard lock(mutex_);
    connections_ += static_cast<std::size_t>(by);
    if (connections_ == 0) connection_ended_.notify_all();
    return connections_;
  }

  const ListenerSettings settings_;
  const Router& router_;
  Guard& guard_;
  metrics::Metrics& metrics_;
  const AccessLog& log_;
  const int stop_descriptor_;
  int port_ = 0;
  std::mutex mutex_;
  std::condition_variable connection_ended_;
  std::size_t connections_ = 0;  // guarded by mutex_
  HeldBodies held_bodies_{settings_.max_held_body_bytes};
  std::jthread accepting_;
};

Listener::Listener(const ListenerSettings& settings, const Router& router, Guard& guard, metrics::Metrics& metrics,
                   const AccessLog& log)
    : implementation_(std::make_unique<Implementation>(settings, router, guard, metrics, log)) {}

Listener::~Listener() = default;

int Listener::open() { return implementation_->open(); }

void Listener::serve(int socket) { implementation_->process_and_close_socket(socket); }

void Listener::finish() { implementation_->finish(); }

}  // namespace penumbra::http
