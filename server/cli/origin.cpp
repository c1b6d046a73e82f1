#include "server/cli/origin.h"

#include <algorithm>
#include <charconv>

namespace penumbra::cli {

namespace {

bool consists_of(std::string_view text, std::string_view more) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || more.find(c) != std::string_view::npos;
  });
}

bool is_host(std::string_view text) {
  if (text.starts_with('[') && text.ends_with(']')) return consists_of(text.substr(1, text.size() - 2), ":.");
  return consists_of(text, "-._");
}

}  // namespace

std::optional<std::string> origin_of(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  const std::string_view address = lower;
  const std::size_t colon = address.find("://");
  if (colon == std::string_view::npos) return std::nullopt;
  const std::string_view scheme = address.substr(0, colon), after = address.substr(colon + 3);
  std::string_view host = after.substr(0, after.find_first_of("/?#"));
  std::string_view port;
  const std::size_t place = host.rfind(':');
  if (place != std::string_view::npos && host.find(']', place) == std::string_view::npos) {
    port = host.substr(place + 1);
    host = host.substr(0, place);
  }
  int number = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  const bool is_port = port.empty() || (error == std::errc() && end == port.data() + port.size() && number <= 65'535);
  if (!consists_of(scheme, "+-.") || !is_host(host) || !is_port || number < 0) return std::nullopt;
  const bool is_implied = port.empty() || (scheme == "http" && number == 80) || (scheme == "https" && number == 443);
  return std::string(scheme) + "://" + std::string(host) + (is_implied ? "" : ":" + std::to_string(number));
}

}  // namespace penumbra::cli
