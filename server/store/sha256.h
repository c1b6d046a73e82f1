#pragma once
#include <string>
#include <string_view>

namespace penumbra::store {

/// SHA-256 (FIPS 180-4) in lower-case hexadecimal. Throws std::runtime_error if the library refuses.
std::string sha256_hex(std::string_view bytes);

}  // namespace penumbra::store
