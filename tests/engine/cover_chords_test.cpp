// What a cover hides of a chord, in lanes beside the definition.
#include "engine/shading/shadows/cover_chords.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/robustness/worlds.h"

using namespace penumbra;

TEST_CASE("chords are clipped to where all edges and the ellipse are not negative") {
  test::Random random(31);
  int inside = 0, outside = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto count = static_cast<std::size_t>(4 * (1 + i % 5)), used = count - static_cast<std::size_t>(i % 4);
    std::vector<double> offset(count), begin(count), end(count), from(count), to(count);
    std::vector<std::uint8_t> hits((count + 7) / 8);
    for (std::size_t k = 0; k < used; ++k) {
      offset[k] = random.between(-1, 1);
      end[k] = std::sqrt(1 - offset[k] * offset[k]), begin[k] = -end[k];
    }
    std::array<shading::shadows::Linear, 4> edges;
    const auto edge_count = static_cast<std::size_t>(random.below(5));
    for (std::size_t e = 0; e < edge_count; ++e) {
      // Every tenth edge runs along the chords.
      edges[e] = {random.between(-0.3, 1), random.between(-1, 1), i % 10 == 0 ? 0 : random.between(-1, 1)};
    }
    // r² − |p − center|², squeezed and turned.
    const double cx = random.between(-1, 1), cy = random.between(-1, 1), r = random.between(0.05, 1.5),
                 sx = random.between(0.2, 3), sy = random.between(0.2, 3), turn = random.between(-1, 1);
    const shading::shadows::Quadratic ellipse{r * r - sx * cx * cx - sy * cy * cy - 2 * turn * cx * cy * 0.2,
                                              sx * cx + turn * cy * 0.2,
                                              sy * cy + turn * cx * 0.2,
                                              -sx,
                                              -turn * 0.2,
                                              -sy};
    const bool is_round = i % 3 != 0;
    const auto least = [&](double s, double t) {
      double value = is_round ? ellipse.a + 2 * ellipse.b * s + 2 * ellipse.c * t + ellipse.d * s * s +
                                    2 * ellipse.e * s * t + ellipse.f * t * t
                              : math::infinity;
      for (std::size_t e = 0; e < edge_count; ++e)
        value = std::min(value, edges[e].a + edges[e].b * s + edges[e].c * t);
      return value;
    };
    clip_to_cover(std::span(edges).first(edge_count), is_round ? &ellipse : nullptr,
                  {offset.data(), begin.data(), end.data(), count}, {from.data(), to.data(), hits.data()});
    for (std::size_t k = 0; k < count; ++k) {
      CHECK((hits[k / 8] >> (k % 8) & 1) == (from[k] < to[k] ? 1 : 0));
      if (k >= used) CHECK_FALSE(from[k] < to[k]);
      for (int step = 0; step < 32; ++step) {
        const double t = begin[k] + (end[k] - begin[k]) * random.between(0, 1);
        const double value = least(offset[k], t);
        if (std::fabs(value) < 1e-9 || k >= used) continue;
        const bool is_hidden = from[k] < to[k] && from[k] < t && t < to[k];
        CHECK(is_hidden == (value > 0));
        ++(value > 0 ? inside : outside);
      }
    }
  }
  CHECK(inside > 50'000);
  CHECK(outside > 50'000);
}
