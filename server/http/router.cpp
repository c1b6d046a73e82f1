#include "server/http/router.h"

#include <algorithm>
#include <optional>

namespace penumbra::http {

namespace {

constexpr std::string_view id_segment = "{id}";
constexpr std::size_t max_id_bytes = 64;

bool is_id(std::string_view text) {
  return !text.empty() && text.size() <= max_id_bytes && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
  });
}

/// The id, empty when the pattern has none; nothing when the path does not match.
std::optional<std::string_view> match(std::string_view pattern, std::string_view path) {
  const std::size_t place = pattern.find(id_segment);
  if (place == std::string_view::npos) return pattern == path ? std::optional(std::string_view()) : std::nullopt;
  const std::string_view before = pattern.substr(0, place), after = pattern.substr(place + id_segment.size());
  if (path.size() <= before.size() + after.size() || !path.starts_with(before) || !path.ends_with(after))
    return std::nullopt;
  const std::string_view id = path.substr(before.size(), path.size() - before.size() - after.size());
  return is_id(id) ? std::optional(id) : std::nullopt;
}

}  // namespace

Router::Match Router::find(std::string_view method, std::string_view path) const {
  Match found;
  for (const Route& route : routes_) {
    const std::optional<std::string_view> id = match(route.path, path);
    if (!id) continue;
    found.name = route.name.empty() ? route.path : route.name;
    found.allowed.push_back(route.method);
    if (route.method != method) continue;
    found.route = &route;
    found.id = *id;
  }
  return found;
}

}  // namespace penumbra::http
