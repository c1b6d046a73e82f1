#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace penumbra::output {

/// Pixels for the image module: rows from the top, three floats each.
struct ImageRequest {
  int width, height;
  const float* pixels;
  const char* file_format;  // an ending OpenImageIO knows, without the dot
};

/// What the module exports under `write_image_symbol`: true and the file's bytes, or false and a reason.
struct ImageResult {
  bool is_written = false;
  std::string bytes_or_reason;
};
using WriteImage = void (*)(const ImageRequest& request, ImageResult* result);
inline constexpr const char* write_image_symbol = "penumbra_write_image";

/// What it exports under `read_image_symbol`: the pixels of a PNG file as they are stored, in [0, 1], or a reason.
struct ReadResult {
  int width = 0, height = 0;  // 0: it could not be read
  std::vector<float> rgb;     // rows from the top
  std::string reason;
};
using ReadImage = void (*)(std::string_view png, ReadResult* result);
inline constexpr const char* read_image_symbol = "penumbra_read_image";

}  // namespace penumbra::output
