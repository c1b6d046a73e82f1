#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace penumbra::store {

/// SHA-256 (FIPS 180-4) of bytes that come piece by piece. Throws std::runtime_error if the library refuses.
class Sha256 {
 public:
  Sha256();
  void add(const void* bytes, std::size_t size);
  /// In lower-case hexadecimal; nothing may be added afterwards.
  std::string hex();

 private:
  std::shared_ptr<void> context_;
};

std::string sha256_hex(std::string_view bytes);

}  // namespace penumbra::store
