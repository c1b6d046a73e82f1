#include "engine/output/encode.h"

#include <dlfcn.h>

#include <algorithm>
#include <filesystem>
#include <future>
#include <stdexcept>

#include "engine/output/image_module.h"
#include "engine/output/png.h"
#include "engine/output/transfer.h"

namespace penumbra::output {
namespace {

struct Module {
  WriteImage write;
  ReadImage read;
};

Module load_module() {
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  const std::filesystem::path module = program.parent_path().parent_path() / "lib" / "penumbra_image.so";
  void* handle = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  // Called once, by one thread; glibc keeps the text per thread. NOLINTNEXTLINE(concurrency-mt-unsafe)
  if (handle == nullptr) throw std::runtime_error(std::string("cannot load the image writer: ") + dlerror());
  const auto symbol = [&](const char* name) {
    void* const found = dlsym(handle, name);
    if (found == nullptr) throw std::runtime_error("the image writer has no " + std::string(name));
    return found;
  };
  return {reinterpret_cast<WriteImage>(symbol(write_image_symbol)),
          reinterpret_cast<ReadImage>(symbol(read_image_symbol))};
}

/// Loading takes a fifth of a second, so it runs beside whatever else there is to do, once.
const std::shared_future<Module>& image_module() {
  static const std::shared_future<Module> module = std::async(std::launch::async, load_module).share();
  return module;
}

}  // namespace

void preload() { image_module(); }

Encoding encoding_of(const scene::Options& options) { return {options.format, options.transfer, options.bit_depth}; }

std::string media_type(scene::ImageFormat format) {
  return format == scene::ImageFormat::png ? "image/png" : "image/x-exr";
}

std::string encode(const render::Film& film, const Encoding& encoding) {
  if (encoding.format == scene::ImageFormat::png) {
    return encoding.bit_depth == 16 ? png_bytes(film.width, film.height, to_16_bit(film, encoding.transfer))
                                    : png_bytes(film.width, film.height, to_8_bit(film, encoding.transfer));
  }
  ImageResult result;
  image_module().get().write({film.width, film.height, film.rgb.data(), "exr"}, &result);
  if (!result.is_written) throw std::runtime_error("cannot write the image: " + result.bytes_or_reason);
  return std::move(result.bytes_or_reason);
}

render::Film decode_png(std::string_view png) {
  ReadResult read;
  image_module().get().read(png, &read);
  if (read.width == 0) throw std::runtime_error("cannot read the image: " + read.reason);
  render::Film film = render::Film::unwritten(read.width, read.height);
  std::transform(read.rgb.begin(), read.rgb.end(), film.rgb.begin(),
                 [](float value) { return static_cast<float>(linear_from_srgb(value)); });
  return film;
}

}  // namespace penumbra::output
