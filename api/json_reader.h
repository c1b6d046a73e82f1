#pragma once
#include <cstddef>
#include <string_view>

#include "api/json_document.h"

namespace penumbra::api {

/// What a text may cost to read, whatever it says.
struct JsonBudget {
  std::size_t max_bytes = 8u << 20;
  int max_depth = 64;                     // of arrays and objects inside each other
  std::size_t max_values = 1'000'000;     // elements of arrays of numbers not counted
  std::size_t max_string_bytes = 65'536;  // of each string
  std::size_t max_key_bytes = 256;        // of each member's name
};

/// Reads RFC 8259 text: UTF-8 without a byte order mark. A number too large for double is read as ±9e300, which is
/// too large for every field. Throws InvalidBody: 413 over max_bytes; 400 with the byte's position when the text is not
/// JSON; 422 with the pointer over another budget. Members named twice are left to the caller, in
/// JsonDocument::duplicates.
JsonDocument read_json(std::string_view text, const JsonBudget& budget = {});

}  // namespace penumbra::api
