#include "server/access/key.h"

#include <openssl/crypto.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <set>
#include <stdexcept>
#include <system_error>

#include "server/store/sha256.h"

namespace penumbra::access {

namespace {

constexpr std::string_view key_prefix = "rs_", digits = "0123456789abcdefghjkmnpqrstvwxyz";
constexpr std::size_t id_digits = 12, secret_digits = 52, sha256_digits = 64;
constexpr std::array<std::pair<Scope, std::string_view>, 4> scope_names{
    {{Scope::read, "jobs:read"}, {Scope::write, "jobs:write"}, {Scope::metrics, "metrics"}, {Scope::admin, "admin"}}};

std::string random_digits(std::size_t count) {
  std::string text(count, '\0');
  if (getrandom(text.data(), count, 0) != static_cast<ssize_t>(count))
    throw std::system_error(errno, std::generic_category(), "getrandom");
  for (char& c : text) c = digits[static_cast<unsigned char>(c) % digits.size()];
  return text;
}

bool consists_of(std::string_view text, std::string_view characters) {
  return text.find_first_not_of(characters) == std::string_view::npos;
}

std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = text.find_first_not_of(separators);
    if (begin == std::string_view::npos) return words;
    const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    text.remove_prefix(end);
  }
}

template <typename Number>
std::optional<Number> number_of(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 1) return std::nullopt;
  return number;
}

/// Nothing when the line is no key.
std::optional<Key> parse_line(std::string_view line) {
  const std::vector<std::string_view> words = split(line, " \t\r");
  if (words.size() < 4) return std::nullopt;
  Key key{std::string(words[0]), std::string(words[1]), std::string(words[2]), {}, {}, {}};
  if (key.id.size() != id_digits || !consists_of(key.id, digits) || !is_owner(key.owner) ||
      key.sha256.size() != sha256_digits || !consists_of(key.sha256, "0123456789abcdef"))
    return std::nullopt;
  for (const std::string_view name : split(words[3], ",")) {
    const std::optional<Scope> scope = scope_of(name);
    if (!scope) return std::nullopt;
    key.scopes.push_back(*scope);
  }
  for (std::size_t i = 4; i < words.size(); ++i) {
    constexpr std::string_view requests = "requests=", jobs = "jobs=";
    const std::string_view word = words[i];
    if (word.starts_with(requests) && (key.requests_per_minute = number_of<int>(word.substr(requests.size()))))
      continue;
    if (word.starts_with(jobs) && (key.max_jobs = number_of<std::size_t>(word.substr(jobs.size())))) continue;
    return std::nullopt;
  }
  return key;
}

}  // namespace

std::string_view name_of(Scope scope) {
  return std::find_if(scope_names.begin(), scope_names.end(), [&](const auto& s) { return s.first == scope; })->second;
}

std::optional<Scope> scope_of(std::string_view name) {
  for (const auto& [scope, text] : scope_names) {
    if (text == name) return scope;
  }
  return std::nullopt;
}

bool Key::may(Scope scope) const {
  return std::any_of(scopes.begin(), scopes.end(), [&](Scope own) { return own == scope || own == Scope::admin; });
}

NewKey make_key(std::string owner, std::vector<Scope> scopes) {
  const std::string id = random_digits(id_digits);
  std::string text = std::string(key_prefix) + id + "_" + random_digits(secret_digits);
  Key key{id, store::sha256_hex(text), std::move(owner), std::move(scopes), {}, {}};
  return {std::move(key), std::move(text)};
}

std::optional<std::string_view> id_of(std::string_view text) {
  if (text.size() != key_prefix.size() + id_digits + 1 + secret_digits || !text.starts_with(key_prefix) ||
      text[key_prefix.size() + id_digits] != '_')
    return std::nullopt;
  return text.substr(key_prefix.size(), id_digits);
}

bool is_text_of(const Key& key, std::string_view text) {
  const std::string sha256 = store::sha256_hex(text);
  return sha256.size() == key.sha256.size() && CRYPTO_memcmp(sha256.data(), key.sha256.data(), sha256.size()) == 0;
}

bool is_owner(std::string_view text) {
  return !text.empty() && text.size() <= 64 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           std::string_view("._-@+").find(c) != std::string_view::npos;
  });
}

std::string line_of(const Key& key) {
  std::string line = key.id + " " + key.sha256 + " " + key.owner + " ";
  for (std::size_t i = 0; i < key.scopes.size(); ++i) line.append(i > 0 ? "," : "").append(name_of(key.scopes[i]));
  if (key.requests_per_minute) line += " requests=" + std::to_string(*key.requests_per_minute);
  if (key.max_jobs) line += " jobs=" + std::to_string(*key.max_jobs);
  return line;
}

std::vector<Key> parse_keys(std::string_view text) {
  std::vector<Key> keys;
  std::set<std::string> ids;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    std::optional<Key> key = parse_line(line);
    if (!key || !ids.insert(key->id).second)
      throw std::runtime_error("line " + std::to_string(number) + (key ? " repeats an id" : " is no key"));
    keys.push_back(std::move(*key));
  }
  return keys;
}

}  // namespace penumbra::access
