#include "server/http/assets.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace {

/// A row of the table that embed_assets.py writes: four pointers, each with a length.
struct Row {
  const char* path;
  std::uint64_t path_size;
  const char* media_type;
  std::uint64_t media_type_size;
  const char* sha256;
  std::uint64_t sha256_size;
  const char* bytes;
  std::uint64_t size;
};

extern "C" const Row penumbra_assets[];
extern "C" const std::uint64_t penumbra_asset_count;

}  // namespace

namespace penumbra::http {

std::span<const Asset> assets() {
  static const std::vector<Asset> all = [] {
    std::vector<Asset> list;
    for (const Row& row : std::span(penumbra_assets, penumbra_asset_count)) {
      list.push_back({{row.path, row.path_size},
                      {row.media_type, row.media_type_size},
                      {row.sha256, row.sha256_size},
                      {row.bytes, row.size}});
    }
    return list;
  }();
  return all;
}

std::optional<Asset> find_asset(std::string_view path) {
  const auto found = std::find_if(assets().begin(), assets().end(), [&](const Asset& a) { return a.path == path; });
  if (found == assets().end()) return std::nullopt;
  return *found;
}

}  // namespace penumbra::http
