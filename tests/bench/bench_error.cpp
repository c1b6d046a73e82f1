// Time against error: Penumbra beside brute force with Embree, interleaved in one process, against a reference.
// Usage: bench_error SCENE.json --references FOLDER [--json FILE] [--threads N] [--runs N] [--edge PIXELS]
//                    [--target RMSE] [--save FOLDER] [--only penumbra]
// Budgets grow until the error is below the target. --save writes the pictures of the largest budgets as bare floats,
// three a pixel.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "engine/output/encode.h"
#include "engine/render/render.h"
#include "tests/bench/embree_image.h"
#include "tests/bench/reference.h"
#include "tests/bench/workload.h"

namespace penumbra::bench {
namespace {

struct Arguments {
  std::string scene, references, json, save, only;
  int threads = 2, runs = 5, edge = 800;
  double target = 1e-3;
};

struct Error {
  double rmse = 0, p99 = 0, most = 0;
};

/// The contract's error: linear light, clamped to [0, 1]; p99 and most are of a pixel's worst channel.
Error error_of(const render::Film& film, const render::Film& reference) {
  std::vector<double> worst(film.rgb.size() / 3);
  double squared = 0;
  for (std::size_t i = 0; i < film.rgb.size(); ++i) {
    const double difference =
        static_cast<double>(std::clamp(film.rgb[i], 0.0f, 1.0f) - std::clamp(reference.rgb[i], 0.0f, 1.0f));
    squared += difference * difference;
    worst[i / 3] = std::max(worst[i / 3], std::fabs(difference));
  }
  std::sort(worst.begin(), worst.end());
  return {std::sqrt(squared / static_cast<double>(film.rgb.size())), worst[worst.size() * 99 / 100], worst.back()};
}

/// A renderer at one budget, and what was measured of it.
struct Budget {
  int samples;
  std::vector<double> seconds, rmse, p99, most;
};

struct Contestant {
  std::string name;
  std::string family;  // of those that give the same image for the same samples
  /// Renders with this many samples and this seed; returns the film and the seconds of rendering alone.
  std::function<std::pair<render::Film, double>(int, std::uint64_t)> render;
  std::vector<int> samples;  // ascending: what it may be asked for
  std::vector<Budget> budgets;
  render::Film best;     // of the last budget
  bool is_done = false;  // needs no larger budget
};

void measure(const Contestant& contestant, Budget& budget, std::uint64_t seed, const render::Film& reference,
             render::Film& film) {
  double seconds = 0;
  std::tie(film, seconds) = contestant.render(budget.samples, seed);
  const Error error = error_of(film, reference);
  budget.seconds.push_back(seconds), budget.rmse.push_back(error.rmse);
  budget.p99.push_back(error.p99), budget.most.push_back(error.most);
}

void save(const std::string& name, const render::Film& film) {
  std::ofstream(name + ".f32", std::ios::binary)
      .write(reinterpret_cast<const char*>(film.rgb.data()),
             static_cast<std::streamsize>(film.rgb.size() * sizeof(float)));
}

nlohmann::json to_json(const Contestant& contestant) {
  nlohmann::json budgets = nlohmann::json::array();
  for (const Budget& b : contestant.budgets) {
    budgets.push_back(
        {{"samples", b.samples}, {"seconds", b.seconds}, {"rmse", b.rmse}, {"p99", b.p99}, {"max", b.most}});
  }
  return {{"name", contestant.name}, {"budgets", budgets}};
}

/// Where packets are full: from so many samples on, whoever is slower than its family stays so.
constexpr int full_packets = 64;

/// Ends those that took longer than `allowed` times the quickest of their family for the samples just measured.
void drop_slow(std::vector<Contestant>& contestants, std::size_t budget) {
  constexpr double allowed = 1.25;
  std::map<std::string, double> least;
  const auto has_it = [&](const Contestant& c) { return c.budgets.size() == budget + 1; };
  for (const Contestant& c : contestants) {
    if (!has_it(c)) continue;
    const double seconds = c.budgets.back().seconds.front();
    least[c.family] = least.contains(c.family) ? std::min(least[c.family], seconds) : seconds;
  }
  for (Contestant& c : contestants) {
    if (!has_it(c) || c.budgets.back().samples < full_packets ||
        c.budgets.back().seconds.front() <= allowed * least[c.family]) {
      continue;
    }
    c.budgets.pop_back();
    c.is_done = true;
  }
}

/// The first round finds how many budgets each contestant needs; the others repeat it, all in turn, with new seeds.
void compete(std::vector<Contestant>& contestants, const render::Film& reference, const Arguments& arguments) {
  constexpr std::size_t least_budgets = 5;
  const auto is_done = [](const Contestant& c) { return c.is_done; };
  for (std::size_t budget = 0; !std::ranges::all_of(contestants, is_done); ++budget) {
    for (Contestant& contestant : contestants) {
      if (contestant.is_done) continue;
      contestant.budgets.push_back({contestant.samples[budget], {}, {}, {}, {}});
      measure(contestant, contestant.budgets.back(), 0, reference, contestant.best);
      const bool is_reached = contestant.budgets.back().rmse.front() < arguments.target;
      contestant.is_done = (is_reached && contestant.budgets.size() >= least_budgets) ||
                           contestant.budgets.size() == contestant.samples.size();
    }
    drop_slow(contestants, budget);
  }
  render::Film film;
  for (int run = 1; run < arguments.runs; ++run) {
    for (Contestant& contestant : contestants) {
      for (Budget& budget : contestant.budgets)
        measure(contestant, budget, static_cast<std::uint64_t>(run), reference, film);
    }
  }
}

/// One for each width of packets, in both modes. All arguments outlive the contestants.
void add_embree(const scene::Description& description, const FlatScene& flat, const EmbreeScene& embree,
                const EmbreeScene& robust, const Arguments& arguments, std::vector<Contestant>& contestants) {
  for (const bool is_robust : {false, true}) {
    for (const int width : {1, 8, 16}) {
      contestants.push_back(
          {"embree " + std::to_string(width) + (is_robust ? " robust" : ""),
           is_robust ? "embree robust" : "embree",
           [&, is_robust, width](int samples, std::uint64_t seed) {
             const BruteForceSettings settings{arguments.edge, arguments.edge, samples, width, arguments.threads, seed};
             render::Film film;
             const double seconds =
                 timed([&] { film = brute_force(description, flat, is_robust ? robust : embree, settings); });
             return std::pair(std::move(film), seconds);
           },
           {1, 4, 9, 16, 64, 256, 1024},
           {},
           {}});
    }
  }
}

void print_report(const Arguments& arguments, const scene::Description& description, const Reference& reference,
                  double parse_s, const nlohmann::json& build_s, const std::vector<Contestant>& contestants) {
  std::string bytes;
  const double encode_s = timed([&] { bytes = output::encode(contestants.front().best, {}); });
  std::printf("%s, %d x %d, %d threads, %d seeds; the reference's own RMSE is %.1e\n", description.name.c_str(),
              arguments.edge, arguments.edge, arguments.threads, arguments.runs, std::sqrt(reference.squared_error));
  nlohmann::json report{{"scene", description.name},    {"edge", arguments.edge},
                        {"threads", arguments.threads}, {"reference_rmse", std::sqrt(reference.squared_error)},
                        {"parse_s", parse_s},           {"encode_s", encode_s},
                        {"build_s", build_s},           {"renderers", nlohmann::json::array()}};
  for (const Contestant& contestant : contestants) {
    report["renderers"].push_back(to_json(contestant));
    for (const Budget& b : contestant.budgets) {
      std::printf("  %-18s %5d samples  RMSE %.2e  P99 %.2e  max %.2e  %s s\n", contestant.name.c_str(), b.samples,
                  median(b.rmse), median(b.p99), median(b.most), spread(b.seconds, "%.3f").c_str());
    }
    if (!arguments.save.empty()) save(arguments.save + "/" + contestant.name, contestant.best);
  }
  if (!arguments.save.empty()) save(arguments.save + "/reference", reference.film);
  if (!arguments.json.empty()) std::ofstream(arguments.json) << report.dump(1) << '\n';
}

int bench(const Arguments& arguments) {
  api::JobRequest job;
  const double parse_s = timed([&] { job = load_job(arguments.scene); });
  const scene::Description& description = job.scene;
  const FlatScene flat = flatten(description);
  const std::string cache =
      arguments.references + "/" + description.name + "-" + std::to_string(arguments.edge) + ".bin";
  ReferenceSettings reference_settings;
  reference_settings.width = reference_settings.height = arguments.edge;
  reference_settings.threads = static_cast<int>(std::thread::hardware_concurrency());
  const Reference reference = reference_image(description, flat, reference_settings, cache);

  job.options.width = job.options.height = arguments.edge;
  job.options.threads = arguments.threads;
  system::Pool pool(arguments.threads);
  const EmbreeScene embree(flat, description.materials, {arguments.threads, false});
  const EmbreeScene robust(flat, description.materials, {arguments.threads, true});
  std::vector<double> build_s;
  std::vector<Contestant> contestants;
  contestants.push_back({"penumbra",
                         "penumbra",
                         [&](int samples, std::uint64_t seed) {
                           scene::Options options = job.options;
                           options.shadow_samples = samples, options.seed = seed;
                           render::Control control;
                           auto picture = render::render(description, options, pool, control);
                           build_s.push_back(picture->stats.build_s);
                           return std::pair(*picture->film, picture->stats.render_s);
                         },
                         {1, 4, 8, 16, 64, 256, 1024, 4096},
                         {},
                         {}});
  // Budgets of this one are targets: the error asked for, in steps of half an order.
  contestants.push_back({"penumbra target",
                         "penumbra target",
                         [&](int half_orders, std::uint64_t seed) {
                           scene::Options options = job.options;
                           options.shadow_samples = 4096, options.seed = seed;
                           options.target_error = 0.1 * std::pow(10, -0.5 * half_orders);
                           render::Control control;
                           auto picture = render::render(description, options, pool, control);
                           return std::pair(*picture->film, picture->stats.render_s);
                         },
                         {1, 2, 3, 4},
                         {},
                         {}});
  add_embree(description, flat, embree, robust, arguments, contestants);
  if (!arguments.only.empty()) {
    std::erase_if(contestants, [&](const Contestant& c) { return c.name != arguments.only; });
  }
  compete(contestants, reference.film, arguments);

  print_report(arguments, description, reference, parse_s,
               {{"penumbra", median(build_s)}, {"embree", embree.build_seconds()}}, contestants);
  return 0;
}

}  // namespace
}  // namespace penumbra::bench

int main(int argc, char** argv) {
  if (argc < 4) return std::fprintf(stderr, "usage: bench_error SCENE.json --references FOLDER [option value]...\n"), 2;
  penumbra::bench::Arguments arguments;
  arguments.scene = argv[1];
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--references") arguments.references = value;
    if (name == "--json") arguments.json = value;
    if (name == "--save") arguments.save = value;
    if (name == "--only") arguments.only = value;
    if (name == "--threads") arguments.threads = std::stoi(value);
    if (name == "--runs") arguments.runs = std::stoi(value);
    if (name == "--edge") arguments.edge = std::stoi(value);
    if (name == "--target") arguments.target = std::stod(value);
  }
  return penumbra::bench::bench(arguments);
}
