#include "server/http/listener.h"

#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <system_error>
#include <variant>

#include "api/problems.h"
#include "server/http/acceptor.h"
#include "server/http/adapter.h"
#include "server/http/dispatcher.h"
#include "server/http/threads.h"

namespace penumbra::http {

namespace {

constexpr std::size_t refusing_threads = 8;
constexpr auto longest_stop = std::chrono::seconds(4);

}  // namespace

class Listener::Implementation {
 public:
  Implementation(const ListenerSettings& settings, const Router& router, Guard& guard, metrics::Metrics& metrics,
                 const AccessLog& log)
      : settings_(settings),
        guard_(guard),
        metrics_(metrics),
        log_(log),
        dispatcher_(router, guard, metrics, settings.connection.max_body_bytes, settings.max_held_body_bytes),
        stop_descriptor_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (stop_descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }

  ~Implementation() {
    finish();
    ::close(stop_descriptor_);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  int open() {
    acceptor_.emplace(settings_.host, settings_.port);
    const int port = acceptor_->port();
    acceptor_->start([this](int socket) { threads_.run([this, socket] { serve(socket); }); });
    return port;
  }

  void finish() {
    // Whoever comes now finds nobody, and tries again: no answer could tell an EventSource to.
    if (acceptor_) acceptor_->close();
    const std::uint64_t one = 1;
    if (::write(stop_descriptor_, &one, sizeof one) < 0) spdlog::error("cannot wake the connections");
    {
      std::unique_lock lock(mutex_);
      connection_ended_.wait_for(lock, longest_stop, [&] { return connections_ == 0; });
    }
    threads_.finish();
  }

  void serve(int socket) {
    const bool is_welcome = count_connection(1) <= settings_.max_connections;
    try {
      Connection connection(socket, stop_descriptor_, settings_.connection);
      if (is_welcome) {
        serve(connection);
      } else {
        Exchange exchange = exchange_on(connection);
        // Few threads refuse, and there may be many to refuse.
        connection.linger_for(std::chrono::milliseconds(100));
        refuse(connection, exchange, overload_response("too many connections are open"));
        note(connection, exchange);
      }
    } catch (const std::exception& error) {
      spdlog::error("a connection failed: {}", error.what());
    }
    count_connection(-1);
  }

 private:
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
    if (const auto* text = std::get_if<std::string>(&head)) {
      exchange.head = check_head(*text, settings_.connection.max_body_bytes);
    } else {
      exchange.head.problem = std::get<api::Problem>(std::move(head));
    }
    const FieldValues& fields = exchange.head.fields;
    exchange.trace = parse_traceparent(fields[Field::traceparent].value_or(""));
    const std::string_view id = fields[Field::x_request_id].value_or("");
    exchange.request_id = is_request_id(id) ? id : fresh_request_id();
    exchange.origin = guard_.allowed_origin(fields[Field::origin].value_or(""));
    if (exchange.head.problem) {
      refuse(connection, exchange, problem_response(*exchange.head.problem));
      return false;
    }
    exchange.is_last = exchange.head.is_last || connection.is_stopping();
    connection.begin(std::move(exchange.head.text), exchange.head.body_bytes, exchange.head.is_interim_known);
    const bool goes_on = dispatcher_.answer(connection, exchange);
    return connection.finish_response() && goes_on && connection.is_read();
  }

  void refuse(Connection& connection, Exchange& exchange, const Response& response) {
    exchange.status = response.status;
    if (exchange.request_id.empty()) exchange.request_id = fresh_request_id();
    metrics_.count_request(exchange.route, exchange.head.method.empty() ? "none" : exchange.head.method,
                           response.status);
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
  Guard& guard_;
  metrics::Metrics& metrics_;
  const AccessLog& log_;
  Dispatcher dispatcher_;
  const int stop_descriptor_;
  std::mutex mutex_;
  std::condition_variable connection_ended_;
  std::size_t connections_ = 0;  // guarded by mutex_
  Threads threads_{settings_.max_connections + refusing_threads};
  std::optional<Acceptor> acceptor_;
};

Listener::Listener(const ListenerSettings& settings, const Router& router, Guard& guard, metrics::Metrics& metrics,
                   const AccessLog& log)
    : implementation_(std::make_unique<Implementation>(settings, router, guard, metrics, log)) {}

Listener::~Listener() = default;

int Listener::open() { return implementation_->open(); }

void Listener::serve(int socket) { implementation_->serve(socket); }

void Listener::finish() { implementation_->finish(); }

}  // namespace penumbra::http
