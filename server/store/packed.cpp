#include "server/store/packed.h"

#include <charconv>
#include <stdexcept>

namespace penumbra::store {

namespace {

constexpr std::size_t longest_number = 32;

class Packer {
 public:
  Packer& add(std::string_view text) {
    char length[longest_number];
    const auto end = std::to_chars(length, length + sizeof length, text.size()).ptr;
    text_.append(length, end).append(1, ':').append(text);
    return *this;
  }
  template <class Number>
  Packer& number(Number value) {
    char digits[longest_number];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    return add({digits, end});
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

class Unpacker {
 public:
  explicit Unpacker(std::string_view text) : rest_(text) {}

  std::string_view text() {
    std::size_t length = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), length);
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    if (error != std::errc() || rest_.empty() || rest_.front() != ':' || rest_.size() - 1 < length) fail();
    const std::string_view text = rest_.substr(1, length);
    rest_.remove_prefix(1 + length);
    return text;
  }
  template <class Number>
  void number(Number& value) {
    const std::string_view digits = text();
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size()) fail();
  }
  bool is_at_end() const { return rest_.empty(); }

 private:
  [[noreturn]] static void fail() { throw std::runtime_error("a stored record is damaged"); }

  std::string_view rest_;
};

}  // namespace

std::string packed(const api::Problem& problem) {
  Packer packer;
  packer.add(problem.type).add(problem.title).number(problem.status).add(problem.detail);
  for (const api::FieldError& error : problem.errors) packer.add(error.pointer).add(error.detail);
  return packer.take();
}

std::string packed(const render::Stats& stats) {
  Packer packer;
  // A member more, and neither this nor unpacked_stats compiles any longer.
  const auto& [build_s, render_s, encode_s, rays, skipped, estimated_error] = stats;
  packer.number(build_s).number(render_s).number(encode_s).number(estimated_error);
  for (const auto& [name, count] : shading::by_name_of_ray(rays)) packer.number(*count);
  for (const auto& [name, count] : skipped) packer.add(name).number(count);
  return packer.take();
}

api::Problem unpacked_problem(std::string_view text) {
  Unpacker unpacker(text);
  api::Problem problem;
  problem.type = unpacker.text();
  problem.title = unpacker.text();
  unpacker.number(problem.status);
  problem.detail = unpacker.text();
  while (!unpacker.is_at_end()) {
    api::FieldError& error = problem.errors.emplace_back();
    error.pointer = unpacker.text();
    error.detail = unpacker.text();
  }
  return problem;
}

render::Stats unpacked_stats(std::string_view text) {
  Unpacker unpacker(text);
  render::Stats stats;
  auto& [build_s, render_s, encode_s, rays, skipped, estimated_error] = stats;
  for (double* seconds : {&build_s, &render_s, &encode_s}) unpacker.number(*seconds);
  unpacker.number(estimated_error);
  for (const auto& [name, count] : shading::by_name_of_ray(rays)) unpacker.number(*count);
  while (!unpacker.is_at_end()) {
    const std::string name(unpacker.text());
    unpacker.number(skipped[name]);
  }
  return stats;
}

}  // namespace penumbra::store
