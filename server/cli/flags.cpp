#include "server/cli/flags.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <limits>
#include <string>

#include "engine/scene/options.h"

namespace penumbra::cli {

void add_limit_flags(CLI::App& command, api::Limits& limits) {
  const auto add = [&](const std::string& name, auto& limit, const std::string& description) {
    return command.add_option(name, limit, description)
        ->check(CLI::PositiveNumber)
        ->capture_default_str()
        ->group("Limits of a job");
  };
  const auto add_bytes = [&](const std::string& name, std::size_t& limit, const std::string& description) {
    CLI::Option* const option = add(name, limit, description)->transform(CLI::AsSizeValue(false))->type_name("BYTES");
    if (limit == std::numeric_limits<std::size_t>::max()) option->default_str("any size");
  };
  add_bytes("--max-body", limits.max_body_bytes, "Largest body; 8M means 8 * 2^20");
  add("--max-json-depth", limits.max_json_depth, "Deepest nesting");
  add("--max-json-values", limits.max_json_values, "Most JSON values, elements of number arrays aside");
  add_bytes("--max-string", limits.max_string_bytes, "Longest JSON string");
  add("--max-primitives", limits.max_primitives, "Most objects");
  add("--max-lights", limits.max_lights, "Most lights");
  add("--max-polygon-vertices", limits.max_polygon_vertices, "Most vertices of a polygon");
  add("--max-triangles", limits.max_triangles, "Most triangles of meshes");
  add("--max-edge-pixels", limits.max_edge_pixels, "Largest width and height");
  add("--max-pixels", limits.max_pixels, "Most pixels");
  add("--max-samples", limits.max_samples, "Largest samples_per_pixel and shadow_samples");
  add("--max-depth", limits.max_depth, "Largest max_depth");
  require_finite(add("--max-work", limits.max_work, "Most predicted work; a time_budget_s counts 1e8 a second"));
  add_bytes("--max-memory", limits.max_memory_bytes, "Most predicted memory");
}

api::Limits limits_of_own_files() {
  api::Limits limits;
  limits.max_body_bytes = std::numeric_limits<std::size_t>::max();
  return limits;
}

void add_threads_flag(CLI::App& command, int& threads) {
  command.add_option("--threads", threads, "Render threads: N at most N, 0 one, -1 all cores, -2 all but two")
      ->check(CLI::Range(scene::cores_less_two, 4096))
      ->capture_default_str();
}

CLI::Option* require_finite(CLI::Option* option) {
  return option->check([](const std::string& text) {
    double value = 0;
    return CLI::detail::lexical_cast(text, value) && !std::isfinite(value) ? text + " is not a finite number"
                                                                           : std::string();
  });
}

void add_environment_twins(CLI::App& command) {
  for (CLI::Option* option : command.get_options()) {
    if (option->get_lnames().empty() || option->get_lnames().front() == "help") continue;
    std::string name = "PENUMBRA_";
    for (const char c : option->get_lnames().front())
      name += c == '-' ? '_' : static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    option->envname(name);
  }
}

}  // namespace penumbra::cli
