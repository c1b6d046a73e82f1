#include "engine/output/thumbnail.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace penumbra::output {

namespace {

/// Where a pixel of a line goes in a shorter line, and which parts of a pixel there it fills.
struct Share {
  std::size_t first = 0;
  float here = 0, next = 0;  // of `first` and of the pixel after it
};

std::vector<Share> shares_of(int from, int to) {
  std::vector<Share> shares;
  shares.reserve(static_cast<std::size_t>(from));
  // In units of which a pixel here has `to` and one there `from`.
  for (std::int64_t begin = 0; begin < std::int64_t{from} * to; begin += to) {
    const std::int64_t first = begin / from, here = std::min<std::int64_t>(to, (first + 1) * from - begin);
    const auto part = [&](std::int64_t units) { return static_cast<float>(units) / static_cast<float>(from); };
    shares.push_back({static_cast<std::size_t>(first), part(here), part(to - here)});
  }
  return shares;
}

}  // namespace

render::Film thumbnail(const render::Film& film, int longest) {
  const int edge = std::max(film.width, film.height);
  if (edge <= longest) return film;
  const auto scaled = [&](int length) {
    return std::max(1, static_cast<int>((2 * std::int64_t{length} * longest + edge) / (2 * std::int64_t{edge})));
  };
  render::Film small(scaled(film.width), scaled(film.height));
  const std::vector<Share> columns = shares_of(film.width, small.width), rows = shares_of(film.height, small.height);
  const std::size_t row_values = 3 * static_cast<std::size_t>(small.width);
  std::vector<float> row(row_values + 3);
  const float* pixel = film.rgb.data();
  for (const Share& vertical : rows) {
    std::fill(row.begin(), row.end(), 0.0F);
    for (const Share& horizontal : columns) {
      float* const out = row.data() + 3 * horizontal.first;
      for (std::size_t c = 0; c < 3; ++c) {
        // NaN becomes 0, as everywhere in output/.
        const float value = pixel[c] > 0 ? std::min(pixel[c], 1.0F) : 0.0F;
        out[c] += horizontal.here * value;
        out[c + 3] += horizontal.next * value;
      }
      pixel += 3;
    }
    float* const out = small.rgb.data() + row_values * vertical.first;
    const bool is_shared = vertical.next > 0;
    for (std::size_t i = 0; i < row_values; ++i) {
      out[i] += vertical.here * row[i];
      if (is_shared) out[i + row_values] += vertical.next * row[i];
    }
  }
  return small;
}

}  // namespace penumbra::output
