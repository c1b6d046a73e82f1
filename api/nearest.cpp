#include "api/nearest.h"

#include <algorithm>
#include <vector>

namespace penumbra::api {

namespace {

constexpr std::size_t longest_known = 64;  // nobody means a word by a longer one

/// In lower case, - and _ and spaces left out.
std::string plain(std::string_view word) {
  std::string result;
  for (const char c : word) {
    if (c != '-' && c != '_' && c != ' ') result += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return result;
}

std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last, last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last = last;
    last = row;
  }
  return last.back();
}

}  // namespace

std::optional<std::string_view> nearest(std::string_view written, std::span<const std::string_view> words) {
  if (written.size() > longest_known) return std::nullopt;
  const std::string meant = plain(written);
  std::optional<std::string_view> found;
  std::size_t least = std::max<std::size_t>(1, meant.size() / 3) + 1;
  for (const std::string_view word : words) {
    const std::size_t edits = distance(meant, plain(word));
    if (edits >= least || edits >= meant.size()) continue;
    least = edits;
    found = word;
  }
  return found;
}

std::string did_you_mean(std::string_view written, std::span<const std::string_view> words) {
  const std::optional<std::string_view> word = nearest(written, words);
  return word ? "; did you mean \"" + std::string(*word) + "\"?" : "";
}

}  // namespace penumbra::api
