#include "server/http/request_head.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "api/problems.h"
#include "server/http/host.h"

namespace penumbra::http {

namespace {

constexpr std::array<std::string_view, 8> known_methods{"GET",    "HEAD",  "POST",  "PUT",
                                                        "DELETE", "PATCH", "TRACE", "OPTIONS"};
constexpr std::size_t max_method_bytes = 32;

bool is_token_character(char c) {
  constexpr std::string_view marks = "!#$%&'*+-.^_`|~";
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         marks.find(c) != std::string_view::npos;
}

bool is_token(std::string_view text) { return !text.empty() && std::ranges::all_of(text, is_token_character); }

/// No control characters; `is_space_allowed` for field values.
bool is_clean(std::string_view text, bool is_space_allowed) {
  return std::all_of(text.begin(), text.end(), [&](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return is_space_allowed ? (byte >= 0x20 || c == '\t') && byte != 0x7f : byte > 0x20 && byte != 0x7f;
  });
}

std::optional<api::Problem> read_field(std::string_view line, FieldValues& fields) {
  const std::size_t colon = line.find(':');
  const std::string_view name = line.substr(0, colon);
  if (colon == std::string_view::npos || !is_token(name)) return api::bad_request("a header field has no name");
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (!is_clean(value, true)) return api::bad_request("a header field has control characters");
  if (!fields.add(name, value)) return api::bad_request("the header field " + lower_case(name) + " is there twice");
  return std::nullopt;
}

/// A request target in the form of origin servers, and the authority of one that has it (RFC 9112, 3.2).
struct Target {
  std::string text;
  std::optional<std::string_view> authority;
};

Target target_of(std::string_view text) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (lower_case(text.substr(0, scheme.size())) != scheme) continue;
    const std::size_t end = std::min(text.find_first_of("/?", scheme.size()), text.size());
    const std::string_view rest = text.substr(end);
    return {(rest.starts_with('/') ? "" : "/") + std::string(rest), text.substr(scheme.size(), end - scheme.size())};
  }
  return {std::string(text), std::nullopt};
}

std::optional<api::Problem> check_line(std::string_view method, std::string_view target, std::string_view version) {
  if (!is_token(method)) return api::bad_request("the request line is malformed");
  if (!version.starts_with("HTTP/")) return api::bad_request("the request line is malformed");
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return api::version_not_supported();
  if (!is_clean(target, false) || (!target.starts_with('/') && target != "*"))
    return api::bad_request("the request target is malformed");
  if (std::find(known_methods.begin(), known_methods.end(), method) == known_methods.end())
    return api::not_implemented("the method is not known");
  if (target.substr(0, target.find('?')).size() > max_path_bytes) return api::uri_too_long(max_path_bytes);
  if (target.size() > max_target_bytes) return api::uri_too_long(max_target_bytes);
  return std::nullopt;
}

/// Whom the request is for. That of an absolute target counts instead of the field (RFC 9112, 3.2.2).
std::optional<api::Problem> read_host(const Target& target, RequestHead& checked) {
  const std::optional<std::string_view> field = checked.fields[Field::host];
  if (!field && checked.is_interim_known) return api::bad_request("the request needs one Host field");
  std::optional<std::string> host;
  for (const std::optional<std::string_view> authority : {field, target.authority}) {
    if (!authority) continue;
    host = host_in(*authority);
    if (!host) return api::bad_request("the host of the request is malformed");
  }
  checked.host = host.value_or("");
  return std::nullopt;
}

