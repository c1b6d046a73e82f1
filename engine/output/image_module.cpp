#include "engine/output/image_module.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <vector>

namespace {

using penumbra::output::ImageRequest;
using penumbra::output::ImageResult;
using penumbra::output::ReadResult;

ImageResult write(const ImageRequest& request) {
  const std::string name = std::string("image.") + request.file_format;
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(name);
  if (!output) return {false, OIIO::geterror()};
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput sink(bytes);
  OIIO::ImageSpec spec(request.width, request.height, 3, OIIO::TypeDesc::FLOAT);
  // Otherwise the library writes the time of day, and equal pictures would not be equal bytes.
  spec.attribute("DateTime", "1970:01:01 00:00:00");
  if (!output->set_ioproxy(&sink) || !output->open(name, spec) ||
      !output->write_image(OIIO::TypeDesc::FLOAT, request.pixels) || !output->close())
    return {false, output->geterror()};
  return {true, std::string(bytes.begin(), bytes.end())};
}

ReadResult read(std::string_view png) {
  OIIO::Filesystem::IOMemReader source(png.data(), png.size());
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open("image.png", nullptr, &source);
  if (!input) return {0, 0, {}, OIIO::geterror()};
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.nchannels < 3) return {0, 0, {}, "it is not in color"};
  ReadResult result{spec.width, spec.height, std::vector<float>(3 * spec.image_pixels()), {}};
  if (!input->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, result.rgb.data())) return {0, 0, {}, input->geterror()};
  return result;
}

/// Its own threads would compete with the render pool for nothing.
void use_one_thread() {
  static const bool is_single_threaded = OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
  static_cast<void>(is_single_threaded);
}

}  // namespace

extern "C" void penumbra_write_image(const ImageRequest& request, ImageResult* result) {
  use_one_thread();
  *result = write(request);
}

extern "C" void penumbra_read_image(std::string_view png, ReadResult* result) {
  use_one_thread();
  *result = read(png);
}
