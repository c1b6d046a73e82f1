#include "server/http/request_head.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <vector>

#include "server/http/message.h"
#include "server/http/problems.h"

namespace penumbra::http {

namespace {

constexpr std::array<std::string_view, 8> known_methods{"GET",    "HEAD",  "POST",  "PUT",
                                                        "DELETE", "PATCH", "TRACE", "OPTIONS"};

bool is_token(std::string_view text) {
  constexpr std::string_view marks = "!#$%&'*+-.^_`|~";
  return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           marks.find(c) != std::string_view::npos;
  });
}

/// What the library and the handlers ask for. The library would do more with others: it reads ranges with a recursive
/// expression and answers many of them with as many copies, and compresses at its slowest; both may be ignored (RFC
/// 9110, 14.2 and 12.5.3).
constexpr std::array<std::string_view, 10> fields_in_use{"access-control-request-method",
                                                         "authorization",
                                                         "content-length",
                                                         "content-type",
                                                         "expect",
                                                         "host",
                                                         "idempotency-key",
                                                         "if-none-match",
                                                         "last-event-id",
                                                         "origin"};
/// The library reads no longer line, with its end.
constexpr std::size_t max_line_bytes = 8192;

/// No control characters; `is_space_allowed` for field values.
bool is_clean(std::string_view text, bool is_space_allowed) {
  return std::all_of(text.begin(), text.end(), [&](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return is_space_allowed ? (byte >= 0x20 || c == '\t') && byte != 0x7f : byte > 0x20 && byte != 0x7f;
  });
}

/// What the fields say about the message itself.
struct Framing {
  std::optional<std::size_t> content_length;
  bool has_transfer_encoding = false, has_content_encoding = false, is_close_asked = false, is_kept_alive = false;
  int hosts = 0;
  std::vector<std::string> request_ids, traceparents, origins, idempotency_keys;
};

std::optional<std::string> only(const std::vector<std::string>& values) {
  return values.size() == 1 ? std::optional(values[0]) : std::nullopt;
}

/// As the library reads values: it takes what follows a percent sign for an encoded byte.
std::string with_percent_encoded(std::string_view value) {
  std::string text;
  for (const char c : value) text += c == '%' ? std::string("%25") : std::string(1, c);
  return text;
}

std::optional<api::Problem> read_field(std::string_view line, Framing& framing, std::string& text) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || !is_token(line.substr(0, colon)))
    return bad_request("a header field has no name");
  const std::string name = lower_case(line.substr(0, colon));
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (!is_clean(value, true)) return bad_request("a header field has control characters");
  if (name == "content-length") {
    std::size_t length = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), length);
    if (framing.content_length || error != std::errc() || end != value.data() + value.size())
      return bad_request("the Content-Length is not one number");
    framing.content_length = length;
  } else if (name == "transfer-encoding") {
    framing.has_transfer_encoding = true;
  } else if (name == "content-encoding") {
    framing.has_content_encoding = framing.has_content_encoding || lower_case(value) != "identity";
  } else if (name == "connection") {
    const std::string choice = lower_case(value);
    framing.is_close_asked = framing.is_close_asked || choice.find("close") != std::string::npos;
    framing.is_kept_alive = framing.is_kept_alive || choice.find("keep-alive") != std::string::npos;
  } else if (name == "host") {
    ++framing.hosts;
  } else if (name == "x-request-id") {
    framing.request_ids.emplace_back(value);
  } else if (name == "traceparent") {
    framing.traceparents.emplace_back(value);
  } else if (name == "origin") {
    framing.origins.emplace_back(value);
  } else if (name == "idempotency-key") {
    framing.idempotency_keys.emplace_back(value);
  }
  if (std::ranges::find(fields_in_use, name) == fields_in_use.end()) return std::nullopt;
  const std::string written = name + ": " + with_percent_encoded(value) + "\r\n";
  if (written.size() > max_line_bytes) return headers_too_large(max_line_bytes);
  text += written;
  return std::nullopt;
}

