#include "server/http/fields.h"

namespace penumbra::http {

namespace {

constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool are_equal_in_any_case(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, {}, lower, lower);
}

constexpr bool are_rules_in_order() {
  for (std::size_t i = 0; i < field_count; ++i) {
    if (field_rules[i].field != static_cast<Field>(i)) return false;
  }
  return true;
}
static_assert(are_rules_in_order());

}  // namespace

bool FieldValues::add(std::string_view name, std::string_view value) {
  for (std::size_t i = 0; i < field_count; ++i) {
    if (!are_equal_in_any_case(field_rules[i].name, name)) continue;
    if (!is_said_[i]) {
      values_[i] = value;
    } else if (field_rules[i].lines == Lines::one_list) {
      values_[i]->append(", ").append(value);
    } else {
      values_[i].reset();
      if (field_rules[i].lines == Lines::refused) return false;
    }
    is_said_[i] = true;
  }
  return true;
}

bool has_member(std::string_view list, std::string_view wanted) {
  return any_member(list, [&](std::string_view member) { return are_equal_in_any_case(member, wanted); });
}

std::string fields_of_pages() {
  std::string names;
  for (const FieldRule& rule : field_rules) {
    if (rule.may_pages_send) names.append(names.empty() ? "" : ", ").append(rule.name);
  }
  return names;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), lower);
  return result;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace penumbra::http
