#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra::http {

/// The host of an authority such as example.org:8080 or [::1]:8080 (RFC 3986, 3.2) in lower case, an IPv6 address
/// without brackets; nothing when it is malformed.
std::optional<std::string> host_in(std::string_view authority);

/// Whether only this machine can be meant: 127.0.0.0/8, ::1, localhost or a name below it (RFC 6761, 6.3).
bool is_loopback(const std::string& host);

/// The hosts that a server answers for. A browser lets a page of any site ask the site's own name, and that name may
/// lead to this machine; without keys, the name is what tells such a page from a user.
class KnownHosts {
 public:
  /// Loopback and these, in lower case; where others can reach the server also every address, for no site has those.
  KnownHosts(std::vector<std::string> names, bool is_public) : names_(std::move(names)), is_public_(is_public) {}
  bool has(const std::string& host) const;

 private:
  std::vector<std::string> names_;
  bool is_public_;
};

}  // namespace penumbra::http
