#pragma once
#include <optional>
#include <string>

#include "api/problem.h"
#include "server/http/message.h"

namespace httplib {
struct Request;
struct Response;
}  // namespace httplib

namespace penumbra::http {

// Between the messages of the HTTP library and those of the routes.

/// `from` must outlive the result. The caller and the client are not filled in.
Request request_of(const httplib::Request& from, std::string id);
void put(const Response& from, httplib::Response& to);
/// The whole answer as text, for a connection that ends with it. The body must be a string.
std::string closing_text(const Response& response, const Fields& more);

/// Why the body of this request cannot be read as JSON, if so.
std::optional<api::Problem> refusal_of_body(const httplib::Request& request);

}  // namespace penumbra::http
