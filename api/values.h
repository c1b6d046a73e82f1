#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "api/fields.h"
#include "engine/math/affine.h"
#include "engine/math/color.h"
#include "engine/math/vec3.h"

namespace penumbra::api {

/// Every number of a scene keeps to this, so that products of a few of them stay finite.
inline constexpr double largest_magnitude = 1e100;
/// What must be greater than 0 is at least this, so that its square does not vanish.
inline constexpr double smallest_positive = 1e-100;

/// Coordinates of points, and lengths that are not zero: beyond these, products of eight of them – which soft shadows
/// take – leave the range of double.
inline constexpr double largest_length = 1e30, smallest_length = 1e-30;

/// Which numbers are allowed; the bounds belong to it unless they are said to be open.
struct Range {
  double lower = -largest_magnitude, upper = largest_magnitude;
  bool is_lower_open = false, is_upper_open = false;
  bool or_zero = false;
};

inline constexpr Range any_number{};
inline constexpr Range not_negative{0};
inline constexpr Range positive{smallest_positive};
inline constexpr Range coordinate{-largest_length, largest_length};
inline constexpr Range any_length{smallest_length, largest_length};
inline constexpr Range length_or_zero{smallest_length, largest_length, false, false, true};

/// Readers: each returns the value, or reports what is wrong and returns nothing.
std::optional<double> read_number(const Field& field, const Range& range = any_number);
/// 3.0 is an integer, 3.5 is not.
std::optional<int> read_integer(const Field& field, int lower, int upper);
std::optional<std::uint64_t> read_unsigned(const Field& field);
std::optional<bool> read_boolean(const Field& field);
std::optional<std::string_view> read_string(const Field& field);
/// Exactly `count` numbers.
std::optional<std::array<double, 3>> read_three(const Field& field, const Range& range = any_number);
std::optional<math::Vec3> read_point(const Field& field);
/// A vector that is not zero, whose length does not matter.
std::optional<math::Vec3> read_direction(const Field& field);
/// A vector whose length does matter.
std::optional<math::Vec3> read_edge(const Field& field);
/// [r, g, b] or one number for grey; each from 0 to `upper`.
std::optional<math::Color> read_color(const Field& field, double upper = largest_magnitude);
/// 16 numbers, column-major, affine (to rounding) and invertible.
std::optional<math::Affine> read_transform(const Field& field);

/// Whether `transform` can be inverted without losing more than 12 of a double's 16 digits.
bool is_invertible(const math::Affine& transform);

/// The sine of the angle between two vectors that are not zero.
double sine_between(const math::Vec3& a, const math::Vec3& b);

/// The same readers as values, for Members.
inline auto number_in(const Range& range) {
  return [range](const Field& field) { return read_number(field, range); };
}
inline auto integer_in(int lower, int upper) {
  return [lower, upper](const Field& field) { return read_integer(field, lower, upper); };
}
inline auto color_up_to(double upper) {
  return [upper](const Field& field) { return read_color(field, upper); };
}
inline std::optional<math::Color> read_any_color(const Field& field) { return read_color(field); }

/// The index of the given text among `names`, as one of the consecutive values of an enumeration.
std::optional<std::size_t> read_choice(const Field& field, std::span<const std::string_view> names);

template <class Enumeration, std::size_t count>
auto one_of(const std::array<std::pair<std::string_view, Enumeration>, count>& choices) {
  return [choices](const Field& field) -> std::optional<Enumeration> {
    std::array<std::string_view, count> names;
    for (std::size_t i = 0; i < count; ++i) names[i] = choices[i].first;
    const std::optional<std::size_t> index = read_choice(field, names);
    if (!index) return std::nullopt;
    return choices[*index].second;
  };
}

/// Calls read(field) for every element of `array` until the errors are full; reports a field that is no array.
template <class Read>
void for_each_element(const Field& array, const Read& read) {
  if (!array.is_array()) return array.fail("must be an array");
  std::size_t index = 0;
  for (const JsonView element : array.value()) {
    if (array.errors().is_full()) return;
    read(Field(array, index++, element));
  }
}

}  // namespace penumbra::api
