#include "engine/render/render.h"
#include "engine/system/cores.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <set>

#include "api/job_request.h"
#include "api/job_resource.h"
#include "engine/output/encode.h"
#include "server/cli/command.h"
#include "server/cli/flags.h"
#include "server/cli/input.h"
#include "server/cli/progress.h"
#include "server/cli/stop_signals.h"

namespace penumbra::cli {

namespace {

struct RenderSettings {
  std::string job, output, stats;
  std::vector<std::string> overrides, without;
  int threads = scene::all_threads;
  api::Limits limits = limits_of_own_files();
};

constexpr std::string_view standard_output = "-";

scene::ImageFormat format_of(const std::string& output) {
  std::string extension = std::filesystem::path(output).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".png") return scene::ImageFormat::png;
  if (extension == ".exr") return scene::ImageFormat::exr;
  throw UnusableArgument(output + ": the output's name must end in .png or .exr");
}

/// The format follows the name of the output; what was asked for explicitly must not contradict it.
void choose_format(const RenderSettings& settings, scene::Options& options) {
  if (settings.output == standard_output) return;
  const scene::ImageFormat format = format_of(settings.output);
  const bool is_set = std::any_of(settings.overrides.begin(), settings.overrides.end(),
                                  [](const std::string& text) { return text.starts_with("format="); });
  // A body that says "png" cannot be told from one that says nothing.
  const bool is_explicit = is_set || options.format != scene::ImageFormat::png;
  if (is_explicit && options.format != format)
    throw UnusableArgument(settings.output + ": the option format asks for another kind of file");
  options.format = format;
}

void write_file(const std::string& path, const std::string& bytes) {
  if (path == standard_output) {
    std::cout << bytes << std::flush;
    return;
  }
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

void check_writable(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  if (!std::filesystem::is_directory(folder)) throw UnusableArgument(folder.string() + ": is not a directory");
}

std::map<std::string, bool*> switch_names(render::Switches& switches) {
  return {{"agreeing-rays", &switches.agreeing_rays},
          {"camera-bundles", &switches.camera_bundles},
          {"drawn-lights", &switches.drawn_lights},
          {"empty-tiles", &switches.empty_tiles},
          {"exact-area-lights", &switches.exact_area_lights},
          {"few-rays", &switches.few_rays},
          {"shadow-bundles", &switches.shadow_bundles},
          {"hidden-spheres", &switches.hidden_spheres},
          {"light-cells", &switches.light_cells},
          {"light-tree", &switches.light_tree},
          {"lights-without-share", &switches.lights_without_share},
          {"merge-lights", &switches.merge_lights},
          {"shadow-candidates", &switches.shadow_candidates},
          {"shadow-outlines", &switches.shadow_outlines},
          {"shared-samples", &switches.shared_samples}};
}

render::Switches switches_without(const std::vector<std::string>& names) {
  render::Switches switches;
  for (const std::string& name : names) *switch_names(switches).at(name) = false;
  return switches;
}

std::optional<api::JobRequest> read_job(const RenderSettings& settings) {
  const std::string body = read_input(settings.job, settings.limits.max_body_bytes);
  try {
    return api::parse_job(body, settings.overrides, settings.limits);
  } catch (const api::InvalidBody& invalid) {
    print_errors(invalid.problem(), std::cerr);
    return std::nullopt;
  }
}

void check_outputs(const RenderSettings& settings) {
  if (settings.output == standard_output) {
    if (settings.stats == standard_output) throw UnusableArgument("--stats -: the image goes to standard output");
    if (isatty(STDOUT_FILENO) == 1) throw UnusableArgument("-o -: an image does not belong on a terminal");
  } else {
    format_of(settings.output);
    check_writable(settings.output);
  }
  if (!settings.stats.empty() && settings.stats != standard_output) check_writable(settings.stats);
}

int render(const RenderSettings& settings) {
  check_outputs(settings);
  std::optional<api::JobRequest> request = read_job(settings);
  if (!request) return status_unusable;
  choose_format(settings, request->options);
  // Loads beside the render what the encoder will need.
  if (request->options.format == scene::ImageFormat::exr) output::preload();

  render::Control control;
  const StopSignals signals([&] { control.cancel(); });
  system::Pool pool(render::thread_limit(settings.threads, system::available_cores()));
  ProgressLine progress(control, request->options.progress_interval_s);
  std::optional<render::Picture> picture =
      render::render(request->scene, request->options, pool, control, switches_without(settings.without));
  if (!picture) {
    progress.stop(false);
    std::cerr << "canceled\n";
    return status_failed;
  }
  const auto start = std::chrono::steady_clock::now();
  const std::string bytes = output::encode(*picture->film, output::encoding_of(request->options));
  picture->stats.encode_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  write_file(settings.output, bytes);
  progress.stop(true);
  const std::string stats = api::to_json(picture->stats) + "\n";
  if (!settings.stats.empty()) write_file(settings.stats, stats);
  return status_done;
}

}  // namespace

Command add_render(CLI::App& program) {
  const auto settings = std::make_shared<RenderSettings>();
  CLI::App* command = program.add_subcommand("render", "Render a job to a file; the percentage goes to standard error");
  command->add_option("job", settings->job, "The job as JSON; - is standard input")->required()->type_name("JOB.json");
  command->add_option("-o,--output", settings->output, "The image: .png or .exr; - is standard output")
      ->required()
      ->type_name("FILE");
  command->add_option("--set", settings->overrides, "An option to set, as in --set width=400; repeatable")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->delimiter(' ');
  command->add_option("--stats", settings->stats, "Where to write the statistics as JSON; - is standard output")
      ->type_name("FILE");
  add_threads_flag(*command, settings->threads);
  render::Switches switches;
  std::set<std::string> names;
  for (const auto& [name, value] : switch_names(switches)) names.insert(name);
  command->add_option("--without", settings->without, "A part of the renderer to do without, for diagnosis; repeatable")
      ->check(CLI::IsMember(names))
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->delimiter(' ');
  add_limit_flags(*command, settings->limits);
  add_environment_twins(*command);
  return {command, [settings] { return render(*settings); }};
}

}  // namespace penumbra::cli
