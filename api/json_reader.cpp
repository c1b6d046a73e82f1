#include "api/json_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "api/json_pointer.h"
#include "api/problems.h"

namespace penumbra::api {

namespace {

using nlohmann::json;
using Tag = JsonNode::Tag;

[[noreturn]] void refuse_syntax(std::string_view text, std::size_t byte, const std::string& reason) {
  const std::string_view before = text.substr(0, std::min(byte > 0 ? byte - 1 : 0, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t column = before.size() - (before.rfind('\n') + 1) + 1;
  throw InvalidBody(not_json("byte " + std::to_string(byte) + " (line " + std::to_string(line) + ", column " +
                             std::to_string(column) + "): " + reason));
}

/// The library's message without its prefix and without the text it echoes, which may be of any length.
std::string reason_of(std::string_view message) {
  const std::size_t begin = message.find("syntax error");
  if (begin != std::string_view::npos) message.remove_prefix(begin);
  const std::size_t echo = message.find("; last read: ");
  return std::string(message.substr(0, std::min<std::size_t>(echo, 200)));
}

/// Builds the document from the parser's events; returning false from one stops the parser.
class Builder {
 public:
  Builder(std::string_view text, const JsonBudget& budget) : text_(text), budget_(budget) {}

  bool null() { return value({}); }
  bool boolean(bool given) { return value(node_of(given ? Tag::yes : Tag::no)); }
  bool number_integer(std::int64_t given) {
    if (is_in_numbers()) return element(static_cast<double>(given));
    JsonNode node = node_of(Tag::negative);
    node.negative = given;
    return value(node);
  }
  bool number_unsigned(std::uint64_t given) {
    if (is_in_numbers()) return element(static_cast<double>(given));
    JsonNode node = node_of(Tag::positive);
    node.positive = given;
    return value(node);
  }
  bool number_float(double given, const std::string& /*text*/) {
    if (is_in_numbers()) return element(given);
    JsonNode node = node_of(Tag::real);
    node.real = given;
    return value(node);
  }
  bool string(std::string& given) {
    JsonNode node = node_of(Tag::string);
    node.span = {static_cast<std::uint32_t>(document_.text.size()), static_cast<std::uint32_t>(given.size())};
    value(node);
    if (given.size() > budget_.max_string_bytes) {
      return refuse("must not be longer than " + std::to_string(budget_.max_string_bytes) + " bytes");
    }
    document_.text += given;
    return true;
  }
  static bool binary(json::binary_t& /*given*/) { return false; }
  bool key(std::string& given) {
    key_begin_ = static_cast<std::uint32_t>(document_.text.size());
    key_size_ = static_cast<std::uint32_t>(given.size());
    if (given.size() > budget_.max_key_bytes) {
      refuse_at(pointer(), "no member's name may be longer than " + std::to_string(budget_.max_key_bytes) + " bytes");
    }
    document_.text += given;
    return true;
  }
  bool start_object(std::size_t /*size*/) { return open(Tag::object); }
  /// Every array starts as one of numbers, until something else turns up in it.
  bool start_array(std::size_t /*size*/) { return open(Tag::numbers); }
  bool end_object() {
    const std::uint32_t closed = close();
    find_duplicates(closed);
    return true;
  }
  bool end_array() {
    close();
    return true;
  }
  bool parse_error(std::size_t byte, const std::string& /*token*/, const json::exception& error) {
    constexpr int out_of_range = 406;
    if (error.id != out_of_range) refuse_syntax(text_, byte, reason_of(error.what()));
    has_met_overflow_ = true;
    return false;
  }

  /// Whether the parser stopped at a number too large for double.
  bool has_met_overflow() const { return has_met_overflow_; }

  JsonDocument take() { return std::move(document_); }

 private:
  static JsonNode node_of(Tag tag) {
    JsonNode node;
    node.tag = tag;
    return node;
  }

  bool is_in_numbers() const { return !open_.empty() && document_.nodes[open_.back()].tag == Tag::numbers; }

  bool element(double given) {
    document_.numbers.push_back(given);
    ++document_.nodes[open_.back()].span.size;
    return true;
  }

  /// Turns the innermost array from numbers alone into an array of anything.
  void spill() {
    JsonNode& array = document_.nodes[open_.back()];
    const std::size_t begin = array.span.begin;
    array.tag = Tag::array;
    array.span = {0, array.span.size};
    for (std::size_t i = begin; i < document_.numbers.size(); ++i) {
      JsonNode node = node_of(Tag::real);
      node.real = document_.numbers[i];
      append(node);
    }
    document_.numbers.resize(begin);
  }

  void append(JsonNode node) {
    node.next = static_cast<std::uint32_t>(document_.nodes.size() + 1);
    document_.nodes.push_back(node);
  }

  bool value(JsonNode node) {
    const std::size_t spilled = is_in_numbers() ? document_.nodes[open_.back()].span.size : 0;
    if (document_.nodes.size() + spilled >= budget_.max_values) {
      refuse_at(pointer(), "the body must not hold more than " + std::to_string(budget_.max_values) +
                               " values (elements of arrays of numbers not counted)");
    }
    if (is_in_numbers()) spill();
    if (!open_.empty()) {
      JsonNode& parent = document_.nodes[open_.back()];
      ++parent.span.size;
      if (parent.tag == Tag::object) {
        node.key_begin = key_begin_;
        node.key_size = key_size_;
      }
    }
    append(node);
    return true;
  }

  bool open(Tag tag) {
    value(node_of(tag));
    // After numbers in the same array are no longer kept as such.
    document_.nodes.back().span = {static_cast<std::uint32_t>(document_.numbers.size()), 0};
    open_.push_back(static_cast<std::uint32_t>(document_.nodes.size() - 1));
    if (open_.size() <= static_cast<std::size_t>(budget_.max_depth)) return true;
    open_.pop_back();
    return refuse("arrays and objects must not be nested more than " + std::to_string(budget_.max_depth) + " deep");
  }

  std::uint32_t close() {
    const std::uint32_t closed = open_.back();
    open_.pop_back();
    document_.nodes[closed].next = static_cast<std::uint32_t>(document_.nodes.size());
    return closed;
  }

  std::string_view key_of(const JsonNode& node) const {
    return std::string_view(document_.text).substr(node.key_begin, node.key_size);
  }

  /// Of the open arrays and objects.
  std::string pointer() const {
    std::string result;
    for (std::size_t i = 1; i < open_.size(); ++i) result += token_in(open_[i - 1], open_[i]);
    return result;
  }

  /// The step from an array or object to its latest value, which is `child`.
  std::string token_in(std::uint32_t parent, std::uint32_t child) const {
    const JsonNode& container = document_.nodes[parent];
    if (container.tag == Tag::object) return pointer_step(key_of(document_.nodes[child]));
    return pointer_step(std::to_string(container.span.size - 1));
  }

  /// Stops reading because of the latest value.
  bool refuse(const std::string& detail) {
    std::string place = pointer();
    const auto latest = static_cast<std::uint32_t>(document_.nodes.size() - 1);
    if (!open_.empty() && open_.back() != latest) place += token_in(open_.back(), latest);
    refuse_at(place, detail);
  }

  [[noreturn]] static void refuse_at(const std::string& place, const std::string& detail) {
    throw InvalidBody(invalid_job({{place, detail}}));
  }

  void find_duplicates(std::uint32_t object) {
    if (document_.nodes[object].span.size < 2) return;
    std::vector<std::string_view> keys;
    keys.reserve(document_.nodes[object].span.size);
    const JsonView view(document_, object);
    for (const JsonView member : view) keys.push_back(member.key());
    std::sort(keys.begin(), keys.end());
    const std::string_view* reported = nullptr;
    for (std::size_t i = 1; i < keys.size() && document_.duplicates.size() < max_field_errors; ++i) {
      if (keys[i] != keys[i - 1] || (reported != nullptr && *reported == keys[i])) continue;
      reported = &keys[i];
      std::string place = pointer();
      if (!open_.empty()) place += token_in(open_.back(), object);
      document_.duplicates.push_back({place + pointer_step(keys[i]), "is given more than once"});
    }
  }

  std::string_view text_;
  JsonBudget budget_;
  JsonDocument document_;
  std::vector<std::uint32_t> open_;  // the arrays and objects around the next value
  std::uint32_t key_begin_ = 0, key_size_ = 0;
  bool has_met_overflow_ = false;
};

/// The text with 9e300 in the place of each number too large for double, in as many bytes.
std::string without_overflow(std::string_view given) {
  std::string text(given);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') {
      for (++i; i < text.size() && text[i] != '"'; ++i) i += text[i] == '\\' ? 1 : 0;
    } else if (text[i] >= '0' && text[i] <= '9') {
      char* end = nullptr;
      const bool is_too_large = std::isinf(std::strtod(&text[i], &end));
      const auto size = static_cast<std::size_t>(end - &text[i]);
      if (is_too_large) {
        // 9e000300 and the like; the shortest that is too large is 1e309.
        std::string number(size, '0');
        text.replace(i, size, number.replace(0, 2, "9e").replace(size - 3, 3, "300"));
      }
      i += size - 1;
    }
  }
  return text;
}

}  // namespace

JsonDocument read_json(std::string_view text, const JsonBudget& budget) {
  // Offsets into a document are 32 bits wide.
  const std::size_t max_bytes = std::min<std::size_t>(budget.max_bytes, std::numeric_limits<std::uint32_t>::max() / 2);
  if (text.size() > max_bytes) throw InvalidBody(body_too_large(text.size(), max_bytes));
  // The library would skip the one and take the other for the end of the text.
  if (text.substr(0, 3) == "\xEF\xBB\xBF") refuse_syntax(text, 1, "a byte order mark is not allowed");
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) {
    refuse_syntax(text, nul + 1, "a zero byte is not allowed");
  }
  Builder builder(text, budget);
  json::sax_parse(text.data(), text.data() + text.size(), &builder);
  if (!builder.has_met_overflow()) return builder.take();
  const std::string finite = without_overflow(text);
  Builder second(finite, budget);
  json::sax_parse(finite.data(), finite.data() + finite.size(), &second);
  return second.take();
}

}  // namespace penumbra::api
