#pragma once
#include <cstddef>
#include <exception>
#include <optional>
#include <string>
#include <vector>

namespace penumbra::api {

/// One place of a body that is wrong. `pointer` is an RFC 6901 JSON Pointer into the body ("" is the whole body).
struct FieldError {
  std::string pointer;
  std::string detail;
  bool operator==(const FieldError&) const = default;
};

/// RFC 9457 problem details, made in problems.h. `type` is a relative URI reference such as "/problems/invalid-scene";
/// `errors` holds at most 100 entries.
struct Problem {
  std::string type = "about:blank";
  std::string title;
  int status = 500;
  std::string detail;
  std::vector<FieldError> errors;
};

/// `application/problem+json` text of `problem`.
std::string to_json(const Problem& problem);

/// How many entries `errors` may have.
inline constexpr std::size_t max_field_errors = 100;

/// A body that cannot become a job: status 400 when it is not JSON, 422 when it is understood but invalid or over a
/// limit, 413 when it is larger than allowed. The one exception api/ throws.
class InvalidBody : public std::exception {
 public:
  explicit InvalidBody(Problem problem) : problem_(std::move(problem)) {}
  const char* what() const noexcept override { return problem_.detail.c_str(); }
  const Problem& problem() const { return problem_; }

 private:
  Problem problem_;
};

}  // namespace penumbra::api
