#pragma once
#include <cstddef>
#include <iosfwd>
#include <stdexcept>
#include <string>

#include "api/problem.h"

namespace penumbra::cli {

/// An argument that names something which is not there.
class UnusableArgument : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The bytes of a file, or of standard input for "-"; no more than one byte above `max_bytes`. Throws UnusableArgument.
std::string read_input(const std::string& path, std::size_t max_bytes);

/// Every error with its pointer, one a line; the problem's detail when it has none.
void print_errors(const api::Problem& problem, std::ostream& out);

}  // namespace penumbra::cli
