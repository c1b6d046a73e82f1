// Time against error: Penumbra beside brute force with Embree, interleaved in one process, against a reference.
// Usage: bench_error SCENE.json --references FOLDER [--json FILE] [--threads N] [--runs N] [--edge PIXELS]
//                    [--target RMSE] [--patience SECONDS] [--save FOLDER] [--only penumbra]
// Budgets grow until the error is below the target. Ends with 1 when a renderer's finest picture does not tend to the
// reference. --save writes the pictures of the largest budgets as bare floats, three a pixel.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "engine/output/encode.h"
#include "engine/render/render.h"
#include "tests/bench/contest.h"
#include "tests/bench/embree_image.h"
#include "tests/bench/reference.h"
#include "tests/bench/workload.h"

namespace penumbra::bench {
namespace {

struct Arguments {
  std::string scene, references, json, save, only;
  int threads = 2, edge = 800;
  ContestSettings contest;
};

/// Penumbra on one scene, and how long it took besides rendering.
class Penumbra {
 public:
  Penumbra(const scene::Description& description, scene::Options options, int threads, int edge)
      : description_(description), dark_(description), options_(std::move(options)), pool_(threads) {
    options_.width = options_.height = edge;
    options_.threads = threads;
    dark_.lights.clear();
  }

  Rendered with_samples(int samples, std::uint64_t seed) {
    scene::Options options = options_;
    options.shadow_samples = samples, options.seed = seed;
    return render(description_, options);
  }
  /// The error asked for falls by half an order for each.
  Rendered with_target(int half_orders, std::uint64_t seed) {
    scene::Options options = options_;
    options.shadow_samples = 4096, options.seed = seed;
    options.target_error = 0.1 * std::pow(10, -0.5 * half_orders);
    return render(description_, options);
  }
  /// The same picture without its lights: camera rays and surfaces alone.
  double seconds_without_lights() { return render(dark_, options_).seconds; }
  const std::vector<double>& build_seconds() const { return build_s_; }

 private:
  Rendered render(const scene::Description& description, const scene::Options& options) {
    render::Control control;
    const auto picture = render::render(description, options, pool_, control);
    build_s_.push_back(picture->stats.build_s);
    return {*picture->film, picture->stats.render_s, picture->stats.rays.shadow};
  }

  const scene::Description& description_;
  scene::Description dark_;
  scene::Options options_;
  system::Pool pool_;
  std::vector<double> build_s_;
};

void add_penumbra(Penumbra& penumbra, std::vector<Contestant>& contestants) {
  contestants.push_back({"penumbra",
                         "penumbra",
                         [&](int samples, std::uint64_t seed) { return penumbra.with_samples(samples, seed); },
                         {1, 4, 8, 16, 64, 256, 1024, 4096}});
  contestants.push_back({"penumbra target",
                         "penumbra target",
                         [&](int half_orders, std::uint64_t seed) { return penumbra.with_target(half_orders, seed); },
                         {1, 2, 3, 4, 5},
                         4});
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
             Rendered rendered;
             rendered.seconds =
                 timed([&] { rendered.film = brute_force(description, flat, is_robust ? robust : embree, settings); });
             return rendered;
           },
           {1, 4, 9, 16, 64, 256, 1024}});
    }
  }
}

void save(const std::string& name, const render::Film& film) {
  std::ofstream(name + ".f32", std::ios::binary)
      .write(reinterpret_cast<const char*>(film.rgb.data()),
             static_cast<std::streamsize>(film.rgb.size() * sizeof(float)));
}

nlohmann::json to_json(const Contestant& contestant, const Agreement& agreement) {
  nlohmann::json budgets = nlohmann::json::array();
  for (const Budget& b : contestant.budgets) {
    budgets.push_back({{"samples", b.samples},
                       {"seconds", b.seconds},
                       {"rmse", b.rmse},
                       {"p99", b.p99},
                       {"max", b.most},
                       {"shadow_rays", b.shadow_rays}});
  }
  return {{"name", contestant.name},
          {"is_cut", contestant.is_cut},
          {"bias", agreement.error.bias},
          {"agrees", agreement.holds()},
          {"budgets", budgets}};
}

