#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/problem.h"

namespace penumbra::api {

enum class JsonKind : std::uint8_t { null, boolean, number, string, array, object };

/// One value as stored: a document is its values in the order of the text, each knowing where the next sibling is.
struct JsonNode {
  /// As JsonKind, with numbers told apart by how they were written and arrays by how they are kept.
  enum class Tag : std::uint8_t { null, no, yes, real, positive, negative, string, array, numbers, object };
  Tag tag = Tag::null;
  std::uint32_t next = 0;                     // the node after this value and everything inside it
  std::uint32_t key_begin = 0, key_size = 0;  // of a member, into JsonDocument::text
  union {
    double real = 0;
    std::uint64_t positive;
    std::int64_t negative;
    struct {
      std::uint32_t begin, size;  // string: into text · numbers: into numbers · array, object: size alone
    } span;
  };
};

class JsonView;

/// Parsed JSON: 32 bytes a value, plus strings; an array of nothing but numbers costs 8 bytes an element. Read it
/// through JsonView. Immutable once built; may be shared between threads.
struct JsonDocument {
  std::vector<JsonNode> nodes;  // never empty: nodes[0] is the whole
  std::string text;
  std::vector<double> numbers;
  /// An object that names a member twice has no one meaning (RFC 8259, 4): one error a name, up to 100.
  std::vector<FieldError> duplicates;

  JsonView root() const;
};

/// A value of a document; cheap to copy, not to outlive the document.
class JsonView {
 public:
  JsonView(const JsonDocument& document, std::uint32_t node) : document_(&document), node_(node) {}

  JsonKind kind() const;
  bool is_null() const { return kind() == JsonKind::null; }
  /// Each of the following needs the kind its name says.
  bool boolean() const { return node().tag == JsonNode::Tag::yes; }
  std::string_view string() const;
  /// The double nearest to what was written.
  double number() const;
  /// A number without a fraction, exact when it was written as digits alone and the double nearest to it otherwise
  /// (so 3.0 is 3); nothing when there is a fraction or the type cannot hold it.
  std::optional<std::uint64_t> unsigned_integer() const;

  /// Elements of an array or members of an object.
  std::size_t size() const;
  /// Of an object's member: its name.
  std::string_view key() const;

  /// Forward over elements or members.
  class Iterator {
   public:
    Iterator(const JsonDocument& document, std::uint32_t node, std::uint32_t element)
        : document_(&document), node_(node), element_(element) {}
    JsonView operator*() const { return {*document_, node_, element_}; }
    Iterator& operator++();
    bool operator==(const Iterator& other) const { return node_ == other.node_ && element_ == other.element_; }

   private:
    const JsonDocument* document_;
    std::uint32_t node_, element_;
  };
  Iterator begin() const;
  Iterator end() const;

 private:
  static constexpr std::uint32_t no_element = 0xffffffff;
  JsonView(const JsonDocument& document, std::uint32_t node, std::uint32_t element)
      : document_(&document), node_(node), element_(element) {}
  const JsonNode& node() const { return document_->nodes[node_]; }

  const JsonDocument* document_;
  std::uint32_t node_;
  std::uint32_t element_ = no_element;  // of an array of numbers: which one this is
};

inline JsonView JsonDocument::root() const { return {*this, 0}; }

}  // namespace penumbra::api
