#include "api/parse_options.h"

#include <algorithm>

#include "api/nearest.h"
#include "api/values.h"

namespace penumbra::api {

namespace {

using scene::Acceleration;
using scene::ImageFormat;
using scene::Transfer;

constexpr std::array accelerations{
    std::pair{std::string_view("bvh"), Acceleration::bvh}, std::pair{std::string_view("median"), Acceleration::median},
    std::pair{std::string_view("groups"), Acceleration::groups}, std::pair{std::string_view("cbr"), Acceleration::cbr},
    std::pair{std::string_view("none"), Acceleration::none}};
constexpr std::array transfers{std::pair{std::string_view("srgb"), Transfer::srgb},
                               std::pair{std::string_view("linear"), Transfer::linear}};
constexpr std::array formats{std::pair{std::string_view("png"), ImageFormat::png},
                             std::pair{std::string_view("exr"), ImageFormat::exr}};

std::optional<int> read_bit_depth(const Field& field) {
  if (field.is_number() && (field.value().number() == 8 || field.value().number() == 16)) {
    return static_cast<int>(field.value().number());
  }
  field.fail("must be 8 or 16");
  return std::nullopt;
}

/// The options of the body with the overrides before them.
class Choices {
 public:
  Choices(const Field& options, const std::vector<Override>& overrides)
      : options_(options), members_(options), overrides_(overrides) {}

  template <class Read, class Value>
  Value read(std::string_view name, const Read& read, Value fallback) {
    const std::optional<Field> field = find(name);
    if (!field) return fallback;
    return read(*field).value_or(fallback);
  }

  /// An option that may be absent.
  template <class Read>
  auto read(std::string_view name, const Read& read) {
    const std::optional<Field> field = find(name);
    return field ? read(*field) : decltype(read(*field)){};
  }

  void refuse_unknown() const {
    members_.refuse_unknown();
    for (const Override& given : overrides_) {
      if (std::find(known_.begin(), known_.end(), given.name) != known_.end()) continue;
      options_.fail_at(given.name, "is not a known option" + did_you_mean(given.name, known_));
    }
  }

 private:
  std::optional<Field> find(std::string_view name) {
    known_.push_back(name);
    const std::optional<Field> in_body = members_.optional(name);
    const auto given =
        std::find_if(overrides_.rbegin(), overrides_.rend(), [name](const Override& o) { return o.name == name; });
    if (given == overrides_.rend()) return in_body;
    return Field(options_, name, given->value.root());
  }

  const Field& options_;
  Members members_;
  const std::vector<Override>& overrides_;
  std::vector<std::string_view> known_;
};

}  // namespace

scene::Options read_options(const Field& field, const std::vector<Override>& overrides, const Limits& limits) {
  Choices choices(field, overrides);
  scene::Options options;
  constexpr double longest_s = 1e9;
  constexpr Range unit{0, 1};
  constexpr Range budgets{smallest_positive, longest_s};
  constexpr Range exposures{-100, 100};
  constexpr Range intervals{0, 3600};
  const auto edge = integer_in(1, limits.max_edge_pixels);
  const auto samples = integer_in(1, limits.max_samples);
  options.width = choices.read("width", edge, options.width);
  options.height = choices.read("height", edge, options.height);
  options.samples_per_pixel = choices.read("samples_per_pixel", samples, options.samples_per_pixel);
  options.shadow_samples = choices.read("shadow_samples", samples, options.shadow_samples);
  options.target_error = choices.read("target_error", number_in(positive));
  options.time_budget_s = choices.read("time_budget_s", number_in(budgets));
  options.max_depth = choices.read("max_depth", integer_in(0, limits.max_depth), options.max_depth);
  options.min_contribution = choices.read("min_contribution", number_in(unit), options.min_contribution);
  const auto threads = integer_in(scene::cores_less_two, std::numeric_limits<int>::max());
  options.threads = choices.read("threads", threads, options.threads);
  options.acceleration = choices.read("acceleration", one_of(accelerations), options.acceleration);
  options.seed = choices.read("seed", read_unsigned, options.seed);
  options.exposure = choices.read("exposure", number_in(exposures), options.exposure);
  options.transfer = choices.read("transfer", one_of(transfers), options.transfer);
  options.format = choices.read("format", one_of(formats), options.format);
  options.bit_depth = choices.read("bit_depth", read_bit_depth, options.bit_depth);
  options.progress_interval_s = choices.read("progress_interval_s", number_in(intervals), options.progress_interval_s);
  options.priority = choices.read("priority", integer_in(-100, 100), options.priority);
  choices.refuse_unknown();

  const std::int64_t pixels = std::int64_t{options.width} * options.height;
  if (pixels > limits.max_pixels) {
    field.fail("width times height must be at most " + std::to_string(limits.max_pixels) + " pixels, not " +
               std::to_string(pixels));
  }
  return options;
}

}  // namespace penumbra::api
