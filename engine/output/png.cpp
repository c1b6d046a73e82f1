#include "engine/output/png.h"

#include <libdeflate.h>

#include <algorithm>
#include <memory>
#include <new>
#include <string_view>
#include <vector>

namespace penumbra::output {
namespace {

// Higher levels save a tenth of the size at most, and take twice the time where a picture is noisy.
constexpr int compression_level = 1;
constexpr std::uint8_t paeth_filter = 4;

void append_big_endian(std::string& bytes, std::uint32_t value) {
  for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(value >> shift);
}

void append_chunk(std::string& file, std::string_view type, std::string_view data) {
  append_big_endian(file, static_cast<std::uint32_t>(data.size()));
  const std::size_t start = file.size();
  file += type;
  file += data;
  append_big_endian(file, libdeflate_crc32(0, file.data() + start, file.size() - start));
}

/// The neighbour nearest to left + above − above_left; section 9.4 of the standard. Short, so that rows vectorise.
std::uint8_t paeth(std::int16_t left, std::int16_t above, std::int16_t above_left) {
  const auto size = [](int d) { return static_cast<std::int16_t>(d < 0 ? -d : d); };
  const std::int16_t to_left = size(above - above_left), to_above = size(left - above_left);
  const std::int16_t to_corner = size(left + above - 2 * above_left);
  const std::int16_t other = to_above <= to_corner ? above : above_left;
  return static_cast<std::uint8_t>(to_left <= std::min(to_above, to_corner) ? left : other);
}

/// Every row behind its filter type, as the difference from the Paeth predictor.
std::vector<std::uint8_t> filtered(std::span<const std::uint8_t> bytes, std::size_t row_bytes,
                                   std::size_t pixel_bytes) {
  const std::vector<std::uint8_t> nothing(row_bytes);
  std::vector<std::uint8_t> result(bytes.size() + bytes.size() / row_bytes);
  const std::uint8_t* above = nothing.data();
  std::uint8_t* out = result.data();
  for (const std::uint8_t* row = bytes.data(); row != bytes.data() + bytes.size(); above = row, row += row_bytes) {
    *out++ = paeth_filter;
    for (std::size_t i = 0; i < pixel_bytes; ++i) out[i] = static_cast<std::uint8_t>(row[i] - above[i]);
    const std::uint8_t *left = row - pixel_bytes, *above_left = above - pixel_bytes;
    for (std::size_t i = pixel_bytes; i < row_bytes; ++i)
      out[i] = static_cast<std::uint8_t>(row[i] - paeth(left[i], above[i], above_left[i]));
    out += row_bytes;
  }
  return result;
}

std::string encode(int width, int height, int bit_depth, std::span<const std::uint8_t> bytes) {
  std::string header;
  append_big_endian(header, static_cast<std::uint32_t>(width));
  append_big_endian(header, static_cast<std::uint32_t>(height));
  header += static_cast<char>(bit_depth);
  header += std::string_view("\2\0\0\0", 4);  // RGB, deflate, adaptive filters, not interlaced

  const auto pixel_bytes = static_cast<std::size_t>(3 * bit_depth / 8);
  const std::vector<std::uint8_t> rows = filtered(bytes, pixel_bytes * static_cast<std::size_t>(width), pixel_bytes);
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(compression_level), libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string data(libdeflate_zlib_compress_bound(compressor.get(), rows.size()), '\0');
  data.resize(libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), data.data(), data.size()));

  std::string file("\x89PNG\r\n\x1a\n");
  append_chunk(file, "IHDR", header);
  append_chunk(file, "IDAT", data);
  append_chunk(file, "IEND", {});
  return file;
}

}  // namespace

std::string png_bytes(int width, int height, std::span<const std::uint8_t> rgb) {
  return encode(width, height, 8, rgb);
}

std::string png_bytes(int width, int height, std::span<const std::uint16_t> rgb) {
  std::vector<std::uint8_t> big_endian(2 * rgb.size());
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    big_endian[2 * i] = static_cast<std::uint8_t>(rgb[i] >> 8);
    big_endian[2 * i + 1] = static_cast<std::uint8_t>(rgb[i]);
  }
  return encode(width, height, 16, big_endian);
}

}  // namespace penumbra::output
