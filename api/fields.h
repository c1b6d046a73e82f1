#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/json_document.h"
#include "api/problem.h"

namespace penumbra::api {

/// The errors of one body, in the order they were found; those beyond the hundredth are dropped.
class ErrorList {
 public:
  void add(std::string pointer, std::string detail);
  bool is_empty() const { return errors_.empty(); }
  bool is_full() const { return errors_.size() == max_field_errors; }
  const std::vector<FieldError>& all() const { return errors_; }

 private:
  std::vector<FieldError> errors_;
};

/// A JSON value, where it is, and where its errors go. The field it lies in must outlive it.
class Field {
 public:
  /// The whole body.
  Field(JsonView value, ErrorList& errors) : value_(value), errors_(&errors) {}
  /// The member `name` of `parent`; `name` must outlive the field.
  Field(const Field& parent, std::string_view name, JsonView value)
      : value_(value), errors_(parent.errors_), parent_(&parent), name_(name) {}
  /// Element `index` of `parent`.
  Field(const Field& parent, std::size_t index, JsonView value)
      : value_(value), errors_(parent.errors_), parent_(&parent), index_(index) {}

  const JsonView& value() const { return value_; }
  /// RFC 6901.
  std::string pointer() const;
  void fail(std::string detail) const { errors_->add(pointer(), std::move(detail)); }
  /// For what is wrong with, or missing from, a member or an element: `step` below this field.
  void fail_at(std::string_view step, std::string detail) const;
  ErrorList& errors() const { return *errors_; }

  bool is_object() const { return value_.kind() == JsonKind::object; }
  bool is_array() const { return value_.kind() == JsonKind::array; }
  bool is_number() const { return value_.kind() == JsonKind::number; }
  bool is_string() const { return value_.kind() == JsonKind::string; }

 private:
  JsonView value_;
  ErrorList* errors_;
  const Field* parent_ = nullptr;
  std::string_view name_;
  std::size_t index_ = 0;
  friend std::string step_to(const Field& field);
};

/// The members of an object by name. Every name asked for becomes a known one; `refuse_unknown` reports the rest. A
/// field that is no object is reported at once and then has no members and lacks none. `object` must outlive this.
class Members {
 public:
  explicit Members(const Field& object);

  /// False when the field was no object.
  bool is_object() const { return is_object_; }
  const Field& object() const { return object_; }

  std::optional<Field> optional(std::string_view name);
  /// Reports a missing member.
  std::optional<Field> required(std::string_view name);

  /// What `read` makes of a member, which is nothing when it is missing or wrong; both are reported.
  template <class Read>
  auto required(std::string_view name, const Read& read) {
    const std::optional<Field> field = required(name);
    return field ? read(*field) : decltype(read(*field)){};
  }
  /// What `read` makes of a member, or `fallback` when it is missing or wrong; the latter is reported.
  template <class Read, class Value>
  Value optional(std::string_view name, const Read& read, Value fallback) {
    const std::optional<Field> field = optional(name);
    if (!field) return fallback;
    return read(*field).value_or(std::move(fallback));
  }

  void refuse_unknown() const;

 private:
  const Field& object_;
  bool is_object_;
  std::vector<std::string_view> known_;
};

/// `text` in double quotes for a message: at most 40 bytes of it.
std::string quoted(std::string_view text);

}  // namespace penumbra::api
