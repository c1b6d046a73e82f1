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

namespace penumbra::http {

using Fields = std::vector<std::pair<std::string, std::string>>;

/// A checked request, as routes see it. `body` lives as long as the call of the handler.
struct Request {
  std::string method;  // HEAD counts as GET
  std::string path;
  std::string id;  // what the route's {id} stands for
  Fields query;
  Fields headers;  // names in lower case
  std::string_view body;
  access::Caller caller;
  std::string client;  // address
  /// False once the client has closed the connection.
  std::function<bool()> is_client_there;

  std::optional<std::string_view> header(std::string_view lower_case_name) const;
  std::optional<std::string_view> parameter(std::string_view name) const;
};

/// Sends bytes at once; false when the client is gone.
using Send = std::function<bool(std::string_view)>;
/// A body that grows while it is sent: called again and again until it returns false.
using Producer = std::function<bool(const Send& send, const std::function<bool()>& is_client_there)>;

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
/// 503: who asks may try again soon.
Response stopping_response();

/// The current time as the Date field has it (RFC 9110, 5.6.7).
std::string http_date();

/// A strong ETag.
std::string entity_tag(std::string_view sha256);

/// Whether the field If-None-Match names the tag, compared weakly (RFC 9110, 13.1.2).
bool names_tag(std::string_view if_none_match, std::string_view tag);

/// `text` with A–Z in lower case.
std::string lower_case(std::string_view text);
/// Without spaces and tabs at both ends.
std::string_view trimmed(std::string_view text);

}  // namespace penumbra::http
