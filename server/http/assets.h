#pragma once
#include <optional>
#include <span>
#include <string_view>

namespace penumbra::http {

/// A file the program carries. Everything lives as long as the program.
struct Asset {
  std::string_view path;  // as served, beginning with a slash
  std::string_view media_type;
  std::string_view sha256;  // of the bytes, in hexadecimal
  std::string_view bytes;
};

/// All of them, by path.
std::span<const Asset> assets();
std::optional<Asset> find_asset(std::string_view path);

}  // namespace penumbra::http
