#include "server/http/host.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>

#include "server/http/message.h"

namespace penumbra::http {

namespace {

bool is_port(std::string_view text) {
  return text.size() <= 5 && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

/// Unreserved characters, percent signs and sub-delims (RFC 3986, 3.2.2).
bool is_registered_name(std::string_view text) {
  constexpr std::string_view marks = "-._~%!$&'()*+,;=";
  return !text.empty() && std::ranges::all_of(text, [&](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || marks.find(c) != std::string_view::npos;
  });
}

bool is_v4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

bool is_v6(const std::string& text) {
  in6_addr address{};
  return inet_pton(AF_INET6, text.c_str(), &address) == 1;
}

}  // namespace

std::optional<std::string> host_in(std::string_view authority) {
  const bool is_bracketed = authority.starts_with('[');
  const std::size_t end = is_bracketed ? authority.find(']') : std::min(authority.find(':'), authority.size());
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view rest = authority.substr(is_bracketed ? end + 1 : end);
  if (!rest.empty() && (!rest.starts_with(':') || !is_port(rest.substr(1)))) return std::nullopt;
  std::string host = lower_case(is_bracketed ? authority.substr(1, end - 1) : authority.substr(0, end));
  if (!(is_bracketed ? is_v6(host) : is_registered_name(host))) return std::nullopt;
  return host;
}

bool is_loopback(const std::string& host) {
  if (host == "localhost" || host.ends_with(".localhost")) return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && std::memcmp(&v6, &in6addr_loopback, sizeof v6) == 0;
}

bool KnownHosts::has(const std::string& host) const {
  return is_loopback(host) || (is_public_ && (is_v4(host) || is_v6(host))) ||
         std::ranges::find(names_, host) != names_.end();
}

}  // namespace penumbra::http
