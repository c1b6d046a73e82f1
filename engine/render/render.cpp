#include "engine/render/render.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "engine/math/elementary.h"
#include "engine/render/camera.h"
#include "engine/render/canvas.h"
#include "engine/render/compile.h"
#include "engine/render/refine.h"
#include "engine/shading/integrator.h"
#include "engine/system/cores.h"

namespace penumbra::render {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::map<std::string, std::uint64_t> skipped(const shading::Counters& counters, std::uint64_t merged_lights,
                                             std::uint64_t empty_tiles) {
  std::map<std::string, std::uint64_t> result{{"empty_tiles", empty_tiles}, {"merged_lights", merged_lights}};
  for (const auto& [name, count] : shading::by_name_of_work(counters)) result[name] = *count;
  return result;
}

/// What painting a tile leaves behind. Summed in tile order, so that it depends on nothing else.
struct TileRecord {
  shading::Counters counters;     // of every pass
  std::uint64_t empty_tiles = 0;  // of every pass
  double squared_error = 0;       // summed over pixels and channels, of the last pass that was finished
};

/// Paints one tile into `canvas`; `skips_empty`: without rays if it shows nothing. False if `is_stopped` cut it short.
bool paint(const Canvas::Tile& tile, int stride, const PixelSampler& sampler, const std::function<bool()>& is_stopped,
           bool skips_empty, Canvas& canvas, TileRecord& record) {
  const std::optional<math::Color> background = sampler.background_of(tile);
  if (background && skips_empty) {
    ++record.empty_tiles;
    for (int y = tile.top; y < tile.bottom; ++y) {
      for (int x = tile.left; x < tile.right; ++x) canvas.set(x, y, *background);
    }
    record.squared_error = 0;
    return !is_stopped();
  }
  shading::Integrator integrator = sampler.integrator(is_stopped);
  const std::vector<Pixel> pixels = sampler.sample(tile, is_stopped, integrator);
  record.counters += integrator.counters();
  if (is_stopped()) return false;
  double squared_error = 0;
  const int blocks_across = (tile.right - tile.left + stride - 1) / stride;
  for (int y = tile.top; y < tile.bottom; ++y) {
    for (int x = tile.left; x < tile.right; ++x) {
      const int block = (y - tile.top) / stride * blocks_across + (x - tile.left) / stride;
      const Pixel& pixel = pixels[static_cast<std::size_t>(block)];
      canvas.set(x, y, pixel.color);
      squared_error += pixel.squared_error;
    }
  }
  record.squared_error = squared_error;
  return true;
}

}  // namespace

int thread_limit(int threads, int pool_size) {
  if (threads == scene::serial) return 1;
  if (threads == scene::cores_less_two) return std::clamp(system::available_cores() - 2, 1, pool_size);
  return threads < 0 ? pool_size : std::min(threads, pool_size);
}

std::optional<Picture> render(const scene::Description& description, const scene::Options& options, system::Pool& pool,
                              Control& control, const Switches& switches) {
  const Clock::time_point start = Clock::now();
  const int threads = thread_limit(options.threads, pool.size());
  const accel::ParallelFor on_pool = [&](std::int64_t count, const std::function<void(std::int64_t)>& task) {
    pool.run(count, threads, task);
  };
  const Compiled compiled = compile(
      description, {options.acceleration, switches.merge_lights, on_pool, [&] { return control.is_canceled(); }});
  Picture picture;
  picture.stats.build_s = seconds_since(start);
  if (control.is_canceled()) return std::nullopt;

  const Clock::time_point render_start = Clock::now();
  const Camera camera(description.camera, options.width, options.height);
  const std::vector<Pass> passes = plan_passes(options);
  std::uint64_t work_total = 0;
  for (const Pass& pass : passes) work_total += pass.work;
  const auto is_out_of_time = [&] {
    return options.time_budget_s && seconds_since(render_start) > *options.time_budget_s;
  };

  const double gain = math::power_of_two(options.exposure);
  std::shared_ptr<Canvas> canvas;
  std::vector<TileRecord> records;
  for (const Pass& pass : passes) {
    canvas = std::make_shared<Canvas>(options.width, options.height, gain, canvas ? canvas->film() : nullptr);
    control.attach(canvas, work_total);
    const PixelSampler sampler(compiled.scene, camera, options, pass, switches);
    // The first pass is cheap and must cover the picture; only later ones give way to the budget.
    const bool is_first = &pass == &passes.front();
    const std::function<bool()> is_stopped = [&] { return control.is_canceled() || (!is_first && is_out_of_time()); };
    records.resize(static_cast<std::size_t>(canvas->tile_count()));
    const std::uint64_t tile_work = pass.work / records.size();
    pool.run(canvas->tile_count(), threads, [&](std::int64_t task) {
      const int index = static_cast<int>(task);
      if (!paint(canvas->tile(index), pass.stride, sampler, is_stopped, switches.empty_tiles, *canvas,
                 records[static_cast<std::size_t>(index)]))
        return;
      canvas->mark_done(index);
      control.advance(tile_work);
    });
    if (control.is_canceled()) return std::nullopt;
    if (is_out_of_time()) break;
  }
  control.finish();
  shading::Counters counters;
  double squared_error = 0;
  std::uint64_t empty_tiles = 0;
  for (const TileRecord& record : records) {
    counters += record.counters, squared_error += record.squared_error;
    empty_tiles += record.empty_tiles;
  }
  picture.stats.estimated_error = gain * std::sqrt(squared_error / (3.0 * options.width * options.height));
  picture.film = canvas->film();
  picture.stats.render_s = seconds_since(render_start);
  picture.stats.rays = counters.rays;
  picture.stats.skipped = skipped(counters, compiled.merged_lights, empty_tiles);
  return picture;
}

}  // namespace penumbra::render
