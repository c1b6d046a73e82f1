#include "tests/hunt/hunt.h"

#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "api/problem.h"
#include "tests/hunt/checks.h"
#include "tests/hunt/shrink.h"

namespace penumbra::hunt {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double scene_limit_s = 120;  // a scene takes a fraction of a second, and some seconds on suspicion
constexpr double file_limit_s = 1800;  // of any size
constexpr int shrunk_per_kind = 2;

Clock::time_point after(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

struct Task {
  std::string name, profile;
  Json job;
  std::uint64_t seed = 0;
};

struct Worker {
  pid_t process = -1;
  int pipe = -1;
  Task task;
  std::string told;
  Clock::time_point end;
};

struct Tally {
  long scenes = 0, failed = 0, pixels = 0, ambiguous = 0;
  std::vector<double> sigmas;
  std::map<std::string, std::pair<long, long>> by_profile;  // scenes, and those with findings
  std::map<std::string, std::map<std::string, long>> by_kind;
};

void write(const Plan& plan, const Task& task, Json job, const Finding& finding) {
  std::filesystem::create_directories(plan.folder);
  job["scene"]["name"] = task.name + ": " + finding.kind + ": " + finding.detail;
  std::ofstream(plan.folder + "/" + task.name + "-" + finding.kind + ".json") << job.dump() << "\n";
}

/// In the worker: what it found first, in one line, then the files.
void work(const Plan& plan, const Task& task, const Tally& tally, int out) {
  const auto say = [&](const Json& line) {
    const std::string text = line.dump() + "\n";
    if (::write(out, text.data(), text.size()) < 0) _exit(3);
  };
  Report report;
  try {
    report = examine(api::parse_job(task.job.dump()), task.seed, Check::all);
  } catch (const api::InvalidBody& invalid) {
    report.findings.push_back({"refused", api::to_json(invalid.problem())});
  } catch (const std::exception& error) {
    report.findings.push_back({"error", error.what()});
  }
  Json line{
      {"pixels", report.pixels}, {"ambiguous", report.ambiguous}, {"sigma", report.sigma}, {"findings", Json::array()}};
  for (const Finding& finding : report.findings)
    line["findings"].push_back(Json::array({finding.kind, finding.detail}));
  say(line);
  for (const Finding& finding : report.findings) {
    const auto kind = tally.by_kind.find(finding.kind);
    const bool is_known = kind != tally.by_kind.end() && kind->second.contains(task.profile) &&
                          kind->second.at(task.profile) >= shrunk_per_kind;
    if (is_known || finding.kind == "refused" || plan.shrink_s <= 0) {
      write(plan, task, task.job, finding);
    } else {
      const Shrunk shrunk = shrink(task.job, finding, task.seed, plan.shrink_s);
      write(plan, task, shrunk.job, shrunk.finding);
    }
  }
}

Worker start(const Plan& plan, Task task, const Tally& tally) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
  Worker worker{-1, ends[0], std::move(task), {}, after(plan.files.empty() ? scene_limit_s : file_limit_s)};
  worker.process = ::fork();
  if (worker.process < 0) throw std::runtime_error("no process");
  if (worker.process == 0) {
    ::close(ends[0]);
    work(plan, worker.task, tally, ends[1]);
    _exit(0);
  }
  ::close(ends[1]);
  return worker;
}

void count(const Task& task, const Json& line, Tally& tally) {
  ++tally.scenes;
  auto& [scenes, failed] = tally.by_profile[task.profile];
  ++scenes;
  tally.pixels += line.value("pixels", 0L), tally.ambiguous += line.value("ambiguous", 0L);
  if (line.value("sigma", 0.0) > 0) tally.sigmas.push_back(line["sigma"]);
  if (line["findings"].empty()) return;
  ++failed, ++tally.failed;
  for (const Json& finding : line["findings"]) {
    ++tally.by_kind[finding[0]][task.profile];
    std::printf("%s: %s: %s\n", task.name.c_str(), finding[0].get<std::string>().c_str(),
                finding[1].get<std::string>().c_str());
  }
  std::fflush(stdout);
}

/// Reads what a worker says; whether it is done.
bool is_done(const Plan& plan, Worker& worker, Tally& tally) {
  char bytes[4096];
  const auto told_before = worker.told.find('\n') != std::string::npos;
  const ssize_t size = ::read(worker.pipe, bytes, sizeof bytes);
  if (size > 0) {
    worker.told.append(bytes, static_cast<std::size_t>(size));
    const std::size_t end = worker.told.find('\n');
    if (told_before || end == std::string::npos) return false;
    const Json line = Json::parse(worker.told.substr(0, end));
    count(worker.task, line, tally);
    const double more = 2 * plan.shrink_s * static_cast<double>(line["findings"].size()) + scene_limit_s;
    worker.end = after(more);
    return false;
  }
  int status = 0;
  ::waitpid(worker.process, &status, 0);
  ::close(worker.pipe);
  if (!told_before) {
    const bool is_late = Clock::now() >= worker.end;
    const Finding finding{is_late ? "hang" : "crash", "status " + std::to_string(status)};
    count(worker.task, {{"findings", Json::array({Json::array({finding.kind, finding.detail})})}}, tally);
    write(plan, worker.task, worker.task.job, finding);
  }
  return true;
}

/// Until `next` has nothing more to give.
template <class Next>
void run_all(const Plan& plan, const Next& next, Tally& tally) {
  std::vector<Worker> workers;
  while (true) {
    while (workers.size() < static_cast<std::size_t>(plan.workers)) {
      std::optional<Task> task = next();
      if (!task) break;
      workers.push_back(start(plan, std::move(*task), tally));
    }
    if (workers.empty()) return;
    std::vector<pollfd> pipes;
    for (const Worker& worker : workers) pipes.push_back({worker.pipe, POLLIN, 0});
    ::poll(pipes.data(), pipes.size(), 500);
    for (std::size_t i = workers.size(); i-- > 0;) {
      if (Clock::now() >= workers[i].end) ::kill(workers[i].process, SIGKILL);
      if (pipes[i].revents != 0 && is_done(plan, workers[i], tally))
        workers.erase(workers.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

int summary(Tally& tally) {
  std::printf("scenes with findings, by profile:\n");
  for (const auto& [name, counts] : tally.by_profile)
    std::printf("  %-22s %5ld of %ld\n", name.c_str(), counts.second, counts.first);
  for (const auto& [kind, profiles_of] : tally.by_kind) {
    std::printf("%s:", kind.c_str());
    for (const auto& [profile, number] : profiles_of) std::printf(" %s %ld", profile.c_str(), number);
    std::printf("\n");
  }
  std::ranges::sort(tally.sigmas);
  std::printf(
      "%ld scenes of %zu profiles, %ld pixels compared, %ld ambiguous, the oracle's sigma where light varies %.2g "
      "(median)\n",
      tally.scenes, tally.by_profile.size(), tally.pixels, tally.ambiguous,
      tally.sigmas.empty() ? 0 : tally.sigmas[tally.sigmas.size() / 2]);
  std::printf("%ld passed, %ld failed\n", tally.scenes - tally.failed, tally.failed);
  return tally.failed == 0 ? 0 : 1;
}

}  // namespace

int hunt(const Plan& plan) {
  const auto end = after(plan.seconds);
  std::uint64_t index = plan.index.value_or(0);
  long left = plan.index ? 1 : plan.count.value_or(-1);
  const Profile* only = nullptr;
  for (const Profile& profile : profiles()) {
    if (plan.profile == profile.name) only = &profile;
  }
  if (!plan.profile.empty() && only == nullptr) throw std::runtime_error("no profile " + plan.profile);
  const auto next = [&]() -> std::optional<Task> {
    if (left == 0 || (left < 0 && Clock::now() >= end)) return std::nullopt;
    if (left > 0) --left;
    const Made made = only != nullptr ? make_scene(plan.seed, index, *only) : make_scene(plan.seed, index);
    Task task{made.profile + "-" + std::to_string(plan.seed) + "-" + std::to_string(index), made.profile, made.job,
              index};
    if (plan.index) std::printf("%s\n", made.job.dump().c_str());
    ++index;
    return task;
  };
  Tally tally;
  run_all(plan, next, tally);
  return summary(tally);
}

int judge_files(const Plan& plan) {
  std::size_t index = 0;
  const auto next = [&]() -> std::optional<Task> {
    if (index == plan.files.size()) return std::nullopt;
    const std::string file = plan.files[index++];
    std::stringstream text;
    text << std::ifstream(file).rdbuf();
    const std::string name = std::filesystem::path(file).stem();
    return Task{name, name, Json::parse(text.str()), index};
  };
  Tally tally;
  run_all(plan, next, tally);
  return summary(tally);
}

}  // namespace penumbra::hunt
