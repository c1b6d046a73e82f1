#pragma once
#include <string>

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

}  // namespace penumbra::output
