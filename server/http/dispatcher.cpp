#include "server/http/dispatcher.h"

#include <httplib.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "api/nearest.h"
#include "api/problems.h"
#include "server/http/adapter.h"
#include "server/http/encoding.h"
#include "server/http/held_bodies.h"
#include "server/store/job_store.h"

namespace penumbra::http {

namespace {

using HandlerResponse = httplib::Server::HandlerResponse;

/// Never used; anything but INVALID_SOCKET.
constexpr socket_t stand_in_socket = 0;

/// A connection as the library sees it.
class ConnectionStream : public httplib::Stream {
 public:
  explicit ConnectionStream(Connection& connection) : connection_(connection) {}
  bool is_readable() const override { return true; }
  bool is_writable() const override { return connection_.is_open(); }
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

/// The library hands a handler nothing of its connection but a function for clients, which is this.
struct Context {
  Connection* connection;
  Exchange* exchange;
  HeldBodies::Place* body;
  bool operator()(std::uint64_t, std::uint64_t) const { return true; }
};

/// Null for a request that the library refuses before it asks.
const Context* context_of(const httplib::Request& request) { return request.progress.target<Context>(); }

/// Valid as long as the request.
Credentials credentials_of(const httplib::Request& request, const Exchange& exchange) {
  const auto token = request.params.find("access_token");
  return {exchange.head.fields[Field::authorization],
          token == request.params.end() ? std::nullopt : std::optional<std::string_view>(token->second)};
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
    return problem_response(api::insufficient_storage("this server's disk is too full for jobs"));
  } catch (const store::StoreFailed&) {
    return stopping_response();
  } catch (const std::exception& error) {
    spdlog::error("a request failed: {}", error.what());
  } catch (...) {
    spdlog::error("a request failed");
  }
  return problem_response(api::internal_error());
}

/// Why the body cannot be read as JSON, if so.
std::optional<api::Problem> refusal_of_body(const FieldValues& fields) {
  if (!fields[Field::content_length]) return api::length_required();
  const std::string type = lower_case(fields[Field::content_type].value_or(""));
  std::size_t end = std::min(type.find(';'), type.size());
  const bool is_json = trimmed(std::string_view(type).substr(0, end)) == "application/json";
  bool is_utf8 = true;
  while (end < type.size()) {
    const std::size_t begin = end + 1;
    end = std::min(type.find(';', begin), type.size());
    const std::string_view part = trimmed(std::string_view(type).substr(begin, end - begin));
    is_utf8 = is_utf8 && (!part.starts_with("charset=") || part == "charset=utf-8" || part == "charset=\"utf-8\"");
  }
  if (is_json && is_utf8) return std::nullopt;
  return api::unsupported_media_type("send the header Content-Type: application/json" +
                                     std::string(is_json ? " without a charset other than utf-8" : ""));
}

Response too_many_large_bodies() { return overload_response("the server holds too many large bodies"); }

/// What the query says that the route does not know, or says twice.
std::optional<api::Problem> refusal_of_parameters(const Route& route, const httplib::Params& query) {
  if (route.takes_any_parameter) return std::nullopt;
  std::vector<std::string_view> known = route.parameters;
  if (route.takes_token) known.emplace_back("access_token");
  for (const auto& [name, value] : query) {
    if (std::ranges::find(known, name) == known.end())
      return api::bad_parameter("the query has an unknown parameter" + api::did_you_mean(name, known));
    if (query.count(name) > 1) return api::bad_parameter(name + " is there twice");
  }
  return std::nullopt;
}

}  // namespace

class Dispatcher::Implementation : private httplib::Server {
 public:
  Implementation(const Router& router, Guard& guard, metrics::Metrics& metrics, std::size_t max_body_bytes,
                 std::size_t max_held_body_bytes)
      : router_(router),
        guard_(guard),
        metrics_(metrics),
        max_body_bytes_(max_body_bytes),
        held_bodies_(max_held_body_bytes) {
    // The library sends no body that is made while it is sent unless it believes that it listens.
    svr_sock_ = stand_in_socket;
    set_pre_routing_handler([this](const auto& request, auto& response) { return before_body(request, response); });
    const auto with_body = [this](const auto& request, auto& response) { call_with_body(request, response); };
    // Only for routes that `before_body` has found, which have no long paths.
    constexpr const char* any_path = "/.*";
    Post(any_path, with_body).Put(any_path, with_body).Patch(any_path, with_body).Delete(any_path, with_body);
    // The library goes on with the pre-routing handler when this one says that the body may come.
    set_expect_100_continue_handler([this](const auto& request, auto& response) {
      return before_body(request, response) == HandlerResponse::Unhandled ? 100 : response.status;
    });
    set_error_handler(httplib::Server::Handler([](const auto& request, auto& response) {
      if (response.body.empty()) give(problem_response(api::plain_problem(response.status)), request, response);
    }));
    // Without it the library puts the text of the exception into a header field.
    set_exception_handler([](const auto& request, auto& response, const std::exception_ptr& thrown) {
      give(response_to(thrown), request, response);
    });
    set_post_routing_handler([this](const auto& request, auto& response) { complete(request, response); });
  }