/// Prints the contestant's figures.
void print(const Contestant& contestant, const Agreement& agreement) {
  for (const Budget& b : contestant.budgets) {
    std::printf("  %-18s %5d samples  RMSE %.2e  P99 %.2e  max %.2e  %s s\n", contestant.name.c_str(), b.samples,
                median(b.rmse), median(b.p99), median(b.most), spread(b.seconds, "%.3f").c_str());
  }
  std::printf("  %-18s finest beside the reference: RMSE %.1e, bias %.1e of %.1e%s\n", "", agreement.error.rmse,
              agreement.error.bias, agreement.allowed_bias, agreement.holds() ? "" : "  DIFFERS");
}

/// Prints and writes the report; returns whether all renderers show the same picture.
bool report_on(const Arguments& arguments, const std::string& scene, const Reference& reference, nlohmann::json report,
               const std::vector<Contestant>& contestants) {
  std::printf("%s, %d x %d, %d threads, %d seeds; the reference's own RMSE is %.1e\n", scene.c_str(), arguments.edge,
              arguments.edge, arguments.threads, arguments.contest.runs, std::sqrt(reference.squared_error));
  report.update({{"scene", scene},
                 {"edge", arguments.edge},
                 {"threads", arguments.threads},
                 {"runs", arguments.contest.runs},
                 {"reference_rmse", std::sqrt(reference.squared_error)},
                 {"renderers", nlohmann::json::array()}});
  bool all_agree = true;
  for (const Contestant& contestant : contestants) {
    const Agreement agreement = agreement_of(contestant, reference.film, arguments.contest);
    all_agree = all_agree && agreement.holds();
    print(contestant, agreement);
    report["renderers"].push_back(to_json(contestant, agreement));
    if (!arguments.save.empty()) save(arguments.save + "/" + contestant.name, contestant.best);
  }
  if (!arguments.save.empty()) save(arguments.save + "/reference", reference.film);
  if (!arguments.json.empty()) std::ofstream(arguments.json) << report.dump(1) << '\n';
  return all_agree;
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

  Penumbra penumbra(description, job.options, arguments.threads, arguments.edge);
  const EmbreeScene embree(flat, description.materials, {arguments.threads, false});
  const EmbreeScene robust(flat, description.materials, {arguments.threads, true});
  std::vector<Contestant> contestants;
  add_penumbra(penumbra, contestants);
  add_embree(description, flat, embree, robust, arguments, contestants);
  if (!arguments.only.empty())
    std::erase_if(contestants, [&](const Contestant& c) { return c.name != arguments.only; });
  std::vector<double> without_lights_s;
  compete(contestants, reference.film, arguments.contest,
          [&] { without_lights_s.push_back(penumbra.seconds_without_lights()); });

  std::string bytes;
  const double encode_s = timed([&] { bytes = output::encode(contestants.front().best, {}); });
  nlohmann::json report{{"parse_s", parse_s}, {"encode_s", encode_s}, {"without_lights_s", without_lights_s}};
  report["build_s"] = {{"penumbra", median(penumbra.build_seconds())}, {"embree", embree.build_seconds()}};
  const bool all_agree = report_on(arguments, description.name, reference, std::move(report), contestants);
  std::printf("  without lights: %s s\n", spread(without_lights_s, "%.3f").c_str());
  return all_agree ? 0 : 1;
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
    if (name == "--edge") arguments.edge = std::stoi(value);
    if (name == "--runs") arguments.contest.runs = std::stoi(value);
    if (name == "--target") arguments.contest.target = std::stod(value);
    if (name == "--patience") arguments.contest.patience_s = std::stod(value);
  }
  return penumbra::bench::bench(arguments);
}
