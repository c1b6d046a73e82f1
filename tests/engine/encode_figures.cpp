// Not a test: the figures of `tests/bench/run encode`. Time of a PNG's two steps and its size against OpenImageIO's.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>

#include "engine/output/encode.h"
#include "engine/output/png.h"
#include "engine/output/transfer.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;

namespace {

constexpr int runs = 15;

/// Medians: by the clock, and of the processor's time, which neighbours on the machine disturb less.
struct Milliseconds {
  double wall, processor;
};

double processor_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

template <class Work>
Milliseconds measure(const Work& work) {
  std::vector<double> wall, processor;
  for (int i = 0; i < runs; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const double processor_start = processor_s();
    work();
    processor.push_back(1000 * (processor_s() - processor_start));
    wall.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(wall.begin(), wall.end());
  std::sort(processor.begin(), processor.end());
  return {wall[runs / 2], processor[runs / 2]};
}

std::size_t openimageio_bytes(const render::Film& film, const std::vector<std::uint8_t>& levels) {
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput sink(bytes);
  const auto file = OIIO::ImageOutput::create("image.png");
  REQUIRE(file->set_ioproxy(&sink));
  REQUIRE(file->open("image.png", OIIO::ImageSpec(film.width, film.height, 3, OIIO::TypeDesc::UINT8)));
  REQUIRE(file->write_image(OIIO::TypeDesc::UINT8, levels.data()));
  REQUIRE(file->close());
  return bytes.size();
}

void print(const char* name, const render::Film& film) {
  std::vector<std::uint8_t> levels;
  const Milliseconds transfer = measure([&] { levels = output::to_8_bit(film, scene::Transfer::srgb); });
  std::string png;
  const Milliseconds file = measure([&] { png = output::png_bytes(film.width, film.height, levels); });
  const Milliseconds whole = measure([&] {
    output::encode(film, {scene::ImageFormat::png, scene::Transfer::srgb, 8});
  });
  std::size_t other_bytes = 0;
  const Milliseconds other = measure([&] { other_bytes = openimageio_bytes(film, levels); });
  std::printf("%-32s %5.1f %5.1f   %5.1f %5.1f   %5.1f %5.1f   %5.0f %5.0f %8zu %8zu  %.2f\n", name, transfer.wall,
              transfer.processor, file.wall, file.processor, whole.wall, whole.processor, other.wall, other.processor,
              png.size(), other_bytes, static_cast<double>(png.size()) / static_cast<double>(other_bytes));
}

}  // namespace

TEST_CASE("figures: encoding" * doctest::skip()) {
  std::printf(
      "800 x 800, 8 bit, ms by the clock and of the processor, median of %d\n%-32s %11s   %11s   %11s   %11s %8s %8s\n",
      runs, "", "sRGB", "PNG file", "both", "OpenImageIO", "bytes", "its");
  for (const char* name : {"room-flat", "teapot", "cow", "glass-and-mirrors", "hard-and-soft", "thousand-spheres"}) {
    const bool is_old = name == std::string("room-flat") || name == std::string("teapot");
    api::JobRequest job = is_old ? test::predecessor(name) : test::example(name);
    job.options.width = job.options.height = 800;
    print(name, *test::render(job).film);
    // As noisy as it gets: four shadow rays each.
    job.options.shadow_samples = 4;
    if (name == std::string("room-flat") || name == std::string("thousand-spheres"))
      print((std::string(name) + ", 4 shadow rays").c_str(), *test::render(job, test::with_candidates(false)).film);
  }
}
