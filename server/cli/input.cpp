#include "server/cli/input.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <system_error>

namespace penumbra::cli {

namespace {

/// With control characters escaped: names in the body are anybody's.
std::string printable(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f) {
      result += c;
    } else {
      char escaped[8];
      result.append(escaped, static_cast<std::size_t>(std::snprintf(escaped, sizeof escaped, "\\u%04x", byte)));
    }
  }
  return result;
}

}  // namespace

std::string read_input(const std::string& path, std::size_t max_bytes) {
  std::ifstream file;
  if (path != "-") {
    file.open(path, std::ios::binary);
    if (!file) throw UnusableArgument(path + ": " + std::generic_category().message(errno));
  }
  std::istream& input = path == "-" ? std::cin : file;
  std::string bytes;
  constexpr std::size_t step = 1u << 16;
  while (input && bytes.size() <= max_bytes) {
    const std::size_t before = bytes.size();
    // One more than allowed is enough to tell.
    bytes.resize(before + 1 + std::min(step, max_bytes - before));
    input.read(bytes.data() + before, static_cast<std::streamsize>(bytes.size() - before));
    bytes.resize(before + static_cast<std::size_t>(input.gcount()));
  }
  if (input.bad()) throw UnusableArgument(path + ": cannot be read");
  return bytes;
}

void print_errors(const api::Problem& problem, std::ostream& out) {
  if (problem.errors.empty()) out << printable(problem.detail) << "\n";
  for (const api::FieldError& error : problem.errors)
    out << printable(error.pointer.empty() ? "the body" : error.pointer) << ": " << printable(error.detail) << "\n";
}

}  // namespace penumbra::cli
