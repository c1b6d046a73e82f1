// One scene, one picture: for any number of threads, any acceleration, with and without what only saves time.
#include "engine/render/render.h"

#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "engine/math/elementary.h"
#include "engine/output/encode.h"
#include "engine/system/cores.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;

namespace {

render::Picture rendered(const api::JobRequest& job, int threads = 2, const render::Switches& switches = {}) {
  system::Pool pool(threads);
  render::Control control;
  auto picture = render::render(job.scene, job.options, pool, control, switches);
  REQUIRE(picture);
  CHECK(control.percent() == 100);
  return std::move(*picture);
}

std::string png(const render::Film& film) { return output::encode(film, {}); }

double rmse(const render::Film& a, const render::Film& b) {
  REQUIRE(a.rgb.size() == b.rgb.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const double d = std::clamp(a.rgb[i], 0.0F, 1.0F) - std::clamp(b.rgb[i], 0.0F, 1.0F);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(a.rgb.size()));
}

}  // namespace

TEST_CASE("every thread mode gives the same bytes") {
  api::JobRequest job = test::zoo();
  job.options.threads = scene::serial;
  const render::Film serial = *rendered(job).film;
  for (const int threads : {scene::all_threads, scene::cores_less_two, 1, 3}) {
    job.options.threads = threads;
    CHECK(rendered(job, 4).film->rgb == serial.rgb);
  }
}

TEST_CASE("a thread count means what the contract says") {
  CHECK(render::thread_limit(scene::serial, 8) == 1);
  CHECK(render::thread_limit(scene::all_threads, 8) == 8);
  CHECK(render::thread_limit(3, 8) == 3);
  CHECK(render::thread_limit(30, 8) == 8);
  CHECK(render::thread_limit(scene::cores_less_two, 8) == std::clamp(system::available_cores() - 2, 1, 8));
}

TEST_CASE("every acceleration gives the same image") {
  for (api::JobRequest job : {test::zoo(), test::predecessor("room-groups"), test::predecessor("teapot")}) {
    job.options.width = job.options.height = 96;
    job.options.acceleration = scene::Acceleration::bvh;
    const render::Film best = *rendered(job).film;
    for (const auto acceleration : {scene::Acceleration::none, scene::Acceleration::cbr, scene::Acceleration::groups,
                                    scene::Acceleration::median}) {
      job.options.acceleration = acceleration;
      CHECK(png(*rendered(job).film) == png(best));
    }
  }
}

TEST_CASE(
    "every acceleration gives the same soft shadows: of meshes finer than pixels, of what may or may not be in sight") {
  // A ball of 3,200 triangles, some ten pixels wide, and a tall rod beside the shaft of a panel.
  std::string positions, indices;
  constexpr int rows = 40, columns = 40;
  for (int i = 0; i <= rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const double polar = math::pi * i / rows, azimuth = 2 * math::pi * j / columns;
      for (const double x : {std::sin(polar) * std::cos(azimuth), std::cos(polar), std::sin(polar) * std::sin(azimuth)})
        positions += std::to_string(x) + ",";
      if (i == rows) continue;
      const int a = i * columns + j, b = i * columns + (j + 1) % columns;
      for (const int k : {a, b, a + columns, b, b + columns, a + columns}) indices += std::to_string(k) + ",";
    }
  }
  positions.pop_back(), indices.pop_back();
  api::JobRequest job = api::parse_job(R"({"scene": {
    "camera": {"position": [0, 6, 12], "look_at": [0, 0, 0], "vertical_fov": 40},
    "objects": [{"type": "mesh", "positions": [)" +
                                       positions + R"(], "indices": [)" + indices + R"(]},
      {"type": "sphere", "center": [3.5, 0, 0], "radius": 1, "material": {"diffuse": 0.5, "specular": 0.3, "shininess": 20}},
      {"type": "cylinder", "point": [5.1, -5, 0], "direction": [0, 1, 0], "radius": 0.5, "height": 30},
      {"type": "polygon", "vertices": [[-9, -1.2, -9], [-9, -1.2, 9], [9, -1.2, 9], [9, -1.2, -9]]}],
    "lights": [{"type": "point", "position": [-4, 6, 2], "intensity": 0.5, "radius": 0.8},
      {"type": "rectangle", "corner": [2.5, 5, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "intensity": 2},
      {"type": "rectangle", "corner": [-4, 5, 0], "edge_u": [1, 0, 1], "edge_v": [1, 0, -1], "intensity": 1}]},
    "options": {"width": 48, "height": 48, "shadow_samples": 16}})");
  const render::Film best = *rendered(job).film;
  for (const auto acceleration : {scene::Acceleration::none, scene::Acceleration::cbr, scene::Acceleration::groups,
                                  scene::Acceleration::median}) {
    job.options.acceleration = acceleration;
    CHECK(png(*rendered(job).film) == png(best));
  }
}

