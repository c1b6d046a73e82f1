#pragma once
#include <string>
#include <vector>

#include "api/job_request.h"
#include "engine/render/render.h"
#include "tests/hunt/oracle.h"

namespace penumbra::hunt {

/// Something that is not as the contract says. `kind` is the same for what has the same cause, as far as can be told.
struct Finding {
  std::string kind, detail;
  int column = -1, row = -1;
};

/// What was looked at in one scene.
struct Report {
  std::vector<Finding> findings;
  long pixels = 0, ambiguous = 0;
  double sigma = 0;  // the oracle's, median over pixels that vary
};

/// Renders with what differs from the job.
class Renderer {
 public:
  explicit Renderer(const api::JobRequest& job) : job_(job), pool_(3) {}
  struct Change {
    int shadow_samples = 0;  // 0: the job's
    std::uint64_t seed = 0;  // added to the job's
    std::optional<scene::Acceleration> acceleration;
    std::optional<int> threads;
    std::optional<double> target_error;
    render::Switches switches;
  };
  render::Picture operator()(const Change& change);

 private:
  const api::JobRequest& job_;
  system::Pool pool_;
};

/// The picture against the oracle, with `change` for everything but samples and seed: cheaply for every pixel, then
/// again with fresh numbers and more of them wherever the two differ, until chance is out of the question.
class Judge {
 public:
  Judge(const api::JobRequest& job, const Renderer::Change& change, std::uint64_t seed);
  Judge(const Judge&) = delete;
  void run(Report& report);

  const Oracle& oracle() const { return oracle_; }
  /// After `run`: what the first look found, pixel by pixel, and which pixels rounding decides.
  const std::vector<Estimate>& truth() const { return truth_; }
  const std::vector<char>& ambiguous() const { return ambiguous_; }

 private:
  struct Seen {
    std::vector<double> mean, variance;  // of the mean, by channel
  };
  struct Suspect {
    std::size_t pixel;
    double excess;
  };
  Seen render(int seeds, std::uint64_t first_seed);
  double difference(const Seen& seen, std::size_t pixel, const Estimate& truth, int seeds, double sigmas) const;
  std::vector<Suspect> first_look(const Seen& seen, Report& report);
  bool survives(std::size_t pixel, const Seen& first, Report& report);
  void bias(const Seen& first, Report& report);
  int column(std::size_t pixel) const { return static_cast<int>(pixel) % job_.options.width; }
  int row(std::size_t pixel) const { return static_cast<int>(pixel) / job_.options.width; }

  api::JobRequest job_;  // with as many samples as it takes, and no other end
  Renderer renderer_;
  Renderer::Change change_;
  Oracle oracle_;
  Random random_;
  int seeds_ = 1;
  std::vector<Estimate> truth_;
  std::vector<char> ambiguous_;
  std::optional<Seen> some_, many_;  // pictures of several seeds, made when they are needed
};

}  // namespace penumbra::hunt
