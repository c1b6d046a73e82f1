#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <thread>

#include "engine/output/encode.h"
#include "engine/output/transfer.h"

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
  const std::string path = std::tmpnam(nullptr) + std::string(ending);  // NOLINT
  std::ofstream(path, std::ios::binary) << bytes;
  const auto file = OIIO::ImageInput::open(path);
  REQUIRE(file);
  CHECK(file->spec().width == 37);
  CHECK(file->spec().height == 23);
  std::vector<Value> values(37 * 23 * 3);
  CHECK(file->read_image(0, 0, 0, 3, type, values.data()));
  file->close();
  std::remove(path.c_str());
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
