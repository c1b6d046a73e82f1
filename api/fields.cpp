#include "api/fields.h"

#include <algorithm>

#include "api/json_pointer.h"
#include "api/nearest.h"

namespace penumbra::api {

void ErrorList::add(std::string pointer, std::string detail) {
  if (!is_full()) errors_.push_back({std::move(pointer), std::move(detail)});
}

std::string step_to(const Field& field) {
  return pointer_step(field.parent_->is_array() ? std::string_view(std::to_string(field.index_)) : field.name_);
}

std::string Field::pointer() const {
  std::vector<const Field*> inside;
  for (const Field* field = this; field->parent_ != nullptr; field = field->parent_) inside.push_back(field);
  std::string result;
  for (auto field = inside.rbegin(); field != inside.rend(); ++field) result += step_to(**field);
  return result;
}

void Field::fail_at(std::string_view step, std::string detail) const {
  errors_->add(pointer() + pointer_step(step), std::move(detail));
}

Members::Members(const Field& object) : object_(object), is_object_(object.is_object()) {
  if (!is_object_) object.fail("must be an object");
}

std::optional<Field> Members::optional(std::string_view name) {
  known_.push_back(name);
  if (!is_object_) return std::nullopt;
  for (const JsonView member : object_.value()) {
    if (member.key() == name) return Field(object_, name, member);
  }
  return std::nullopt;
}

std::optional<Field> Members::required(std::string_view name) {
  std::optional<Field> field = optional(name);
  if (is_object_ && !field) object_.fail_at(name, "is required");
  return field;
}

void Members::refuse_unknown() const {
  if (!is_object_) return;
  for (const JsonView member : object_.value()) {
    if (object_.errors().is_full()) return;
    if (std::find(known_.begin(), known_.end(), member.key()) != known_.end()) continue;
    object_.fail_at(member.key(), "is not a known field" + did_you_mean(member.key(), known_));
  }
}

std::string quoted(std::string_view text) {
  constexpr std::size_t longest = 40;
  std::string result(1, '"');
  if (text.size() <= longest) return result.append(text).append(1, '"');
  std::size_t end = longest;
  // Not within a character: its later bytes begin with the bits 10.
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return result.append(text.substr(0, end)).append("…\"");
}

}  // namespace penumbra::api
