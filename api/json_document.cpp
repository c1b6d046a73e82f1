#include "api/json_document.h"

#include <cmath>

namespace penumbra::api {

using Tag = JsonNode::Tag;

JsonKind JsonView::kind() const {
  if (element_ != no_element) return JsonKind::number;
  switch (node().tag) {
    case Tag::null:
      return JsonKind::null;
    case Tag::no:
    case Tag::yes:
      return JsonKind::boolean;
    case Tag::real:
    case Tag::positive:
    case Tag::negative:
      return JsonKind::number;
    case Tag::string:
      return JsonKind::string;
    case Tag::array:
    case Tag::numbers:
      return JsonKind::array;
    case Tag::object:
      return JsonKind::object;
  }
  return JsonKind::null;
}

std::string_view JsonView::string() const {
  return std::string_view(document_->text).substr(node().span.begin, node().span.size);
}

double JsonView::number() const {
  if (element_ != no_element) return document_->numbers[element_];
  if (node().tag == Tag::positive) return static_cast<double>(node().positive);
  if (node().tag == Tag::negative) return static_cast<double>(node().negative);
  return node().real;
}

std::optional<std::uint64_t> JsonView::unsigned_integer() const {
  if (element_ == no_element && node().tag == Tag::positive) return node().positive;
  const double value = number();
  constexpr double two_to_the_64 = 18446744073709551616.0;
  if (!(value >= 0 && value < two_to_the_64) || value != std::floor(value)) return std::nullopt;
  return static_cast<std::uint64_t>(value);
}

std::size_t JsonView::size() const { return node().span.size; }

std::string_view JsonView::key() const {
  return std::string_view(document_->text).substr(node().key_begin, node().key_size);
}

JsonView::Iterator JsonView::begin() const {
  if (node().tag == Tag::numbers) return {*document_, node_, node().span.begin};
  return {*document_, node_ + 1, no_element};
}

JsonView::Iterator JsonView::end() const {
  if (node().tag == Tag::numbers) return {*document_, node_, node().span.begin + node().span.size};
  return {*document_, node().next, no_element};
}

JsonView::Iterator& JsonView::Iterator::operator++() {
  if (element_ != no_element) {
    ++element_;
  } else {
    node_ = document_->nodes[node_].next;
  }
  return *this;
}

}  // namespace penumbra::api