/// How the body is framed and coded.
std::optional<api::Problem> read_body_fields(std::size_t max_body_bytes, RequestHead& checked) {
  const std::optional<std::string_view> length = checked.fields[Field::content_length];
  if (checked.fields[Field::transfer_encoding]) {
    if (length) return api::bad_request("Transfer-Encoding and Content-Length exclude each other");
    return api::length_required();
  }
  if (length) {
    const auto [end, error] = std::from_chars(length->data(), length->data() + length->size(), checked.body_bytes);
    if (error != std::errc() || end != length->data() + length->size())
      return api::bad_request("the Content-Length is not one number");
  }
  int codings = 0;
  const bool is_coding_unknown =
      any_member(checked.fields[Field::content_encoding].value_or(""), [&](std::string_view member) {
        const std::string coding = lower_case(member);
        if (coding == "identity") return false;
        checked.is_body_gzip = coding == "gzip" || coding == "x-gzip";
        return !checked.is_body_gzip || ++codings > 1;
      });
  if (is_coding_unknown) return api::unsupported_media_type("of Content-Encoding, gzip is known, once");
  if (checked.body_bytes > max_body_bytes) return api::body_too_large(checked.body_bytes, max_body_bytes);
  return std::nullopt;
}

std::optional<std::string_view> next_line(std::string_view& head) {
  const std::size_t end = head.find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  std::string_view line = head.substr(0, end);
  if (line.ends_with('\r')) line.remove_suffix(1);
  head.remove_prefix(end + 1);
  return line;
}

/// The head as the library reads it. Whoever may not know an interim answer gets none, nor who sends no body.
std::string text_for_library(const RequestHead& checked, std::string_view version) {
  std::string text = checked.method + " " + checked.target + " " + std::string(version) + "\r\n";
  if (checked.fields[Field::content_length]) text += "Content-Length: " + std::to_string(checked.body_bytes) + "\r\n";
  if (checked.is_interim_known && checked.body_bytes > 0 &&
      has_member(checked.fields[Field::expect].value_or(""), "100-continue"))
    text += "Expect: 100-continue\r\n";
  return text + "\r\n";
}

/// Reads the line and the fields into `checked`, until something is wrong.
std::optional<api::Problem> read_head(std::string_view head, std::size_t max_body_bytes, RequestHead& checked) {
  const std::string_view first = next_line(head).value_or("");
  const std::size_t first_space = first.find(' '), last_space = first.rfind(' ');
  if (first_space == std::string_view::npos || first_space == last_space)
    return api::bad_request("the request line is malformed");
  const std::string_view method = first.substr(0, first_space), version = first.substr(last_space + 1);
  const Target target = target_of(first.substr(first_space + 1, last_space - first_space - 1));
  if (auto problem = check_line(method, target.text, version)) return problem;
  checked.method = method;
  checked.target = target.text;
  checked.is_interim_known = version == "HTTP/1.1";

  while (const std::optional<std::string_view> line = next_line(head)) {
    if (line->empty()) break;
    if (auto problem = read_field(*line, checked.fields)) return problem;
  }
  if (auto problem = read_host(target, checked)) return problem;
  if (auto problem = read_body_fields(max_body_bytes, checked)) return problem;
  checked.text = text_for_library(checked, version);
  const std::string_view connection = checked.fields[Field::connection].value_or("");
  const bool is_body_usual = method == "POST" || method == "PUT" || method == "PATCH";
  checked.is_last = has_member(connection, "close") ||
                    (!checked.is_interim_known && !has_member(connection, "keep-alive")) ||
                    (is_body_usual && !checked.fields[Field::content_length]);
  return std::nullopt;
}

}  // namespace

RequestHead check_head(std::string_view head, std::size_t max_body_bytes) {
  RequestHead checked;
  checked.problem = read_head(head, max_body_bytes, checked);
  return checked;
}

std::size_t end_of_head(std::string_view text, std::size_t from) {
  for (std::size_t end = text.find('\n', from); end != std::string_view::npos; end = text.find('\n', end + 1)) {
    const std::string_view rest = text.substr(end + 1, 2);
    if (rest.starts_with('\n')) return end + 2;
    if (rest == "\r\n") return end + 3;
  }
  return std::string_view::npos;
}

bool may_be_request(std::string_view begin) {
  const std::string_view method = begin.substr(0, begin.find(' '));
  return method.size() <= max_method_bytes && std::ranges::all_of(method, is_token_character);
}

}  // namespace penumbra::http
