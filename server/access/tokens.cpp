#include "server/access/tokens.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <sys/random.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <system_error>

namespace penumbra::access {

namespace {

constexpr std::string_view token_prefix = "rt_";
constexpr std::size_t secret_bytes = 32, longest = 200;

std::string random_bytes(std::size_t count) {
  std::string bytes(count, '\0');
  if (getrandom(bytes.data(), count, 0) != static_cast<ssize_t>(count))
    throw std::system_error(errno, std::generic_category(), "getrandom");
  return bytes;
}

std::int64_t milliseconds_of(Tokens::Clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

}  // namespace

Tokens::Tokens() : secret_(random_bytes(secret_bytes)) {}

/// `text`, a dot and its signature in hexadecimal.
std::string Tokens::signed_text(std::string_view text) const {
  std::array<unsigned char, EVP_MAX_MD_SIZE> mac{};
  unsigned int size = 0;
  HMAC(EVP_sha256(), secret_.data(), static_cast<int>(secret_.size()),
       reinterpret_cast<const unsigned char*>(text.data()), text.size(), mac.data(), &size);
  std::string result(text);
  result += '.';
  for (unsigned int i = 0; i < size; ++i) {
    result += "0123456789abcdef"[mac[i] >> 4];
    result += "0123456789abcdef"[mac[i] & 15];
  }
  return result;
}

std::string Tokens::make(std::string_view key_id, Clock::time_point now) const {
  return signed_text(std::string(token_prefix) + std::string(key_id) + "." +
                     std::to_string(milliseconds_of(now + lifetime)));
}

std::optional<std::string> Tokens::key_id_of(std::string_view token, Clock::time_point now) const {
  const std::size_t signature = token.rfind('.');
  if (token.size() > longest || !token.starts_with(token_prefix) || signature == std::string_view::npos)
    return std::nullopt;
  const std::string_view text = token.substr(0, signature);
  const std::string right = signed_text(text);
  if (right.size() != token.size() || CRYPTO_memcmp(right.data(), token.data(), right.size()) != 0) return std::nullopt;
  const std::size_t dot = text.rfind('.');  // it is ours: the rest has the form that `make` gave it
  std::int64_t end = 0;
  std::from_chars(text.data() + dot + 1, text.data() + text.size(), end);
  if (milliseconds_of(now) >= end) return std::nullopt;
  return std::string(text.substr(token_prefix.size(), dot - token_prefix.size()));
}

}  // namespace penumbra::access
