#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace penumbra::access {

/// What stands in an address for a key, where a browser cannot send a header: names the key and the moment it ends,
/// signed with a secret that lives as long as this object (HMAC, RFC 2104, with SHA-256). Nothing is kept of one;
/// whoever reads it asks whether the key is there still. May be shared between threads.
class Tokens {
 public:
  /// That no change of the time of day stretches.
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds lifetime{600};

  Tokens();

  /// A token of this key until `now` + lifetime: at most 200 letters, digits, dots and underscores.
  std::string make(std::string_view key_id, Clock::time_point now) const;
  /// The key's id; nothing when the token has ended or is none of these.
  std::optional<std::string> key_id_of(std::string_view token, Clock::time_point now) const;

 private:
  std::string signed_text(std::string_view text) const;

  const std::string secret_;
};

}  // namespace penumbra::access
