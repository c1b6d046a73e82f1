#include "tests/accuracy/oracle.h"

#include <doctest/doctest.h>

#include <thread>

#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;

namespace {

struct Comparison {
  double rmse, oracle_noise;
};

/// Penumbra's film against the oracle on `count` random pixels, with 2 × `half_samples` samples a light; the oracle's
/// own error follows from the difference of its halves.
Comparison compare(const api::JobRequest& job, int count, int half_samples, bool skips_diagonal = false) {
  const render::Film film = *test::render(job).film;
  std::vector<double> squares(2), noise(2);
  std::vector<std::jthread> halves;
  for (unsigned long worker = 0; worker < 2; ++worker) {
    halves.emplace_back([&, worker] {
      std::mt19937_64 random(worker);
      std::uniform_int_distribution<int> column(0, film.width - 1), row(0, film.height - 1);
      test::Oracle first(job.scene, job.options, half_samples, 10 + worker),
          second(job.scene, job.options, half_samples, 20 + worker);
      for (int i = 0; i < count / 2; ++i) {
        int x = column(random);
        const int y = row(random);
        if (skips_diagonal && x == y) x = (x + 1) % film.width;
        const auto a = first.pixel(x, y), b = second.pixel(x, y);
        for (std::size_t c = 0; c < 3; ++c) {
          const double exact = std::clamp(0.5 * (a[c] + b[c]), 0.0, 1.0);
          const double d = std::clamp<double>(film.rgb[film.offset(x, y) + c], 0, 1) - exact;
          const double half = std::clamp(a[c], 0.0, 1.0) - std::clamp(b[c], 0.0, 1.0);
          squares[worker] += d * d, noise[worker] += half * half / 4;
        }
      }
    });
  }
  halves.clear();
  const double channels = 3.0 * (count / 2) * 2;
  return {std::sqrt((squares[0] + squares[1]) / channels), std::sqrt((noise[0] + noise[1]) / channels)};
}

}  // namespace

TEST_CASE("room-flat at 64 shadow samples is within 2e-3 of brute force with 4,096") {
  const Comparison found = compare(test::predecessor("room-flat"), 1000, 2048);
  MESSAGE("RMSE against the oracle ", found.rmse, ", of which the oracle's own noise ", found.oracle_noise);
  CHECK(found.rmse <= 2e-3);
}

TEST_CASE("the scene with mirrors and coloured transmission agrees with brute force") {
  // The image's diagonal runs exactly along the edge the two mirrors share: either may be hit there.
  const Comparison found = compare(test::predecessor("reflection-spheres-mirrors"), 20000, 1, true);
  MESSAGE("RMSE against the oracle ", found.rmse);
  CHECK(found.rmse < 1e-6);
}
