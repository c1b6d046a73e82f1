#pragma once
#include <optional>
#include <string>

namespace penumbra::cli {

struct Address {
  std::string host;  // an IPv6 address without brackets
  int port = 0;
};

/// Reads HOST:PORT or [IPV6]:PORT; nothing when it is neither.
std::optional<Address> parse_address(const std::string& text);

/// http://HOST:PORT
std::string url_of(const Address& address);

}  // namespace penumbra::cli