/// The path and query of a target in any form that RFC 9112 has for an origin server.
std::string_view origin_form(std::string_view target) {
  constexpr std::string_view scheme = "http://";
  if (lower_case(target.substr(0, scheme.size())) != scheme) return target;
  const std::size_t slash = target.find('/', scheme.size());
  return slash == std::string_view::npos ? "/" : target.substr(slash);
}

std::optional<api::Problem> check_line(std::string_view method, std::string_view target, std::string_view version) {
  if (!is_token(method)) return bad_request("the request line is malformed");
  if (!version.starts_with("HTTP/")) return bad_request("the request line is malformed");
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return version_not_supported();
  if (!is_clean(target, false) || (!target.starts_with('/') && target != "*"))
    return bad_request("the request target is malformed");
  if (std::find(known_methods.begin(), known_methods.end(), method) == known_methods.end())
    return not_implemented("the method is not known");
  if (target.substr(0, target.find('?')).size() > max_path_bytes) return uri_too_long(max_path_bytes);
  if (target.size() > max_target_bytes) return uri_too_long(max_target_bytes);
  return std::nullopt;
}

/// Reads the line and the fields into `checked`, until something is wrong.
std::optional<api::Problem> read_head(std::string_view head, std::size_t max_body_bytes, RequestHead& checked) {
  const auto next_line = [&]() -> std::optional<std::string_view> {
    const std::size_t end = head.find("\r\n");
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(end + 2);
    return line;
  };
  const std::string_view first = next_line().value_or("");
  const std::size_t first_space = first.find(' '), last_space = first.rfind(' ');
  if (first_space == std::string_view::npos || first_space == last_space)
    return bad_request("the request line is malformed");
  const std::string_view method = first.substr(0, first_space), version = first.substr(last_space + 1);
  const std::string_view target = origin_form(first.substr(first_space + 1, last_space - first_space - 1));
  if (auto problem = check_line(method, target, version)) return problem;
  checked.method = method;
  checked.target = target;

  checked.text.append(method).append(" ").append(target).append(" ").append(version).append("\r\n");
  Framing framing;
  while (const std::optional<std::string_view> line = next_line()) {
    if (line->empty()) break;
    if (auto problem = read_field(*line, framing, checked.text)) return problem;
  }
  checked.text += "\r\n";
  checked.request_id = only(framing.request_ids);
  checked.traceparent = only(framing.traceparents);
  checked.origin = only(framing.origins);

  if (framing.hosts > 1 || (framing.hosts == 0 && version == "HTTP/1.1"))
    return bad_request("the request needs one Host field");
  if (framing.has_transfer_encoding) {
    if (framing.content_length) return bad_request("Transfer-Encoding and Content-Length exclude each other");
    return length_required();
  }
  if (framing.has_content_encoding) return unsupported_media_type("compressed bodies are not accepted");
  if (framing.content_length > max_body_bytes) return body_too_large(max_body_bytes);
  // The library keeps no empty field, and the first of many.
  const auto& keys = framing.idempotency_keys;
  if (method == "POST" && !keys.empty() && (keys.size() > 1 || keys.front().empty()))
    return bad_parameter("Idempotency-Key must be one key of 1 to 255 printable ASCII characters");
  checked.body_bytes = framing.content_length.value_or(0);
  const bool is_body_usual = method == "POST" || method == "PUT" || method == "PATCH";
  checked.is_last = framing.is_close_asked || (version == "HTTP/1.0" && !framing.is_kept_alive) ||
                    (is_body_usual && !framing.content_length);
  return std::nullopt;
}

}  // namespace

RequestHead check_head(std::string_view head, std::size_t max_body_bytes) {
  RequestHead checked;
  checked.problem = read_head(head, max_body_bytes, checked);
  return checked;
}

}  // namespace penumbra::http
