#pragma once
#include <cstdint>
#include <span>
#include <string>

namespace penumbra::output {

/// A PNG file (W3C PNG, 2nd edition) of 8- or 16-bit RGB rows from the top, compressed by libdeflate. The same pixels
/// give the same bytes. A general writer takes five times as long for the same size.
std::string png_bytes(int width, int height, std::span<const std::uint8_t> rgb);
std::string png_bytes(int width, int height, std::span<const std::uint16_t> rgb);

}  // namespace penumbra::output
