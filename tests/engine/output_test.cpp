#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <thread>

#include "engine/output/encode.h"
#include "engine/output/thumbnail.h"
#include "engine/output/transfer.h"
#include "tests/support/temporary_directory.h"

using namespace penumbra;

namespace {

render::Film ramp() {
  render::Film film(37, 23);
  for (std::size_t i = 0; i < film.rgb.size(); ++i)
    film.rgb[i] = static_cast<float>(1.2 * std::fmod(0.618 * static_cast<double>(i), 1) - 0.1);
  return film;
}

/// The file's values through an independent reader.
template <class Value>
std::vector<Value> read_back(const std::string& bytes, const char* ending, OIIO::TypeDesc type) {
  const test::TemporaryDirectory folder;
  const std::string path = folder / ("picture" + std::string(ending));
  std::ofstream(path, std::ios::binary) << bytes;
  const auto file = OIIO::ImageInput::open(path);
  REQUIRE(file);
  CHECK(file->spec().width == 37);
  CHECK(file->spec().height == 23);
  std::vector<Value> values(37 * 23 * 3);
  CHECK(file->read_image(0, 0, 0, 3, type, values.data()));
  file->close();
  return values;
}

double srgb(double linear) { return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055; }

}  // namespace

TEST_CASE("sRGB levels are the nearest ones, and clamp") {
  render::Film film(1, 1);
  for (int i = 0; i <= 100'000; ++i) {
    const float value = static_cast<float>(i) / 100'000;
    film.rgb = {value, -1, 7};
    const auto levels = output::to_8_bit(film, scene::Transfer::srgb);
    const double exact = 255 * srgb(value);
    CHECK(std::fabs(levels[0] - exact) <= 0.5 + 1e-9);
    CHECK(levels[1] == 0);
    CHECK(levels[2] == 255);
    CHECK(std::fabs(output::to_16_bit(film, scene::Transfer::srgb)[0] - 65535 * srgb(value)) <= 0.5 + 1e-6);
    CHECK(output::to_8_bit(film, scene::Transfer::linear)[0] == std::lround(255.0 * value));
  }
}

TEST_CASE("the sRGB level changes exactly where rounding to nearest does, for 8 and 16 bits") {
  const auto check = [](const auto& to_levels, int top) {
    render::Film film(top, 2);
    // Per boundary between two levels the two floats around it; blue is no number.
    for (int level = 0; level < top; ++level) {
      const long double e = (level + 0.5L) / top;
      const long double linear = e <= 0.04045L ? e / 12.92L : std::pow((e + 0.055L) / 1.055L, 2.4L);
      const auto near = static_cast<float>(linear);
      for (int row = 0; row < 2; ++row) {
        const bool is_upper = row == 1, goes_up = (near >= linear) != is_upper && is_upper;
        const bool goes_down = near >= linear && !is_upper;
        film.rgb[film.offset(level, row)] = goes_up     ? std::nextafter(near, 1.0F)
                                            : goes_down ? std::nextafter(near, 0.0F)
                                                        : near;
        film.rgb[film.offset(level, row) + 2] = std::nanf("");
      }
    }
    const auto levels = to_levels(film, scene::Transfer::srgb);
    int wrong = 0;
    for (int level = 0; level < top; ++level) {
      if (levels[film.offset(level, 0)] != level || levels[film.offset(level, 1)] != level + 1) ++wrong;
      if (levels[film.offset(level, 0) + 2] != 0) ++wrong;
    }
    CHECK(wrong == 0);
  };
  check(output::to_8_bit, 255);
  check(output::to_16_bit, 65535);
}

TEST_CASE("PNG files hold the levels, 8 and 16 bit, and are the same every time") {
  const render::Film film = ramp();
  for (const auto transfer : {scene::Transfer::srgb, scene::Transfer::linear}) {
    const std::string png8 = output::encode(film, {scene::ImageFormat::png, transfer, 8});
    CHECK(png8 == output::encode(film, {scene::ImageFormat::png, transfer, 8}));
    CHECK(read_back<std::uint8_t>(png8, ".png", OIIO::TypeDesc::UINT8) == output::to_8_bit(film, transfer));
    const std::string png16 = output::encode(film, {scene::ImageFormat::png, transfer, 16});
    CHECK(read_back<std::uint16_t>(png16, ".png", OIIO::TypeDesc::UINT16) == output::to_16_bit(film, transfer));
  }
}

TEST_CASE("EXR files hold the floats themselves, unclamped") {
  const render::Film film = ramp();
  const std::string exr = output::encode(film, {scene::ImageFormat::exr, scene::Transfer::srgb, 8});
  CHECK(std::ranges::equal(read_back<float>(exr, ".exr", OIIO::TypeDesc::FLOAT), film.rgb));
}

TEST_CASE("EXR files are the same whenever they are written") {
  const output::Encoding encoding{scene::ImageFormat::exr, scene::Transfer::srgb, 8};
  const std::string first = output::encode(ramp(), encoding);
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // the library's clock has seconds
  CHECK(output::encode(ramp(), encoding) == first);
}

TEST_CASE("a PNG is read back as it was written, to half a level") {
  const render::Film film = ramp(), read = output::decode_png(output::encode(film, {}));
  REQUIRE(read.width == 37);
  REQUIRE(read.height == 23);
  for (std::size_t i = 0; i < film.rgb.size(); ++i) {
    const double expected = 255 * srgb(std::clamp(film.rgb[i], 0.0F, 1.0F)), level = 255 * srgb(read.rgb[i]);
    REQUIRE(std::fabs(level - expected) <= 0.501);
  }
  CHECK_THROWS_AS(output::decode_png("no PNG"), std::runtime_error);
}

TEST_CASE("a thumbnail is the mean, in clamped linear light, of the area under each of its pixels") {
  render::Film film(5, 2);
  for (std::size_t i = 0; i < film.rgb.size(); ++i) film.rgb[i] = i % 3 == 0 ? 3 : i % 3 == 1 ? 0.25F : -1;
  film.rgb[0] = 0, film.rgb[15] = 0;
  const render::Film small = output::thumbnail(film, 2);
  REQUIRE(small.width == 2);
  REQUIRE(small.height == 1);
  CHECK(small.rgb[0] == doctest::Approx(1.5 / 2.5));  // one pixel of two and a half is black
  CHECK(small.rgb[1] == doctest::Approx(0.25));
  CHECK(small.rgb[2] == 0);
  CHECK(small.rgb[3] == doctest::Approx(1));
  CHECK(output::thumbnail(film, 5).rgb == film.rgb);
  CHECK(output::thumbnail(render::Film(3, 2000), 256).width == 1);
}

TEST_CASE("a thumbnail keeps the light of the picture, whatever its size") {
  const render::Film film = ramp();
  for (const int longest : {1, 2, 7, 36}) {
    const render::Film small = output::thumbnail(film, longest);
    CHECK(small.width == longest);
    double before = 0, after = 0;
    for (const float v : film.rgb) before += std::clamp(v, 0.0F, 1.0F);
    for (const float v : small.rgb) after += v;
    CHECK(after / static_cast<double>(small.rgb.size()) ==
          doctest::Approx(before / static_cast<double>(film.rgb.size())).epsilon(1e-4));
  }
}
