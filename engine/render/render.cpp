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

/// One description on its way to a picture.
class Rendering {
 public:
  Rendering(const Compiled& compiled, const Camera& camera, const scene::Options& options, const Switches& switches,
            system::Pool& pool, int threads, Control& control)
      : compiled_(compiled),
        camera_(camera),
        options_(options),
        switches_(switches),
        pool_(pool),
        threads_(threads),
        control_(control),
        gain_(math::power_of_two(options.exposure)) {}

  /// All passes; nothing once it is canceled.
  std::shared_ptr<const Film> run();
  double seconds() const { return seconds_since(start_); }
  /// Of the picture, per channel, as the records tell.
  double estimated_error() const {
    double squared_error = 0;
    for (const TileRecord& record : records_) squared_error += record.squared_error;
    return gain_ * std::sqrt(std::max(0.0, squared_error) / (3.0 * options_.width * options_.height));
  }
  const std::vector<TileRecord>& records() const { return records_; }

 private:
  std::shared_ptr<Canvas> canvas(std::shared_ptr<const Film> backdrop) const {
    return std::make_shared<Canvas>(options_.width, options_.height, gain_, std::move(backdrop));
  }
  /// Paints every tile that `is_stopped` lets it, with `least` shadow samples if the pass has so many. Returns how many
  /// there were.
  int paint_all(const Pass& pass, int least, const std::function<bool()>& is_stopped, Canvas& canvas,
                std::vector<TileRecord>& records);
  /// After a pass with so many samples: the picture is further off than it may be, and more samples are allowed.
  bool needs_more(const Pass& pass, int shadow_samples) const;
  /// Somebody looks, or will have to wait: told by a few pixels and what they take.
  bool wants_preview(const Pass& pass) const;

  const Compiled& compiled_;
  const Camera& camera_;
  const scene::Options& options_;
  const Switches& switches_;
  system::Pool& pool_;
  const int threads_;
  Control& control_;
  const double gain_;
  const Clock::time_point start_ = Clock::now();
  std::vector<TileRecord> records_;
};

int Rendering::paint_all(const Pass& pass, int least, const std::function<bool()>& is_stopped, Canvas& canvas,
                         std::vector<TileRecord>& records) {
  PixelSampler sampler(compiled_.scene, camera_, options_, pass, switches_);
  sampler.prepare(least, is_stopped);
  records.resize(static_cast<std::size_t>(canvas.tile_count()));
  const std::uint64_t tile_work = pass.work / records.size();
  pool_.run(canvas.tile_count(), threads_, [&](std::int64_t task) {
    const int index = static_cast<int>(task);
    if (!paint(canvas.tile(index), pass.stride, sampler, is_stopped, switches_.empty_tiles, canvas,
               records[static_cast<std::size_t>(index)]))
      return;
    canvas.mark_done(index);
    control_.advance(tile_work);
  });
  return sampler.shadow_samples();
}

bool Rendering::needs_more(const Pass& pass, int shadow_samples) const {
  if (!options_.target_error || pass.stride > 1 || pass.samples_per_pixel > 1) return false;
  constexpr double of_target = 0.85;  // the estimate may be off, too
  return shadow_samples < pass.shadow_samples && estimated_error() > of_target * *options_.target_error;
}

bool Rendering::wants_preview(const Pass& pass) const {
  constexpr double long_s = 1;
  constexpr int pixels_each = 4096, most = 16;
  if (control_.is_watched()) return true;
  const double pixels = static_cast<double>(options_.width) * options_.height;
  const int count = std::clamp(static_cast<int>(pixels / pixels_each), 1, most);
  const PixelSampler sampler(compiled_.scene, camera_, options_, pass, switches_);
  const std::function<bool()> is_canceled = [&] { return control_.is_canceled(); };
  shading::Integrator integrator = sampler.integrator(is_canceled);
  const double enough_s = long_s * threads_ * count / pixels;  // of one thread
  const Clock::time_point begin = Clock::now();
  for (int i = 0; i < count; ++i) {
    const sampling::Key key = sampling::Key(options_.seed).at(static_cast<std::uint64_t>(i));
    const int x = static_cast<int>(key.uniform(0) * options_.width),
              y = static_cast<int>(key.uniform(1) * options_.height);
    sampler.sample({x, y, x + 1, y + 1}, is_canceled, integrator);
    if (seconds_since(begin) > enough_s) return true;
  }
  return false;
}

std::shared_ptr<const Film> Rendering::run() {
  const std::vector<Pass> passes = plan_passes(options_);
  std::uint64_t work_total = 0;
  for (const Pass& pass : passes) work_total += pass.work;
  const auto is_out_of_time = [&] { return options_.time_budget_s && seconds() > *options_.time_budget_s; };
  std::shared_ptr<Canvas> shown = canvas(nullptr);
  control_.attach(shown, work_total);
  // With a budget the passes themselves go from coarse to fine.
  const bool has_preview = !options_.time_budget_s && wants_preview(passes.front());
  if (has_preview) {
    std::vector<TileRecord> nobodys;
    paint_all(
        preview_pass(), 0, [&] { return control_.is_canceled(); }, *shown, nobodys);
  }
  for (const Pass& pass : passes) {
    // The first pass is cheap and must cover the picture; only later ones give way to the budget.
    const bool is_first = &pass == &passes.front();
    const auto is_stopped = [&] { return control_.is_canceled() || (!is_first && is_out_of_time()); };
    int samples = 0;
    do {
      shown = canvas(is_first && !has_preview && samples == 0 ? nullptr : shown->film());
      control_.attach(shown, work_total);
      samples = paint_all(pass, 2 * samples, is_stopped, *shown, records_);
    } while (!is_stopped() && needs_more(pass, samples));
    if (control_.is_canceled()) return nullptr;
    if (is_out_of_time()) break;
  }
  control_.finish();
  return shown->film();
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

  const Camera camera(description.camera, options.width, options.height);
  Rendering rendering(compiled, camera, options, switches, pool, threads, control);
  picture.film = rendering.run();
  if (!picture.film) return std::nullopt;
  shading::Counters counters;
  std::uint64_t empty_tiles = 0;
  for (const TileRecord& record : rendering.records()) counters += record.counters, empty_tiles += record.empty_tiles;
  picture.stats.estimated_error = rendering.estimated_error();
  picture.stats.render_s = rendering.seconds();
  picture.stats.rays = counters.rays;
  picture.stats.skipped = skipped(counters, compiled.merged_lights, empty_tiles);
  return picture;
}

}  // namespace penumbra::render