  bool answer(Connection& connection, Exchange& exchange) {
    ConnectionStream stream(connection);
    HeldBodies::Place body(held_bodies_);
    bool is_closed = false;
    const bool is_well = process_request(stream, exchange.is_last, is_closed, [&](httplib::Request& request) {
      request.progress = Context{&connection, &exchange, &body};
    });
    return is_well && !exchange.is_last;
  }

 private:
  /// Hands an answer to the library, compressed where the client takes that.
  static void give(Response from, const httplib::Request& request, httplib::Response& to) {
    if (const Context* context = context_of(request)) compress_for(context->exchange->head.fields, from);
    put(from, to);
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
    if (const Context* context = context_of(request)) {
      Exchange& exchange = *context->exchange;
      for (const auto& [name, value] : guard_.fields_for(exchange)) response.set_header(name, value);
      exchange.status = response.status;
      exchange.is_last = exchange.is_last || response.get_header_value("Connection") == "close";
      metrics_.count_request(exchange.route, exchange.head.method, response.status);
    }
  }

  /// The request with who asks.
  Request asked(const httplib::Request& from, std::string id, const Context& context) const {
    Request request = request_of(from, std::move(id));
    request.fields = context.exchange->head.fields;
    request.caller = context.exchange->caller;
    request.client = context.exchange->client;
    request.is_wanted = [this, connection = context.connection, caller = request.caller] {
      return connection->is_client_there() && guard_.still_knows(caller);
    };
    return request;
  }

  Response answer_options(const Exchange& exchange, const std::vector<std::string>& methods) const {
    Response response{204, "", std::string(), {{"Allow", joined(methods)}}};
    if (!exchange.head.fields[Field::access_control_request_method] || exchange.origin.empty()) return response;
    for (auto& field : guard_.preflight_fields(joined(methods))) response.headers.push_back(std::move(field));
    return response;
  }

  /// The whole answer, when it needs no body.
  std::optional<Response> answer_to_head(const httplib::Request& request, const Context& context) {
    Exchange& exchange = *context.exchange;
    if (auto refusal = guard_.refusal_of_host(exchange)) return refusal;
    const Router::Match match = router_.find(request.method == "HEAD" ? "GET" : request.method, request.path);
    if (!match.name.empty()) exchange.route = match.name;
    if (request.method == "OPTIONS" && (!match.allowed.empty() || request.path == "*"))
      return answer_options(exchange, match.allowed);
    if (match.allowed.empty()) return problem_response(api::not_found("there is nothing at this path"));
    if (!match.route) {
      const std::string allowed = joined(match.allowed);
      Response refusal = problem_response(api::method_not_allowed("this path knows " + allowed));
      refusal.headers.emplace_back("Allow", allowed);
      return refusal;
    }
    if (auto refusal = guard_.admit(*match.route, match.id, credentials_of(request, exchange), exchange))
      return refusal;
    if (const auto problem = refusal_of_parameters(*match.route, request.params)) return problem_response(*problem);
    if (match.route->body == Body::none) return match.route->handler(asked(request, match.id, context));
    if (const auto problem = refusal_of_body(exchange.head.fields)) return problem_response(*problem);
    if (!context.body->take(exchange.head.body_bytes)) return too_many_large_bodies();
    return std::nullopt;
  }

  /// Answers everything but a body that may be read, which the library then reads and hands to `call_with_body`.
  HandlerResponse before_body(const httplib::Request& request, httplib::Response& response) {
    const Context* context = context_of(request);
    if (context == nullptr || context->exchange->is_admitted) return HandlerResponse::Unhandled;
    std::optional<Response> answer;
    try {
      answer = answer_to_head(request, *context);
    } catch (...) {
      // The library catches nothing while it is asked whether a body may come.
      answer = response_to(std::current_exception());
    }
    if (answer) {
      give(std::move(*answer), request, response);
      return HandlerResponse::Handled;
    }
    context->exchange->is_admitted = true;
    return HandlerResponse::Unhandled;
  }

  void call_with_body(const httplib::Request& from, httplib::Response& response) {
    const Context& context = *context_of(from);
    const Router::Match match = router_.find(from.method, from.path);
    Request request = asked(from, match.id, context);
    std::optional<std::string> text;
    if (context.exchange->head.is_body_gzip) {
      const auto may_take = [place = context.body](std::size_t bytes) { return place->take(bytes); };
      auto inflated = inflate(from.body, max_body_bytes_, may_take);
      if (const auto* problem = std::get_if<api::Problem>(&inflated))
        return give(problem_response(*problem), from, response);
      text = std::move(std::get<std::optional<std::string>>(inflated));
      if (!text) return give(too_many_large_bodies(), from, response);
      request.body = *text;
    }
    give(match.route->handler(request), from, response);
  }

  const Router& router_;
  Guard& guard_;
  metrics::Metrics& metrics_;
  const std::size_t max_body_bytes_;
  HeldBodies held_bodies_;
};

Dispatcher::Dispatcher(const Router& router, Guard& guard, metrics::Metrics& metrics, std::size_t max_body_bytes,
                       std::size_t max_held_body_bytes)
    : implementation_(std::make_unique<Implementation>(router, guard, metrics, max_body_bytes, max_held_body_bytes)) {}

Dispatcher::~Dispatcher() = default;

bool Dispatcher::answer(Connection& connection, Exchange& exchange) {
  return implementation_->answer(connection, exchange);
}

}  // namespace penumbra::http
