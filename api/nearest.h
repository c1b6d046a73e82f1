#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace penumbra::api {

/// Of `words` the one that was probably meant by `written`: with the fewest letters to add, drop, change or swap with a
/// neighbour (optimal string alignment distance), and at most a third of them; the first of equals. Capitals and signs
/// between words count as no change.
std::optional<std::string_view> nearest(std::string_view written, std::span<const std::string_view> words);

/// `; did you mean WORD?` in quotes, or nothing.
std::string did_you_mean(std::string_view written, std::span<const std::string_view> words);

}  // namespace penumbra::api