TEST_CASE("what only saves time changes no picture beyond its sampling error") {
  api::JobRequest job = test::predecessor("room-flat");
  job.options.width = job.options.height = 120;
  job.options.shadow_samples = 256;
  const render::Picture fast = rendered(job);
  CHECK(fast.stats.skipped.at("shadow_rays_lit") > 0);
  CHECK(fast.stats.skipped.at("shadow_rays_dark") > 0);
  CHECK(fast.stats.skipped.at("shadow_rays_covered") > 0);
  CHECK(fast.stats.skipped.at("merged_lights") == 1);
  // The room's soft shadows are exact but for penumbrae: 256 samples leave less than 1e-3.
  CHECK(rmse(*fast.film, *rendered(job, 2, test::with_candidates(false)).film) < 1e-3);
}

TEST_CASE("seeds change the noise, not the picture") {
  api::JobRequest job = test::zoo();
  const render::Film first = *rendered(job).film;
  CHECK(rendered(job).film->rgb == first.rgb);
  job.options.seed = 7;
  const render::Film second = *rendered(job).film;
  CHECK(second.rgb != first.rgb);
  CHECK(rmse(first, second) < 0.02);
}

TEST_CASE("progress never falls, previews fill up, and a watcher may look at any time") {
  api::JobRequest job = test::zoo();
  job.options.shadow_samples = 64;
  system::Pool pool(2);
  render::Control control;
  std::atomic<bool> is_over = false;
  int previews = 0;
  std::jthread watcher([&] {
    double last = 0;
    while (!is_over) {
      const double now = control.percent();
      CHECK(now >= last);
      CHECK(now <= 100);
      last = now;
      if (control.preview().width == job.options.width) ++previews;
    }
  });
  const auto picture = render::render(job.scene, job.options, pool, control);
  is_over = true;
  watcher.join();
  REQUIRE(picture);
  CHECK(previews > 0);
  CHECK(control.preview().rgb == picture->film->rgb);
}

TEST_CASE("a preview shows the whole frame while hardly anything is rendered") {
  api::JobRequest job = test::zoo();
  job.scene.background = {0.2, 0.3, 0.5};
  job.options.width = 640, job.options.height = 480;
  api::JobRequest quick = job;
  quick.options.shadow_samples = 4;
  const auto ought = rendered(quick);
  job.options.samples_per_pixel = 64, job.options.shadow_samples = 64;
  system::Pool pool(2);
  render::Control control;
  render::Film seen;
  constexpr double most_percent = 2;
  double percent = 0;
  std::jthread watcher([&] {
    const auto is_whole = [&] {
      seen = control.preview();
      percent = control.percent();
      return seen.width > 0 && std::ranges::none_of(seen.rgb, [](float value) { return value == 0; });
    };
    while (!is_whole() && percent < most_percent) std::this_thread::yield();
    control.cancel();
  });
  CHECK_FALSE(render::render(job.scene, job.options, pool, control));
  watcher.join();
  CHECK(percent < most_percent);
  CHECK(rmse(seen, *ought.film) < 0.15);
}

TEST_CASE("a cancel stops the render within a tile row, wherever it is") {
  api::JobRequest job = test::zoo();
  job.options.width = job.options.height = 2000;
  job.options.samples_per_pixel = 64;
  system::Pool pool(2);
  render::Control control;
  std::jthread canceler([&] {
    while (control.percent() == 0 && control.preview().width == 0) std::this_thread::yield();
    control.cancel();
  });
  CHECK_FALSE(render::render(job.scene, job.options, pool, control));
  CHECK(control.percent() < 50);
}

TEST_CASE("mirrors that reflect each other for ever can be canceled inside a pixel") {
  const api::JobRequest job = api::parse_job(R"({"scene": {
    "camera": {"position": [0, 0, 0], "direction": [0, 0, -1], "vertical_fov": 60},
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 2, "material": {"reflection": 1, "transmission": 1}},
                {"type": "sphere", "center": [0, 0, 0], "radius": 4, "material": {"reflection": 1, "transmission": 1}}]},
    "options": {"width": 1, "height": 1, "max_depth": 32, "min_contribution": 0}})");
  system::Pool pool(1);
  render::Control control;
  std::jthread canceler([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    control.cancel();
  });
  CHECK_FALSE(render::render(job.scene, job.options, pool, control));
}

