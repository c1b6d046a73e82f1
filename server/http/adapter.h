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

void put(const Response& from, httplib::Response& to);
/// The whole answer as text, for a connection that ends with it. The body must be a string.
std::string closing_text(const Response& response, const Fields& more);

/// The request line's part of a request, and the body.
Request request_of(const httplib::Request& from, std::string id);

}  // namespace penumbra::http
