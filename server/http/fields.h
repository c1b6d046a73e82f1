#pragma once
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace penumbra::http {

/// The header fields of requests that this server knows. No others can be asked for, and no others are read.
enum class Field {
  accept_encoding,
  access_control_request_method,
  authorization,
  connection,
  content_encoding,
  content_length,
  content_type,
  expect,
  host,
  idempotency_key,
  if_none_match,
  last_event_id,
  origin,
  traceparent,
  transfer_encoding,
  x_request_id
};
inline constexpr std::size_t field_count = static_cast<std::size_t>(Field::x_request_id) + 1;

/// What it means when a field stands in several lines.
enum class Lines {
  one_list,  // the same as their values with commas between them (RFC 9110, 5.3)
  refused,   // two readers could understand it differently
  absent     // who says two things says nothing
};

struct FieldRule {
  Field field;
  std::string_view name;  // as it is usually written
  Lines lines;
  bool may_pages_send;  // those of other sites, once they are allowed to call (Fetch standard, 4.9)
};

/// In the order of Field.
inline constexpr std::array<FieldRule, field_count> field_rules{{
    {Field::accept_encoding, "Accept-Encoding", Lines::one_list, false},
    {Field::access_control_request_method, "Access-Control-Request-Method", Lines::absent, false},
    {Field::authorization, "Authorization", Lines::refused, true},
    {Field::connection, "Connection", Lines::one_list, false},
    {Field::content_encoding, "Content-Encoding", Lines::one_list, true},
    {Field::content_length, "Content-Length", Lines::refused, false},
    {Field::content_type, "Content-Type", Lines::refused, true},
    {Field::expect, "Expect", Lines::one_list, false},
    {Field::host, "Host", Lines::refused, false},
    {Field::idempotency_key, "Idempotency-Key", Lines::refused, true},
    {Field::if_none_match, "If-None-Match", Lines::one_list, true},
    {Field::last_event_id, "Last-Event-ID", Lines::absent, true},
    {Field::origin, "Origin", Lines::absent, false},
    {Field::traceparent, "traceparent", Lines::absent, true},
    {Field::transfer_encoding, "Transfer-Encoding", Lines::one_list, false},
    {Field::x_request_id, "X-Request-Id", Lines::absent, true},
}};

/// The values of a request's fields.
class FieldValues {
 public:
  std::optional<std::string_view> operator[](Field field) const {
    const std::optional<std::string>& value = values_[static_cast<std::size_t>(field)];
    return value ? std::optional<std::string_view>(*value) : std::nullopt;
  }
  /// Takes up one line of a head. False when there must not be a second one of this name.
  bool add(std::string_view name, std::string_view value);

 private:
  std::array<std::optional<std::string>, field_count> values_;
  std::array<bool, field_count> is_said_{};
};

/// Calls `look` with each member of a comma-separated list, trimmed, none of them empty, until it returns true; returns
/// whether it did. Commas in quotes separate nothing.
template <typename Look>
bool any_member(std::string_view list, const Look& look);

/// Whether the list has this member, in any case.
bool has_member(std::string_view list, std::string_view wanted);

/// What CORS calls Access-Control-Allow-Headers.
std::string fields_of_pages();

/// `text` with A–Z in lower case.
std::string lower_case(std::string_view text);
/// Without spaces and tabs at both ends.
std::string_view trimmed(std::string_view text);

template <typename Look>
bool any_member(std::string_view list, const Look& look) {
  while (!list.empty()) {
    std::size_t end = 0;
    for (bool is_quoted = false; end < list.size() && (is_quoted || list[end] != ','); ++end) {
      if (list[end] == '"') is_quoted = !is_quoted;
    }
    const std::string_view member = trimmed(list.substr(0, end));
    if (!member.empty() && look(member)) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

}  // namespace penumbra::http
