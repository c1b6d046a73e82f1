#include "server/http/encoding.h"

#include <libdeflate.h>

#include <algorithm>
#include <memory>
#include <new>

#include "api/problems.h"

namespace penumbra::http {

namespace {

constexpr std::size_t least_compressed_bytes = 1024, first_guess_bytes = 64u << 10;
constexpr int compression_level = 6;

bool is_text(std::string_view media_type) {
  media_type = media_type.substr(0, media_type.find(';'));
  return media_type.starts_with("text/") || media_type.ends_with("json") || media_type.ends_with("xml");
}

/// Whether the weight behind a member's semicolon is zero (RFC 9110, 12.4.2).
bool is_refused(std::string_view member) {
  const std::size_t place = lower_case(member).find("q=");
  return place != std::string::npos && member.find_first_of("123456789", place) == std::string_view::npos;
}

bool accepts_gzip(std::string_view accept_encoding) {
  std::optional<bool> gzip, others;
  any_member(accept_encoding, [&](std::string_view member) {
    const std::string coding = lower_case(trimmed(member.substr(0, member.find(';'))));
    if (coding == "gzip" || coding == "x-gzip") gzip = !is_refused(member);
    if (coding == "*") others = !is_refused(member);
    return false;
  });
  return gzip.value_or(others.value_or(false));
}

/// Empty for a body that is made while it is sent.
std::string_view bytes_of(const Response& response) {
  struct {
    std::string_view operator()(const std::string& text) const { return text; }
    std::string_view operator()(std::string_view text) const { return text; }
    std::string_view operator()(const std::shared_ptr<const std::string>& text) const { return *text; }
    std::string_view operator()(const Producer&) const { return {}; }
  } view;
  return std::visit(view, response.body);
}

std::string compressed(std::string_view text) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(compression_level), libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string gzip(libdeflate_gzip_compress_bound(compressor.get(), text.size()), '\0');
  gzip.resize(libdeflate_gzip_compress(compressor.get(), text.data(), text.size(), gzip.data(), gzip.size()));
  return gzip;
}

}  // namespace

std::variant<std::optional<std::string>, api::Problem> inflate(std::string_view gzip, std::size_t max_bytes,
                                                               const std::function<bool(std::size_t bytes)>& may_take) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!decompressor) throw std::bad_alloc();
  std::string text;
  std::size_t size = 0, next_size = std::max(first_guess_bytes, 4 * gzip.size());
  do {
    std::size_t read = 0, written = 0;
    const libdeflate_result result = libdeflate_gzip_decompress_ex(
        decompressor.get(), gzip.data(), gzip.size(), text.data() + size, text.size() - size, &read, &written);
    if (result == LIBDEFLATE_SUCCESS) {
      // Another member may follow (RFC 1952, 2.2).
      gzip.remove_prefix(read);
      size += written;
    } else if (result != LIBDEFLATE_INSUFFICIENT_SPACE) {
      return api::bad_request("the body is not what gzip makes");
    } else if (text.size() >= max_bytes) {
      return api::body_too_large(max_bytes);
    } else {
      next_size = std::min(next_size, max_bytes);
      if (!may_take(next_size)) return std::nullopt;
      text.resize(next_size);
      next_size *= 2;
    }
  } while (!gzip.empty());
  text.resize(size);
  return text;
}

std::string gzip_tag(std::string_view tag) {
  return tag.ends_with('"') ? std::string(tag.substr(0, tag.size() - 1)) + "-gzip\"" : std::string(tag);
}

void compress_for(const FieldValues& fields, Response& response) {
  const auto use_gzip_tag = [&] {
    for (auto& [name, value] : response.headers) {
      if (name == "ETag") value = gzip_tag(value);
    }
  };
  // What the client has already is told by the name that it knows.
  const std::string_view known = fields[Field::if_none_match].value_or("");
  if (response.status == 304 && known.find("-gzip\"") != std::string_view::npos) use_gzip_tag();
  const std::string_view text = bytes_of(response);
  if (!is_text(response.media_type) || text.size() < least_compressed_bytes) return;
  response.headers.emplace_back("Vary", "Accept-Encoding");
  if (!accepts_gzip(fields[Field::accept_encoding].value_or(""))) return;
  use_gzip_tag();
  response.headers.emplace_back("Content-Encoding", "gzip");
  response.body = compressed(text);
}

}  // namespace penumbra::http
