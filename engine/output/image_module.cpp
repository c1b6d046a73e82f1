#include "engine/output/image_module.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <vector>

namespace {

using penumbra::output::ImageRequest;
using penumbra::output::ImageResult;

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

}  // namespace

extern "C" void penumbra_write_image(const ImageRequest& request, ImageResult* result) {
  // Its own threads would compete with the render pool for nothing.
  static const bool is_single_threaded = OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
  static_cast<void>(is_single_threaded);
  *result = write(request);
}
