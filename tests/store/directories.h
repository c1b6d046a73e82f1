#pragma once
#include <filesystem>
#include <string>

#include "server/store/sha256.h"

// Store directories as a test looks into them.

namespace penumbra::test {

namespace fs = std::filesystem;

inline std::size_t files_in(const std::string& directory) {
  std::size_t count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) count += entry.is_regular_file() ? 1 : 0;
  return count;
}

inline std::string blob_path(const std::string& directory, const std::string& bytes) {
  const std::string hash = store::sha256_hex(bytes);
  return directory + "/blobs/" + hash.substr(0, 2) + "/" + hash;
}

/// What a server that dies leaves: the directory as it is while the store is open.
inline void copy_open_store(const std::string& from, const std::string& to) {
  fs::remove_all(to);
  fs::copy(from, to, fs::copy_options::recursive);
}

}  // namespace penumbra::test
