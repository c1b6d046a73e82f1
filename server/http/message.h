#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "api/problem.h"
#include "server/access/key.h"
#include "server/http/fields.h"

namespace penumbra::http {

using Fields = std::vector<std::pair<std::string, std::string>>;

/// A checked request, as routes see it. `body` lives as long as the call of the handler.
struct Request {
  std::string method;  // HEAD counts as GET
  std::string path;
  std::string id;  // what the route's {id} stands for
  Fields query;
  FieldValues fields;
  std::string_view body;
  access::Caller caller;
  std::string client;  // address
  /// False once nobody may have the answer: the client has closed the connection, or its key is no longer known.
  std::function<bool()> is_wanted;

  std::optional<std::string_view> parameter(std::string_view name) const;
};

/// Sends bytes at once; false when the client is gone.
using Send = std::function<bool(std::string_view)>;
/// A body that grows while it is sent: called again and again until it returns false.
using Producer = std::function<bool(const Send& send)>;

struct Response {
  int status = 200;
  std::string media_type;  // empty: no body
  std::variant<std::string, std::string_view, std::shared_ptr<const std::string>, Producer> body;
  Fields headers;
};

using Handler = std::function<Response(const Request&)>;

Response json_response(int status, std::string json);
Response problem_response(const api::Problem& problem);
/// With Retry-After.
Response problem_response(const api::Problem& problem, int retry_after_s);
/// 503 for want of room: `what` says of what. There may be some in a moment.
Response overload_response(std::string what);
/// 503: who asks may try again soon.
Response stopping_response();

/// The current time as the Date field has it (RFC 9110, 5.6.7).
std::string http_date();

/// A strong ETag.
std::string entity_tag(std::string_view sha256);

/// Whether If-None-Match names the tag, or that of the same compressed, compared weakly (RFC 9110, 13.1.2).
bool names_tag(const FieldValues& fields, std::string_view tag);

}  // namespace penumbra::http