TEST_CASE("thousands of soft lights behind glass can be canceled inside a pixel") {
  std::string glass, lights;
  for (int i = 0; i < 20; ++i)
    glass += R"({"type": "sphere", "center": [0, 0, )" + std::to_string(2 + i) +
             R"(], "radius": 0.4, "material": "glass"},)";
  for (int i = 0; i < 3000; ++i)
    lights += std::string(i == 0 ? "" : ",") +
              R"({"type": "point", "position": [0, 0, 30], "intensity": 1e-4, "radius": )" +
              std::to_string(1 + i * 1e-4) + "}";
  const api::JobRequest job = api::parse_job(
      R"({"scene": {"camera": {"position": [0, 3, 1], "look_at": [0, 0, 0], "vertical_fov": 1},
    "materials": {"glass": {"transmission": 0.9}}, "lights": [)" +
      lights + R"(],
    "objects": [)" +
      glass + R"({"type": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}]},
    "options": {"width": 1, "height": 1, "shadow_samples": 4096, "acceleration": "none"}})");
  system::Pool pool(1);
  render::Control control;
  std::chrono::steady_clock::time_point canceled_at;
  std::jthread canceler([&] {
    while (control.preview().width == 0) std::this_thread::yield();  // until it is compiled
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    canceled_at = std::chrono::steady_clock::now();
    control.cancel();
  });
  // By rays alone, to the end, it would take many seconds.
  render::Switches by_rays;
  by_rays.shadow_candidates = false;
  CHECK_FALSE(render::render(job.scene, job.options, pool, control, by_rays));
  canceler.join();
  CHECK(std::chrono::steady_clock::now() - canceled_at < std::chrono::seconds(2));
}

TEST_CASE("renders share a pool, and each gives its own picture") {
  const api::JobRequest job = test::zoo();
  const render::Film alone = *rendered(job).film;
  system::Pool pool(2);
  std::vector<std::jthread> users;
  for (int i = 0; i < 4; ++i) {
    users.emplace_back([&] {
      render::Control control;
      const auto picture = render::render(job.scene, job.options, pool, control);
      CHECK(picture->film->rgb == alone.rgb);
    });
  }
}

TEST_CASE("a pool runs every task once, on no more threads than allowed") {
  system::Pool pool(3);
  std::atomic<int> now = 0, most = 0;
  std::vector<std::atomic<int>> runs(200);
  pool.run(200, 2, [&](std::int64_t i) {
    int seen = most;
    const int here = ++now;
    while (here > seen && !most.compare_exchange_weak(seen, here)) {
    }
    ++runs[static_cast<std::size_t>(i)];
    --now;
  });
  CHECK(most <= 2);
  CHECK(std::all_of(runs.begin(), runs.end(), [](const auto& n) { return n == 1; }));
}

TEST_CASE("a time budget that is over at once still gives a whole picture, a coarse one") {
  api::JobRequest job = test::predecessor("room-flat");
  job.options.width = job.options.height = 200;
  const render::Picture exact = rendered(job);
  // Sample counts that would take hours, were the budget not kept.
  job.options.shadow_samples = 4096;
  job.options.samples_per_pixel = 1024;
  job.options.time_budget_s = 1e-9;
  const render::Picture coarse = rendered(job);
  CHECK(coarse.stats.rays.camera <= 2 * 7 * 7);  // two for each tile of 32 pixels
  const double whole = rmse(*coarse.film, *exact.film);
  const double missing = rmse(render::Film(200, 200), *exact.film);
  CHECK(whole < missing / 3);
}

TEST_CASE("a time budget that suffices changes nothing") {
  api::JobRequest job = test::predecessor("room-flat");
  job.options.width = job.options.height = 60;
  job.options.samples_per_pixel = 4;
  const render::Picture free = rendered(job);
  job.options.time_budget_s = 1e9;
  CHECK(rendered(job).film->rgb == free.film->rgb);
}

TEST_CASE("a target error saves work where the picture is smooth") {
  api::JobRequest job = test::predecessor("room-flat");
  job.options.width = job.options.height = 120;
  job.options.samples_per_pixel = 64;
  const render::Picture full = rendered(job);
  job.options.target_error = 0.02;
  const render::Picture adaptive = rendered(job);
  CHECK(adaptive.stats.rays.camera < full.stats.rays.camera / 2);
  CHECK(rmse(*adaptive.film, *full.film) < 0.02);
}

TEST_CASE("exposure multiplies the picture and its errors, also the one asked for") {
  api::JobRequest job = test::zoo();
  job.options.width = job.options.height = 40;
  for (const std::optional<double> target : {std::optional<double>(), std::optional<double>(0.01)}) {
    job.options.exposure = 0;
    job.options.target_error = target;
    const render::Picture plain = rendered(job);
    REQUIRE(plain.stats.estimated_error > 0);
    for (const double stops : {3.0, -2.0, 0.5}) {
      const double gain = std::exp2(stops);
      job.options.exposure = stops;
      if (target) job.options.target_error = *target * gain;
      const render::Picture exposed = rendered(job);
      CHECK(exposed.stats.estimated_error == doctest::Approx(gain * plain.stats.estimated_error));
      CHECK(exposed.stats.rays.camera == plain.stats.rays.camera);
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < plain.film->rgb.size(); ++i) {
        const double expected = gain * plain.film->rgb[i], found = exposed.film->rgb[i];
        wrong += std::fabs(found - expected) <= 1e-6 * std::fabs(expected) ? 0 : 1;
      }
      CHECK(wrong == 0);
    }
  }
}
