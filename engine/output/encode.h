#pragma once
#include <string>
#include <string_view>

#include "engine/render/film.h"
#include "engine/scene/options.h"

namespace penumbra::output {

struct Encoding {
  scene::ImageFormat format = scene::ImageFormat::png;
  scene::Transfer transfer = scene::Transfer::srgb;
  int bit_depth = 8;  // of PNG: 8 or 16
};

/// The encoding `options` ask for.
Encoding encoding_of(const scene::Options& options);

/// "image/png" or "image/x-exr".
std::string media_type(scene::ImageFormat format);

/// The bytes of the image file. PNG: transfer curve, clamped to [0, 1], rounded to nearest; EXR: linear floats,
/// unclamped. The same film gives the same bytes. Throws std::runtime_error when the writer is missing or fails.
std::string encode(const render::Film& film, const Encoding& encoding);

/// The picture in a PNG file of sRGB values, in linear light. Throws std::runtime_error when it cannot be read.
render::Film decode_png(std::string_view png);

/// Starts loading the EXR writer, and PNG reader, in the background; `encode` waits for it. PNG needs no loading.
void preload();

}  // namespace penumbra::output
