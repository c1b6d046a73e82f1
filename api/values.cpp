#include "api/values.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace penumbra::api {

namespace {

using math::Vec3;

std::string text_of(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.15g", value);
  return buffer.data();
}

/// What is wrong with `value`; empty when nothing is.
std::string complaint(double value, const Range& range) {
  if (!(value <= largest_magnitude && value >= -largest_magnitude)) {
    return "must not be larger than 1e100 in magnitude";
  }
  if (range.or_zero && value == 0) return {};
  if (range.or_zero && value < range.lower) return "must be 0, or at least " + text_of(range.lower);
  if (range.lower > 0 && value <= 0) return "must be greater than 0";
  if (value < range.lower || (range.is_lower_open && value == range.lower))
    return (range.is_lower_open ? "must be greater than " : "must be at least ") + text_of(range.lower);
  if (value > range.upper || (range.is_upper_open && value == range.upper))
    return (range.is_upper_open ? "must be less than " : "must be at most ") + text_of(range.upper);
  return {};
}

double norm(const math::Affine& a) {
  return std::hypot(math::length(a.column[0]), math::length(a.column[1]), math::length(a.column[2]));
}

/// Exactly `count` numbers, in order.
template <std::size_t count>
std::optional<std::array<double, count>> read_numbers(const Field& field, const Range& range,
                                                      const std::string& expected) {
  if (!field.is_array() || field.value().size() != count) {
    field.fail("must be " + expected);
    return std::nullopt;
  }
  std::array<double, count> values{};
  std::size_t next = 0;
  bool is_valid = true;
  for_each_element(field, [&](const Field& element) {
    const std::optional<double> value = read_number(element, range);
    is_valid = is_valid && value.has_value();
    values[next++] = value.value_or(0);
  });
  if (!is_valid || next != count) return std::nullopt;
  return values;
}

}  // namespace

std::optional<double> read_number(const Field& field, const Range& range) {
  if (!field.is_number()) {
    field.fail("must be a number");
    return std::nullopt;
  }
  const double value = field.value().number();
  const std::string wrong = complaint(value, range);
  if (wrong.empty()) return value;
  field.fail(wrong);
  return std::nullopt;
}

std::optional<int> read_integer(const Field& field, int lower, int upper) {
  if (!field.is_number() || field.value().number() != std::floor(field.value().number())) {
    field.fail("must be an integer");
    return std::nullopt;
  }
  const double value = field.value().number();
  if (value < lower || value > upper) {
    field.fail("must be an integer from " + std::to_string(lower) + " to " + std::to_string(upper));
    return std::nullopt;
  }
  return static_cast<int>(value);
}

std::optional<std::uint64_t> read_unsigned(const Field& field) {
  if (field.is_number()) {
    if (const std::optional<std::uint64_t> value = field.value().unsigned_integer()) return value;
  }
  field.fail("must be an integer from 0 to 18446744073709551615");
  return std::nullopt;
}

std::optional<bool> read_boolean(const Field& field) {
  if (field.value().kind() == JsonKind::boolean) return field.value().boolean();
  field.fail("must be true or false");
  return std::nullopt;
}

std::optional<std::string_view> read_string(const Field& field) {
  if (field.is_string()) return field.value().string();
  field.fail("must be a string");
  return std::nullopt;
}

std::optional<std::array<double, 3>> read_three(const Field& field, const Range& range) {
  return read_numbers<3>(field, range, "an array of 3 numbers");
}

namespace {

std::optional<Vec3> read_vector(const Field& field, const Range& range) {
  const auto values = read_three(field, range);
  if (!values) return std::nullopt;
  return Vec3{(*values)[0], (*values)[1], (*values)[2]};
}

}  // namespace

std::optional<Vec3> read_point(const Field& field) { return read_vector(field, coordinate); }

std::optional<Vec3> read_direction(const Field& field) {
  const std::optional<Vec3> vector = read_vector(field, any_number);
  if (vector && *vector == Vec3{}) {
    field.fail("must not be zero");
    return std::nullopt;
  }
  return vector;
}

std::optional<Vec3> read_edge(const Field& field) {
  const std::optional<Vec3> vector = read_vector(field, coordinate);
  if (vector && math::length(*vector) < smallest_length) {
    field.fail(*vector == Vec3{} ? "must not be zero" : "must not be shorter than 1e-30");
    return std::nullopt;
  }
  return vector;
}

std::optional<math::Color> read_color(const Field& field, double upper) {
  const Range range{0, upper};
  if (field.is_number()) {
    const std::optional<double> value = read_number(field, range);
    if (!value) return std::nullopt;
    return math::grey(*value);
  }
  const auto values = read_numbers<3>(field, range, "a number or an array of 3 numbers");
  if (!values) return std::nullopt;
  return math::Color{(*values)[0], (*values)[1], (*values)[2]};
}

bool is_invertible(const math::Affine& transform) {
  const double determinant = transform.determinant();
  if (!std::isfinite(determinant) || determinant == 0 || !std::isfinite(1 / determinant)) return false;
  constexpr double largest_condition = 1e12;
  return norm(transform) * norm(math::inverse(transform)) <= largest_condition;
}

std::optional<math::Affine> read_transform(const Field& field) {
  const auto values = read_numbers<16>(field, any_number, "an array of 16 numbers, column-major");
  if (!values) return std::nullopt;
  const std::array<double, 16>& m = *values;
  // Products of matrices, as programs write them, are off by rounding.
  constexpr double rounding = 1e-6;
  const double off = std::max({std::fabs(m[3]), std::fabs(m[7]), std::fabs(m[11])});
  if (off > rounding || m[15] < 1 - rounding || m[15] > 1 + rounding) {
    field.fail("must be affine: elements 3, 7, 11 and 15 must be 0, 0, 0 and 1, to 1e-6");
    return std::nullopt;
  }
  const math::Affine transform{{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}}, {m[12], m[13], m[14]}};
  if (!is_invertible(transform)) {
    field.fail("must be invertible (no scale is 0), with a condition number of at most 1e12");
    return std::nullopt;
  }
  return transform;
}

double sine_between(const Vec3& a, const Vec3& b) {
  return math::length(cross(math::normalize(a), math::normalize(b)));
}

std::optional<std::size_t> read_choice(const Field& field, std::span<const std::string_view> names) {
  if (field.is_string()) {
    const auto found = std::find(names.begin(), names.end(), field.value().string());
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  }
  std::string list;
  for (const std::string_view name : names) {
    if (!list.empty()) list += name == names.back() ? " or " : ", ";
    list += name;
  }
  const std::string given = field.is_string() ? ", not " + quoted(field.value().string()) : "";
  field.fail("must be " + list + given);
  return std::nullopt;
}

}  // namespace penumbra::api
