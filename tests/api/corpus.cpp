#include "tests/api/corpus.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "api/json_reader.h"

namespace penumbra::tests {

namespace {

using api::JsonKind;
using api::JsonView;

std::optional<JsonView> member(const JsonView& object, std::string_view name) {
  for (const JsonView candidate : object) {
    if (candidate.key() == name) return candidate;
  }
  return std::nullopt;
}

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    char escaped[8];
    std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    const bool is_plain = static_cast<unsigned char>(c) >= 0x20 && c != '"' && c != '\\';
    result += is_plain ? std::string(1, c) : escaped;
  }
  return result + '"';
}

std::string number_text(const JsonView& value) {
  if (const auto integer = value.unsigned_integer()) return std::to_string(*integer);
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value.number());
  return text;
}

}  // namespace

std::string text_of(const JsonView& value) {
  switch (value.kind()) {
    case JsonKind::null:
      return "null";
    case JsonKind::boolean:
      return value.boolean() ? "true" : "false";
    case JsonKind::number:
      return number_text(value);
    case JsonKind::string:
      return quoted(value.string());
    case JsonKind::array:
    case JsonKind::object:
      break;
  }
  const bool is_object = value.kind() == JsonKind::object;
  std::string text;
  for (const JsonView child : value) {
    if (!text.empty()) text += ',';
    if (is_object) text += quoted(child.key()) + ':';
    text += text_of(child);
  }
  return is_object ? '{' + text + '}' : '[' + text + ']';
}

std::string read_source_file(const std::string& path) {
  std::ifstream file(std::string(PENUMBRA_SOURCE_DIR) + "/" + path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::vector<CorpusEntry> read_corpus(const std::string& file) {
  api::JsonBudget budget;
  budget.max_depth = 100;
  const api::JsonDocument document = api::read_json(read_source_file("tests/api/corpus/" + file), budget);
  std::vector<CorpusEntry> entries;
  for (const JsonView item : document.root()) {
    CorpusEntry entry;
    entry.name = member(item, "name").value().string();
    const std::optional<JsonView> text = member(item, "text");
    entry.body = text ? std::string(text->string()) : text_of(member(item, "body").value());
    if (const auto status = member(item, "status")) entry.status = static_cast<int>(status->number());
    if (const auto errors = member(item, "errors")) {
      for (const JsonView pointer : *errors) entry.pointers.emplace_back(pointer.string());
    }
    std::sort(entry.pointers.begin(), entry.pointers.end());
    entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace penumbra::tests
