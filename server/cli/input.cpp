#include "server/cli/input.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iostream>
#include <system_error>

namespace penumbra::cli {

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
    bytes.resize(std::min(before + step, max_bytes + 1));
    input.read(bytes.data() + before, static_cast<std::streamsize>(bytes.size() - before));
    bytes.resize(before + static_cast<std::size_t>(input.gcount()));
  }
  if (input.bad()) throw UnusableArgument(path + ": cannot be read");
  return bytes;
}

void print_errors(const api::Problem& problem, std::ostream& out) {
  if (problem.errors.empty()) out << problem.detail << "\n";
  for (const api::FieldError& error : problem.errors)
    out << (error.pointer.empty() ? "the body" : error.pointer) << ": " << error.detail << "\n";
}

}  // namespace penumbra::cli
